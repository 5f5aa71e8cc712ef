//! Text as HTML: escaping, tables, lists.

use std::fmt::Write;

/// `text` as HTML that means only itself, in elements and in quoted attributes.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            _ => escaped.push(character),
        }
    }
    escaped
}

/// JSON as it may stand in a script element: nothing in it can end the element or open a comment.
pub(crate) fn json_in_script(json: &str) -> String {
    json.replace('<', "\\u003c")
        .replace('\u{2028}', "\\u2028")
        .replace('\u{2029}', "\\u2029")
}

/// A table of plain text; wide ones scroll sideways on narrow screens.
pub(crate) fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let mut html = String::from("<div class=\"wide\"><table><thead><tr>");
    for cell in head {
        let _ = write!(html, "<th scope=\"col\">{}</th>", escape(cell));
    }
    html.push_str("</tr></thead><tbody>\n");
    for row in rows {
        html.push_str("<tr>");
        for cell in row {
            let _ = write!(html, "<td>{}</td>", escape(cell));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody></table></div>\n");
    html
}

/// A bar of a chart.
pub(crate) struct Bar {
    /// What it is about.
    pub(crate) label: String,
    /// Its length, 0 to 1.
    pub(crate) share: f64,
    /// What stands behind it.
    pub(crate) text: String,
}

/// A chart of horizontal bars.
pub(crate) fn bars(bars: &[Bar]) -> String {
    let mut html = String::from("<table class=\"bars\"><tbody>\n");
    for bar in bars {
        let _ = writeln!(
            html,
            "<tr><th scope=\"row\">{}</th><td><div style=\"width:{:.1}%\"></div></td><td>{}</td></tr>",
            escape(&bar.label),
            100.0 * bar.share.clamp(0.0, 1.0),
            escape(&bar.text)
        );
    }
    html.push_str("</tbody></table>\n");
    html
}

/// A table of names and what they mean, both plain text.
pub(crate) fn facts(rows: &[(String, String)]) -> String {
    let mut html = String::from("<table class=\"facts\"><tbody>\n");
    for (name, value) in rows {
        let _ = writeln!(
            html,
            "<tr><th scope=\"row\">{}</th><td>{}</td></tr>",
            escape(name),
            escape(value)
        );
    }
    html.push_str("</tbody></table>\n");
    html
}

/// A list of plain sentences.
pub(crate) fn list(class: &str, sentences: &[String]) -> String {
    let mut html = format!("<ul class=\"{}\">\n", escape(class));
    for sentence in sentences {
        let _ = writeln!(html, "<li>{}</li>", escape(sentence));
    }
    html.push_str("</ul>\n");
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_text_stays_text() {
        let html = table(
            &["topic"],
            &[vec!["</td><script>alert('&')</script>".into()]],
        );
        assert!(!html.contains("<script"));
        assert!(html.contains("&lt;/td&gt;&lt;script&gt;alert(&#39;&amp;&#39;)"));
    }

    #[test]
    fn json_cannot_end_its_script() {
        let json = json_in_script(r#"["</script><!--", "\u2028"]"#);
        assert!(!json.contains('<'));
        assert_eq!(
            serde_json::from_str::<Vec<String>>(&json).unwrap()[0],
            "</script><!--"
        );
    }
}
