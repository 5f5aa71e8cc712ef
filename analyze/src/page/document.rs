//! The frame of a page, what it may load, and its scripts.

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};
use serde::Serialize;
use tipwatch_language::{say, tag, word};

use super::column::Columns;
use super::figure::Figure;
use super::glossary::glossary;
use super::packed::{packed_bytes, packed_json, small_bytes, small_json};

const STYLE: &str = include_str!("style.css");
const UNPACK_SCRIPT: &str = include_str!("unpack.js");
const PAGE_SCRIPT: &str = include_str!("page.js");
const FIGURES_SCRIPT: &str = include_str!("figures.js");

/// The frame of a page.
pub(crate) struct Document<'a> {
    pub(crate) title: &'a str,
    /// The line below the title.
    pub(crate) subtitle: &'a str,
    /// Style sheets beyond the one of all pages.
    pub(crate) styles: &'a [&'a str],
    /// `None` of a page without scripts.
    pub(crate) plots: Option<Plots<'a>>,
}

/// The figures of a page, and what draws them.
pub(crate) struct Plots<'a> {
    pub(crate) figures: &'a [Figure],
    /// The numbers of their curves.
    pub(crate) columns: &'a Columns,
    /// Scripts that draw the figures, and the rest of the page's scripts.
    pub(crate) scripts: Scripts<'a>,
    /// The data that a script of the page reads.
    pub(crate) data: &'a Markup,
}

/// The scripts of a page with figures.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Scripts<'a> {
    /// In the page, which is complete in itself: a script of its own, and those of all pages.
    Within(&'a str),
    /// In a file that several pages share, at this address relative to the page.
    Beside(&'a str),
}

/// All scripts of a page with figures, in their order: that of its own kind among those of all pages.
fn scripts_with(own: &str) -> [&str; 4] {
    [UNPACK_SCRIPT, own, FIGURES_SCRIPT, PAGE_SCRIPT]
}

/// Returns the scripts as one file.
pub(crate) fn library(own: &str) -> String {
    scripts_with(own).join("\n")
}

impl Document<'_> {
    /// The whole page: the content, then the glossary of its terms.
    pub(crate) fn render(&self, content: &Markup) -> String {
        self.render_with(content, None)
    }

    /// Renders the whole page with a program of its own.
    pub(crate) fn render_with(&self, content: &Markup, program: Option<&Program>) -> String {
        self.page(content, &glossary(content), program)
    }

    /// Renders a sheet with what is folded behind it: the glossary has the terms of the sheet alone.
    pub(crate) fn render_sheet(&self, sheet: &Markup, folded: &Markup) -> String {
        let content = html! { (sheet) (folded) };
        self.page(&content, &glossary(sheet), None)
    }

    fn page(&self, content: &Markup, glossary: &Markup, program: Option<&Program>) -> String {
        let page = html! {
            (DOCTYPE)
            html lang=(tag()) {
                head {
                    meta charset="utf-8";
                    meta http-equiv="Content-Security-Policy" content=(self.policy());
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) @for style in self.styles { (PreEscaped(style)) } }
                }
                body {
                    header {
                        button.screen type="button" id="theme" hidden { (word!("Dark")) }
                        h1 { (self.title) }
                        p.subtitle { (self.subtitle) }
                    }
                    main {
                        (content)
                        (glossary)
                    }
                    @if let Some(program) = program { (program) }
                    @if let Some(plots) = &self.plots { (plots) } @else { script { (PreEscaped(PAGE_SCRIPT)) } }
                }
            }
        };
        page.into_string()
    }

    /// A page loads nothing from elsewhere, whatever the names in the log contain.
    fn policy(&self) -> String {
        let data = match self.plots {
            None => "",
            Some(_) => "; img-src data: blob:",
        };
        // a page on a disk has no origin: "self" does not allow the file beside it
        let library = match self.plots.as_ref().map(|plots| plots.scripts) {
            Some(Scripts::Beside(_)) => " 'self' file:",
            Some(Scripts::Within(_)) | None => "",
        };
        format!(
            "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'{library}{data}"
        )
    }
}

