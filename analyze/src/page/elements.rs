//! Elements of pages: sections, tables, lists, bars.

use maud::{Markup, Render, html};

pub(crate) fn section(title: &str, content: impl Render) -> Markup {
    html! { section { h2 { (title) } (content) } }
}

/// A part of a page that a reader can fold, with a name for links.
pub(crate) fn part(id: &str, title: &str, open: bool, content: impl Render) -> Markup {
    html! {
        details.part id=(id) open[open] { summary { h2 { (title) } } (content) }
    }
}

/// A table; wide ones scroll sideways on narrow screens, with the keyboard, too.
pub(crate) fn table<C: Render>(head: &[impl Render], rows: &[Vec<C>]) -> Markup {
    html! {
        div.wide tabindex="0" {
            table {
                thead { tr { @for cell in head { th scope="col" { (cell) } } } }
                tbody { @for row in rows { tr { @for cell in row { (data(cell)) } } } }
            }
        }
    }
}

/// A cell of a table; a number is never broken within.
fn data(cell: &impl Render) -> Markup {
    let text = cell.render();
    let is_number = text.0.replace(',', ".").parse::<f64>().is_ok();
    html! { td class=[is_number.then_some("whole")] { (text) } }
}

/// A table of rows that state the head of each of their cells; nothing without rows.
pub(crate) fn table_of<H: Render, const N: usize>(
    rows: impl IntoIterator<Item = [(H, String); N]>,
) -> Markup {
    let mut head = Vec::new();
    let mut cells: Vec<Vec<String>> = Vec::new();
    for row in rows {
        let (heads, values) = row.into_iter().unzip();
        head = heads;
        cells.push(values);
    }
    html! { @if !cells.is_empty() { (table(&head, &cells)) } }
}

/// A value that is never broken within.
pub(crate) fn whole(value: impl Render) -> Markup {
    html! { span.whole { (value) } }
}

/// A table of names and values.
pub(crate) fn facts<N: Render, V: Render>(rows: &[(N, V)]) -> Markup {
    html! {
        table.facts {
            tbody { @for (name, value) in rows { tr { th scope="row" { (name) } td { (value) } } } }
        }
    }
}

/// A list.
pub(crate) fn list<I: Render>(items: impl IntoIterator<Item = I>) -> Markup {
    html! { ul { @for item in items { li { (item) } } } }
}

/// A bar of a chart.
pub(crate) struct Bar {
    /// The name before it.
    pub(crate) label: String,
    /// Its length, 0 to 1.
    pub(crate) share: f64,
    /// The text behind it.
    pub(crate) text: String,
}

/// A chart of horizontal bars.
pub(crate) fn bars(bars: &[Bar]) -> Markup {
    html! {
        table.bars {
            tbody {
                @for bar in bars {
                    @let width = 100.0 * bar.share.clamp(0.0, 1.0);
                    tr {
                        th scope="row" { (bar.label) }
                        td { div style=(format_args!("width:{width:.1}%")) {} }
                        td { (bar.text) }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "10.28" stood as "10.2" above "8" on paper, where words are broken wherever a column is narrow.
    #[test]
    fn numbers_are_never_broken_within() {
        let cells = vec!["10.28", "-1,5", "above 99.9 %", "RL"];
        let html = table(&["a", "b", "c", "d"], &[cells]).into_string();
        let whole = ["10.28", "-1,5"].map(|number| format!("<td class=\"whole\">{number}</td>"));
        assert!(whole.iter().all(|cell| html.contains(cell)), "{html}");
        assert_eq!(html.matches("whole").count(), 2);
    }

    #[test]
    fn hostile_text_stays_text() {
        let rows = [vec!["</td><script>alert('&')</script>"]];
        let html = table(&["topic"], &rows).into_string();
        assert!(!html.contains("<script"));
        assert!(html.contains("&lt;/td&gt;&lt;script&gt;alert('&amp;')"));
    }
}
