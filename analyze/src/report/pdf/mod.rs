//! The report as PDF/A-2b: the same sections as the page, laid out on A4 without a browser.

mod blocks;
mod flow;
mod picture;
mod table;
mod text;

use anyhow::{Context, Result, anyhow};
use jiff::{Timestamp, tz::TimeZone};
use krilla::configure::{Archival, ConfigurationBuilder};
use krilla::metadata::{DateTime, Metadata};
use krilla::{Document, SerializeSettings};
use maud::Markup;

use self::blocks::Block;
use self::flow::Flow;

/// The document. The same content gives the same bytes: its date, which PDF/A demands, is that of what it
/// reports on.
///
/// # Errors
/// The content is no well-formed markup, or it cannot be written as PDF/A.
pub(super) fn render(
    title: &str,
    subtitle: &str,
    date: Timestamp,
    content: &Markup,
) -> Result<Vec<u8>> {
    let markup = format!("<report>{}</report>", content.0);
    let tree = roxmltree::Document::parse(&markup).context("expected well-formed markup")?;
    let blocks = blocks::of(tree.root_element());
    let configuration = ConfigurationBuilder::new()
        .with_archival_validator(Archival::A2_B)
        .finish()
        .map_err(|error| anyhow!("PDF/A-2b: {error:?}"))?;
    let mut document = Document::new_with(SerializeSettings {
        configuration,
        ..SerializeSettings::default()
    });
    let metadata = Metadata::new()
        .title(title.into())
        .description(subtitle.into())
        .creator(concat!("tipwatch ", env!("CARGO_PKG_VERSION")).into())
        .creation_date(date_of(date))
        .language(tipwatch_language::tag().into());
    document.set_metadata(metadata);
    pages(&mut document, title, subtitle, &blocks)?.finish();
    document
        .finish()
        .map_err(|error| anyhow!("PDF/A-2b: {error:?}"))
}

/// All pages, before they are written.
fn pages<'d>(
    document: &'d mut Document,
    title: &str,
    subtitle: &str,
    blocks: &[Block<'_>],
) -> Result<Flow<'d>> {
    let mut flow = Flow::new(document, title)?;
    flow.title(title, subtitle);
    lay_out(&mut flow, blocks);
    Ok(flow)
}

fn lay_out(flow: &mut Flow<'_>, blocks: &[Block<'_>]) {
    for block in blocks {
        match block {
            Block::Heading(2, text) => flow.heading(text),
            Block::Heading(_, text) => flow.small_heading(text),
            Block::Paragraph(text) => flow.plain(text),
            Block::Item(depth, text) => flow.item(*depth, text),
            Block::Table(cells) => table::add(flow, cells),
            Block::Pictures { pictures, small } => picture::add(flow, pictures, *small),
            Block::Columns(columns) => {
                flow.columns(columns.len(), |flow, column| {
                    lay_out(flow, &columns[column]);
                });
            }
            Block::Sheet(blocks) => {
                flow.one_page(|flow| lay_out(flow, blocks));
                flow.break_page();
            }
        }
    }
}

fn date_of(time: Timestamp) -> DateTime {
    let time = time.to_zoned(TimeZone::UTC);
    let small = |number: i8| u8::try_from(number).unwrap_or(0);
    DateTime::new(u16::try_from(time.year()).unwrap_or(1970))
        .month(small(time.month()))
        .day(small(time.day()))
        .hour(small(time.hour()))
        .minute(small(time.minute()))
        .second(small(time.second()))
        .utc_offset_hour(0)
}

/// Places of the texts of a document.
#[cfg(test)]
pub(super) mod layout {
    use super::flow::{Mark, PAGE};
    use super::*;

    /// A text: where it begins and ends from the left, and from the top of the page, and the size of its letters (points).
    #[derive(Debug)]
    pub(in crate::report) struct Placed {
        pub(in crate::report) text: String,
        x: [f32; 2],
        y: [f32; 2],
        pub(in crate::report) size: f32,
    }

    impl Placed {
        pub(in crate::report) fn is_on_the_page(&self) -> bool {
            let within = |[from, to]: [f32; 2], end: f32| from >= 0.0 && to <= end;
            within(self.x, PAGE[0]) && within(self.y, PAGE[1])
        }

