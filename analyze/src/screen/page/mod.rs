//! `fleet.html`: what a fleet engineer looks at in the morning. One file without scripts, for screens of
//! any width and for paper, in colours that black and white keep apart.

mod distributions;
mod ranking;
mod tables;
mod trend;

use super::merge::LogRow;
use super::record::Record;
use super::totals::Totals;
use crate::page::html;
use crate::page::svg::CHART_STYLE;
use crate::policy::Judgement;
use crate::policy::facts::{EventFacts, LogFacts};
use crate::report::STYLE;
use crate::report::section;

const PAGE_STYLE: &str = include_str!("style.css");
/// Nothing is ever fetched or run, whatever a name in a log says.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'";

/// A log that was analysed, as the page's parts see it.
#[derive(Clone, Copy)]
struct Seen<'a> {
    record: &'a Record,
    facts: &'a LogFacts,
    events: &'a [EventFacts],
    judgement: Option<&'a Judgement>,
}

impl Seen<'_> {
    fn machine(&self) -> &str {
        let machine = self.record.machine.as_ref();
        machine.map_or("unknown", |machine| &machine.name)
    }
}

/// The page of all rows; `judgements` go with them.
pub(super) fn render(rows: &[LogRow], judgements: &[Option<Judgement>], totals: &Totals) -> String {
    let seen: Vec<Seen<'_>> = rows
        .iter()
        .zip(judgements)
        .filter_map(|(row, judgement)| {
            let (facts, events) = row.record.analysed()?;
            let (record, judgement) = (&row.record, judgement.as_ref());
            Some(Seen {
                record,
                facts,
                events,
                judgement,
            })
        })
        .collect();
    let failed: Vec<&Record> = rows
        .iter()
        .map(|row| &row.record)
        .filter(|r| r.is_failed())
        .collect();
    let mut page = head(&seen, totals);
    let mut add = |title: &str, content: String| {
        if !content.is_empty() {
            page.push_str(&section(title, &content));
        }
    };
    add("At a glance", tables::glance(totals, &seen));
    add("Ranking", ranking::table(&seen));
    add("Policy", tables::policy(&seen));
    add("Distributions", distributions::margins(&seen));
    add("Exposure by cause", distributions::causes(&seen));
    add("Trend per machine", trend::machines(&seen));
    add("Events", tables::events(&seen));
    add("Logs that could not be analysed", tables::failed(&failed));
    add("Logs of which a part was lost", tables::losses(&seen));
    add(
        "How to read this, and where it comes from",
        tables::meaning(&seen),
    );
    page.push_str("</body>\n</html>\n");
    page
}

fn head(seen: &[Seen<'_>], totals: &Totals) -> String {
    let machines = by_machine(seen).len();
    let mut days: Vec<String> = seen.iter().filter_map(|log| log.record.day()).collect();
    days.sort();
    let span = match (days.first(), days.last()) {
        (Some(first), Some(last)) if first == last => format!(", {first}"),
        (Some(first), Some(last)) => format!(", {first} to {last}"),
        _ => String::new(),
    };
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Fleet: {logs} logs</title>\n<style>\n{STYLE}{CHART_STYLE}{PAGE_STYLE}</style>\n</head>\n<body>\n\
         <h1>How close the fleet came to tipping over</h1>\n\
         <p class=\"subtitle\">{logs} logs of {machines} {word}, {hours:.1} h{span}.</p>\n",
        logs = totals.logs,
        word = if machines == 1 { "machine" } else { "machines" },
        hours = totals.duration_s / 3600.0,
    )
}

/// The logs of each machine, by name.
fn by_machine<'a>(seen: &[Seen<'a>]) -> Vec<(String, Vec<Seen<'a>>)> {
    let mut machines: std::collections::BTreeMap<String, Vec<Seen<'a>>> = Default::default();
    for log in seen {
        machines.entry(log.machine().into()).or_default().push(*log);
    }
    machines.into_iter().collect()
}

/// The log's name, linked to its report if it has one.
fn log_link(record: &Record) -> String {
    let (name, path) = (html::escape(&record.name()), html::escape(&record.path));
    match record.report_folder() {
        Some(folder) => format!("<a href=\"{folder}/report.html\" title=\"{path}\">{name}</a>"),
        None => format!("<span title=\"{path}\">{name}</span>"),
    }
}

/// A share in per cent.
fn percent(share: f64) -> String {
    // plus zero: minus nothing reads as nothing
    format!("{:.1} %", (share * 1000.0).round() / 10.0 + 0.0)
}

/// A time in the unit that suits it.
fn time(seconds: f64) -> String {
    match seconds {
        s if s >= 3600.0 => format!("{:.1} h", s / 3600.0),
        s if s >= 60.0 => format!("{:.1} min", s / 60.0),
        s => format!("{s:.1} s"),
    }
}

/// A table whose cells are HTML already.
fn raw_table(class: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    let cells = |tag: &str, cells: &[String]| -> String {
        cells
            .iter()
            .map(|cell| format!("<{tag}>{cell}</{tag}>"))
            .collect()
    };
    let head: String = head
        .iter()
        .map(|cell| format!("<th scope=\"col\">{}</th>", html::escape(cell)))
        .collect();
    let rows: String = rows
        .iter()
        .map(|row| format!("<tr>{}</tr>\n", cells("td", row)))
        .collect();
    format!(
        "<div class=\"wide\"><table class=\"{class}\"><thead><tr>{head}</tr></thead><tbody>\n{rows}</tbody></table></div>\n"
    )
}