/// A script with its packed data, which finds them under the id `data`.
pub(crate) struct Program {
    /// The data as a script element.
    data: String,
    script: &'static str,
}

impl Program {
    pub(crate) fn new(data: &impl Serialize, script: &'static str) -> Self {
        let mut element = String::new();
        small_json(&mut element, "data", data);
        Self {
            data: element,
            script,
        }
    }

    /// Length of the data in the page (bytes).
    pub(crate) fn length(&self) -> usize {
        self.data.len()
    }
}

impl Render for Program {
    fn render_to(&self, page: &mut String) {
        page.push_str(&self.data);
        for script in [UNPACK_SCRIPT, self.script] {
            html! { script { (PreEscaped(script)) } }.render_to(page);
        }
    }
}

/// The scripts and their data.
impl Render for Plots<'_> {
    fn render_to(&self, page: &mut String) {
        let columns = self.columns.bytes();
        page.reserve(self.data.0.len() + columns.len());
        match self.scripts {
            Scripts::Within(_) => {
                packed_json(page, "figures", &self.figures);
                packed_bytes(page, "columns", &columns);
            }
            // one of many
            Scripts::Beside(_) => {
                small_json(page, "figures", &self.figures);
                small_bytes(page, "columns", &columns);
            }
        }
        self.data.render_to(page);
        match self.scripts {
            Scripts::Within(own) => {
                for script in scripts_with(own) {
                    html! { script { (PreEscaped(script)) } }.render_to(page);
                }
            }
            Scripts::Beside(address) => {
                let missing = "document.getElementById('no-library').hidden = false";
                html! {
                    p id="no-library" hidden {
                        (say!("The plots are not drawn: they need the file {address}, which is not where this page expects it. Copy this \
                        page together with the folder above it."))
                    }
                    script src=(address) onerror=(missing) {}
                }
                .render_to(page);
            }
        }
    }
}

/// Data of numbers, names and lists of them as a packed script element, which `unpacked` in `unpack.js` reads.
pub(crate) fn packed_script(id: &'static str, data: &impl Serialize) -> Markup {
    let mut element = String::new();
    small_json(&mut element, id, data);
    PreEscaped(element)
}

/// Data of numbers, names and lists of them as a script element, in which nothing can end the element or
/// open a comment.
pub(crate) fn json_script(id: &str, data: &impl Serialize) -> Markup {
    // what holds only numbers and names can always be written
    let json = serde_json::to_string(data).unwrap_or_else(|_| "null".to_string());
    let replacements = [
        ('<', "\\u003c"),
        ('\u{2028}', "\\u2028"),
        ('\u{2029}', "\\u2029"),
    ];
    let json = (replacements.iter()).fold(json, |json, (hostile, harmless)| {
        match json.contains(*hostile) {
            true => json.replace(*hostile, harmless),
            false => json,
        }
    });
    html! { script type="application/json" id=(id) { (PreEscaped(json)) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_glossary_of_a_sheet_has_its_terms_alone() {
        let document = Document {
            title: "",
            subtitle: "",
            styles: &[],
            plots: None,
        };
        let [sheet, folded] = ["OTF", "TOM"].map(|term| html! { p { (term) } });
        let page = document.render_sheet(&sheet, &folded);
        let explains = |page: &str, term: &str| page.contains(&format!("<th scope=\"row\">{term}"));
        assert!(explains(&page, "OTF") && !explains(&page, "TOM"));
        assert!(page.contains("<p>TOM</p>"));
        let whole = document.render(&html! { (sheet) (folded) });
        assert!(explains(&whole, "TOM"));
    }

    #[test]
    fn json_cannot_end_its_script() {
        let hostile = ["</script><!--", "\u{2028}"];
        let element = json_script("data", &hostile).into_string();
        let (_, rest) = element.split_once('>').unwrap();
        let json = rest.strip_suffix("</script>").unwrap();
        assert!(!json.contains('<') && !json.contains('\u{2028}'));
        assert_eq!(serde_json::from_str::<Vec<String>>(json).unwrap(), hostile);
    }
}
