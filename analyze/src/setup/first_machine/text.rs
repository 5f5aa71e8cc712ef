//! Builds the text of a machine file line by line.

use tipwatch_datasheet::comment;

/// TOML under construction.
#[derive(Debug, Default)]
pub(super) struct Text {
    lines: String,
}

impl Text {
    /// Adds a line.
    pub(super) fn line(&mut self, line: &str) -> &mut Self {
        self.lines.push_str(line);
        self.lines.push('\n');
        self
    }

    /// Adds an empty line.
    pub(super) fn gap(&mut self) -> &mut Self {
        self.line("")
    }

    /// Adds a comment, wrapped. Line breaks in names from a log or URDF cannot end it.
    pub(super) fn comment(&mut self, text: &str) -> &mut Self {
        comment(&mut self.lines, text);
        self
    }

    /// Adds lines to complete, commented out.
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

/// A TOML string; every JSON string is one.
pub(super) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A TOML key.
pub(super) fn key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    match !name.is_empty() && name.chars().all(is_bare) {
        true => name.to_owned(),
        false => quoted(name),
    }
}

/// A TOML array of strings.
pub(super) fn array(names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| quoted(name)).collect();
    format!("[{}]", names.join(", "))
}

/// A length or an angle as a TOML float, to the micrometre or microradian.
pub(super) fn number(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6 + 0.0;
    format!("{rounded:?}")
}

/// A TOML array of three lengths or angles.
pub(super) fn triple(values: [f64; 3]) -> String {
    format!("[{}]", values.map(number).join(", "))
}
