//! The text of a machine file, line by line, each guess with its reason.

/// Longest line of a comment, its sign counted.
const WIDTH: usize = 110;

/// TOML in the making.
#[derive(Debug, Default)]
pub(super) struct Text {
    lines: String,
}

impl Text {
    /// A line as it is.
    pub(super) fn line(&mut self, line: &str) -> &mut Self {
        self.lines.push_str(line);
        self.lines.push('\n');
        self
    }

    /// An empty line.
    pub(super) fn gap(&mut self) -> &mut Self {
        self.line("")
    }

    /// A comment, broken into lines. What a log or a URDF has named cannot end it.
    pub(super) fn comment(&mut self, text: &str) -> &mut Self {
        let mut line = String::from("#");
        for word in text.split(|c: char| c.is_whitespace() || c.is_control()) {
            if line.len() > 1 && line.len() + 1 + word.len() > WIDTH {
                self.line(&line);
                line = String::from("#");
            }
            line.push(' ');
            line.push_str(word);
        }
        self.line(&line)
    }

    /// Lines that somebody has to complete: as they are, behind the sign of a comment.
    pub(super) fn open(&mut self, lines: &str) -> &mut Self {
        for line in lines.lines() {
            self.line(&format!("# {line}"));
        }
        self
    }

    pub(super) fn finish(self) -> String {
        self.lines
    }
}

/// A string of TOML. JSON's strings are strings of TOML too.
pub(super) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A name as a key of TOML.
pub(super) fn key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    match !name.is_empty() && name.chars().all(is_bare) {
        true => name.to_owned(),
        false => quoted(name),
    }
}

/// Strings as an array.
pub(super) fn array(names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| quoted(name)).collect();
    format!("[{}]", names.join(", "))
}

/// A length or an angle, to the micrometre or microradian, always as a TOML float.
pub(super) fn number(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6 + 0.0;
    format!("{rounded:?}")
}

/// Three of them.
pub(super) fn triple(values: [f64; 3]) -> String {
    format!("[{}]", values.map(number).join(", "))
}
