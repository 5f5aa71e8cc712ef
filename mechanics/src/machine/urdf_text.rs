//! The text of a URDF made readable for an XML parser: what generators leave behind and every URDF reader forgives.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

use roxmltree::{Document, Node};

/// Result of a pass over the tags of a text.
#[derive(Debug, Default)]
struct Tags<'a> {
    /// Prefixes of elements and attributes, each once, in order.
    prefixes: Vec<&'a str>,
    /// Prefixes that the root element declares.
    declared: Vec<&'a str>,
    /// Position of the end of the root element's name.
    root_name_end: Option<usize>,
    /// Start of the first element of xacro.
    macro_start: Option<usize>,
    /// Parts to leave out, in order: an XML declaration that is not at the very beginning, and a document type.
    left_out: Vec<Range<usize>>,
}

/// The text with the prefixes declared that it uses without declaring them, and without an XML declaration that comes
/// after blank lines or comments. A document type is left out, too, with the entities that it declares: a reference to one
/// is unknown to the parser, and none is ever expanded. Lines stay where they are.
pub(super) fn readable(text: &str) -> Cow<'_, str> {
    let tags = Tags::of(text);
    let is_undeclared = |prefix: &&&str| !tags.declared.contains(*prefix);
    let undeclared: Vec<&&str> = tags.prefixes.iter().filter(is_undeclared).collect();
    if undeclared.is_empty() && tags.left_out.is_empty() {
        return Cow::Borrowed(text);
    }
    let mut mended = text.to_owned();
    // the later place first: it does not move the earlier one
    if let Some(end) = tags.root_name_end {
        let declarations = undeclared
            .iter()
            .map(|prefix| format!(" xmlns:{prefix}=\"urn:undeclared:{prefix}\""));
        mended.insert_str(end, &declarations.collect::<String>());
    }
    for range in tags.left_out.into_iter().rev() {
        let blank = |c: char| if c == '\n' { '\n' } else { ' ' };
        let blanks: String = text[range.clone()].chars().map(blank).collect();
        mended.replace_range(range, &blanks);
    }
    Cow::Owned(mended)
}

/// What is found of each link, by its name; nothing in a text that cannot be read.
pub(super) fn by_link<T>(text: &str, of: impl Fn(Node<'_, '_>) -> Option<T>) -> HashMap<String, T> {
    let text = readable(text);
    let document = Document::parse(&text).ok();
    let elements = (document.iter()).flat_map(|it| it.root_element().children());
    let links = elements.filter(|element| element.has_tag_name("link"));
    let found = links.filter_map(|link| Some((link.attribute("name")?.to_string(), of(link)?)));
    found.collect()
}

/// Three numbers.
pub(super) fn triple(text: &str) -> Option<[f64; 3]> {
    let numbers = text.split_whitespace().map(str::parse);
    let numbers: Result<Vec<f64>, _> = numbers.collect();
    numbers.ok()?.try_into().ok()
}

/// Line of the first element of xacro, the macro language from which URDFs are generated. The declaration of its
/// name space alone remains in a generated URDF.
pub(super) fn line_of_macro(text: &str) -> Option<u32> {
    let start = Tags::of(text).macro_start?;
    let before = text[..start].matches('\n').count();
    u32::try_from(before + 1).ok()
}

impl<'a> Tags<'a> {
    fn of(text: &'a str) -> Self {
        let mut tags = Self::default();
        let mut at = 0;
        while let Some(start) = text[at..].find('<').map(|found| at + found) {
            let rest = &text[start..];
            at = if rest.starts_with("<!--") {
                end_of(text, start + 4, "-->")
            } else if rest.starts_with("<![CDATA[") {
                end_of(text, start, "]]>")
            } else if rest.starts_with("<?") {
                let end = end_of(text, start, "?>");
                let is_late = start > 0 && text[..start] != *"\u{feff}";
                if rest.starts_with("<?xml ") && is_late && tags.root_name_end.is_none() {
                    tags.left_out.push(start..end);
                }
                end
            } else if rest.starts_with("<!DOCTYPE") && tags.root_name_end.is_none() {
                let end = end_of_document_type(text, start);
                tags.left_out.push(start..end);
                end
            } else if rest.starts_with("<!") || rest.starts_with("</") {
                end_of(text, start, ">")
            } else {
                tags.element(text, start)
            };
        }
        tags
    }

