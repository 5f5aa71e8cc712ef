//! Text of numbers, comments and names.

/// Longest line of a comment, including the `#`.
const WIDTH: usize = 110;

/// A TOML string.
#[must_use]
pub fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// Appends a TOML comment, wrapped; line breaks in the text cannot end it.
pub fn comment(out: &mut String, text: &str) {
    let mut line = String::from("#");
    for word in text.split(|c: char| c.is_whitespace() || c.is_control()) {
        if line.len() > 1 && line.len() + 1 + word.len() > WIDTH {
            out.push_str(&line);
            out.push('\n');
            line = String::from("#");
        }
        line.push(' ');
        line.push_str(word);
    }
    out.push_str(&line);
    out.push('\n');
}

/// Text in XML.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&apos;"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// A TOML float.
pub(super) fn float(value: f64) -> String {
    let rounded = (value * 1e6).round() * 1e-6;
    let text = format!("{rounded:.6}");
    let text = text.trim_end_matches('0');
    match text.ends_with('.') {
        true => format!("{text}0"),
        false => text.into(),
    }
}

/// Three TOML floats.
pub(super) fn triple(values: [f64; 3]) -> String {
    format!("[{}]", values.map(float).join(", "))
}
