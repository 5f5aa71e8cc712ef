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
    let mut flow = Flow::new(&mut document, title)?;
    flow.title(title, subtitle);
    lay_out(&mut flow, &blocks);
    flow.finish();
    document
        .finish()
        .map_err(|error| anyhow!("PDF/A-2b: {error:?}"))
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