    /// Reads the element that starts here; returns where it ends.
    fn element(&mut self, text: &'a str, start: usize) -> usize {
        let is_name = |c: char| !c.is_whitespace() && !matches!(c, '>' | '/' | '=' | '<');
        let name_end = text[start + 1..]
            .find(|c| !is_name(c))
            .map_or(text.len(), |found| start + 1 + found);
        let is_root = self.root_name_end.is_none();
        if is_root {
            self.root_name_end = Some(name_end);
        }
        if text[start + 1..name_end].starts_with("xacro:") && self.macro_start.is_none() {
            self.macro_start = Some(start);
        }
        self.prefix_of(&text[start + 1..name_end]);
        let mut quote = None;
        let mut attribute = name_end;
        for (offset, c) in text[name_end..].char_indices() {
            let here = name_end + offset;
            match (quote, c) {
                (Some(open), _) if c == open => {
                    quote = None;
                    attribute = here + 1;
                }
                (Some(_), _) => {}
                (None, '"' | '\'') => quote = Some(c),
                (None, '=') => {
                    let name = text[attribute..here].trim();
                    match name.strip_prefix("xmlns:") {
                        Some(prefix) if is_root => self.declared.push(prefix),
                        _ => self.prefix_of(name),
                    }
                }
                (None, '>') => return here + 1,
                (None, _) => {}
            }
        }
        text.len()
    }

    fn prefix_of(&mut self, name: &'a str) {
        let Some((prefix, _)) = name.split_once(':') else {
            return;
        };
        let is_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.');
        let is_prefix = prefix.starts_with(|c: char| c.is_alphabetic() || c == '_')
            && prefix.chars().all(is_word)
            && !prefix.to_ascii_lowercase().starts_with("xml");
        if is_prefix && !self.prefixes.contains(&prefix) {
            self.prefixes.push(prefix);
        }
    }
}

/// Behind the document type that starts here. Its brackets hold declarations, quotes and comments, which may hold
/// anything; the end of the text if it does not end.
fn end_of_document_type(text: &str, start: usize) -> usize {
    let mut at = start;
    let mut is_in_brackets = false;
    while let Some(c) = text[at..].chars().next() {
        let behind = at + c.len_utf8();
        at = match c {
            '<' if text[at..].starts_with("<!--") => end_of(text, at + 4, "-->"),
            '<' if text[at..].starts_with("<?") => end_of(text, at, "?>"),
            '"' | '\'' => end_of(text, behind, &c.to_string()),
            '>' if !is_in_brackets => return behind,
            _ => behind,
        };
        match c {
            '[' => is_in_brackets = true,
            ']' => is_in_brackets = false,
            _ => {}
        }
    }
    text.len()
}

/// Behind the next `mark`; the end of the text without one.
fn end_of(text: &str, from: usize, mark: &str) -> usize {
    let rest = text.get(from..).unwrap_or_default();
    rest.find(mark)
        .map_or(text.len(), |found| from + found + mark.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use roxmltree::Document;

    #[test]
    fn prefixes_are_declared_and_late_declarations_blanked() {
        for text in [
            "<robot name='r'><link name='a'><sensor:camera v:x='1'/></link></robot>",
            "<!-- made by hand -->\n<?xml version='1.0'?>\n<robot><a:b/></robot>",
            "\n\n<?xml version=\"1.0\" encoding=\"utf-8\"?><robot name='a:>'/>",
            "<robot xmlns:a='urn:a'><a:b><c:d/></a:b></robot>",
            "<robot><!-- <e:f/> --><![CDATA[ <g:h/> ]]></robot>",
            "<?xml version='1.0'?>\n<!DOCTYPE robot>\n<robot><a:b/></robot>",
            "\n<?xml version='1.0'?>\n<!DOCTYPE robot SYSTEM \"a>b\">\n<robot/>",
            "<!DOCTYPE robot [\n<!ELEMENT robot ANY>\n<!-- ]> ' -->\n<!ENTITY a ']>ü'>\n<?p ]>?>\n]>\n<robot><a:b/></robot>",
        ] {
            let mended = readable(text);
            let document = Document::parse(&mended);
            assert!(document.is_ok(), "{mended}: {:?}", document.err());
            assert_eq!(mended.lines().count(), text.lines().count(), "{text}");
        }
        let sound = "<?xml version='1.0'?><robot xmlns:a='urn:a'><a:b/></robot>";
        assert!(matches!(readable(sound), Cow::Borrowed(_)));
    }

    #[test]
    fn macros_are_found_outside_of_comments_alone() {
        let line = |text: &str| line_of_macro(text);
        assert_eq!(
            line("<robot>\n<xacro:include filename='a'/></robot>"),
            Some(2)
        );
        assert_eq!(line("<robot><link/> <!-- <xacro:a/> --></robot>"), None);
        assert_eq!(line("<robot xmlns:xacro='urn:x'/>"), None);
    }

    #[test]
    fn no_text_panics() {
        for text in [
            "",
            "<",
            "<!--",
            "<!",
            "<?xml ",
            "< a:b='",
            "<a ü:ß='>'>",
            "</",
            "<a:='b:'",
            "<!DOCTYPE",
            "<!DOCTYPE [",
            "<!DOCTYPE r [ 'ü",
            "<!DOCTYPE r [<!-- ",
        ] {
            let _ = (readable(text), line_of_macro(text));
        }
    }
}