        /// Whether the text stands over another one, by more than a hair.
        pub(in crate::report) fn is_over(&self, other: &Self) -> bool {
            let common = |a: [f32; 2], b: [f32; 2]| a[1].min(b[1]) - a[0].max(b[0]);
            common(self.x, other.x) > 0.5 && common(self.y, other.y) > 0.3
        }
    }

    /// The texts of every page, without its foot.
    pub(in crate::report) fn texts(
        title: &str,
        subtitle: &str,
        content: &Markup,
    ) -> Vec<Vec<Placed>> {
        let markup = format!("<report>{}</report>", content.0);
        let tree = roxmltree::Document::parse(&markup).unwrap();
        let mut document = Document::new_with(SerializeSettings::default());
        let blocks = blocks::of(tree.root_element());
        let flow = pages(&mut document, title, subtitle, &blocks).unwrap();
        let placed = |mark: &Mark| match mark {
            Mark::Text {
                at: [x, y],
                size,
                text,
                ..
            } => Some(Placed {
                text: text.clone(),
                x: [*x, x + flow.letters.width(text, *size)],
                // from the top of a capital to the end of a descender
                y: [y - 0.7 * size, y + 0.2 * size],
                size: *size,
            }),
            Mark::Path { .. } => None,
        };
        let of_page = |marks: &Vec<Mark>| marks.iter().filter_map(placed).collect();
        flow.pages().iter().map(of_page).collect()
    }
}

#[cfg(test)]
mod tests {
    use maud::html;

    use super::*;
    use crate::page::{facts, section, table};

    fn example(rows: usize) -> Markup {
        let cells: Vec<Vec<String>> = (0..rows)
            .map(|row| vec![format!("{row}"), "2 σ ± 1 N".into(), "ab".repeat(60)])
            .collect();
        html! {
            (section("Custody", facts(&[("Case", "7 <&>")])))
            (section("Loads", table(&["Wheel", "Band", "SHA-256"], &cells)))
            figure.drawing {
                svg viewBox="0 0 360 100" { line class="arm" x1="0" y1="0" x2="9" y2="9" {} text x="3" y="5" font-size="11" text-anchor="end" { "RL" } }
                figcaption { "A picture" }
            }
        }
    }

    #[test]
    fn a_document_is_pdf_a_with_embedded_fonts_and_repeats_to_the_bit() {
        let content = example(5);
        let bytes = render("Report of 日本 log", "sub", Timestamp::UNIX_EPOCH, &content).unwrap();
        assert!(bytes.starts_with(b"%PDF-1.7"));
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("pdfaid:part") && text.contains("/OutputIntent"));
        assert!(text.contains("/FontFile"));
        assert!(
            bytes == render("Report of 日本 log", "sub", Timestamp::UNIX_EPOCH, &content).unwrap()
        );
    }

    #[test]
    fn a_sheet_is_one_page_as_long_as_it_can_be_read() {
        let count = |lines: usize| {
            let content = html! {
                section.sheet {
                    h2 { "Summary" }
                    @for _ in 0..lines { p { "A sentence that fills a line of the sheet and says what happened to the machine." } }
                    div.columns { @for name in ["a", "b", "c"] { div { h3 { (name) } p { "A text that is broken in its column." } } } }
                }
                section { h2 { "Events" } }
            };
            let bytes = render("t", "s", Timestamp::UNIX_EPOCH, &content).unwrap();
            String::from_utf8_lossy(&bytes).matches("/MediaBox").count()
        };
        // fifty lines take a page; smaller letters make room for more; what would be too small to read takes another page
        assert_eq!([count(1), count(40), count(60)], [2, 2, 2]);
        assert_eq!(count(100), 3);
    }

    #[test]
    fn long_tables_continue_on_further_pages() {
        let count = |rows| {
            let bytes = render("t", "s", Timestamp::UNIX_EPOCH, &example(rows)).unwrap();
            String::from_utf8_lossy(&bytes).matches("/MediaBox").count()
        };
        assert!(count(200) > count(2));
    }
}
