//! Assembles the page of a fleet from its sections.

use maud::html;
use tipwatch_language::{say, word};

use super::analysed_log::{AnalysedLog, by_machine, distinguishing};
use super::explorer::explorer;
use super::ranking::ranked;
use super::{distributions, outliers, tables};
use crate::page::svg::CHART_STYLE;
use crate::page::{Document, logs, section, time};
use crate::policy::Judgement;
use crate::screen::merge::LogRow;
use crate::screen::outliers::Comparison;
use crate::screen::record::Record;
use crate::screen::totals::Totals;

const PAGE_STYLE: &str = include_str!("style.css");

/// The page of all rows with their `judgements`.
pub(in crate::screen) fn render(
    rows: &[LogRow],
    judgements: &[Option<Judgement>],
    totals: &Totals,
    compared: &[Comparison],
    min_valid: f64,
) -> String {
    let paths: Vec<&str> = rows.iter().map(|row| row.record.path.as_str()).collect();
    let names = distinguishing(&paths);
    let named = || {
        rows.iter()
            .map(|row| &*row.record)
            .zip(names.iter().copied())
    };
    let analysed = named()
        .zip(judgements)
        .filter_map(|((record, name), judgement)| {
            let (facts, events) = record.analysed()?;
            Some(AnalysedLog {
                record,
                name,
                facts,
                events,
                judgement: judgement.as_ref(),
                is_undecided: facts.undecided(min_valid).is_some(),
            })
        });
    let seen: Vec<AnalysedLog<'_>> = analysed.collect();
    let failed: Vec<(&Record, &str)> = named().filter(|(it, _)| it.is_failed()).collect();
    let (explored, program) = explorer(&ranked(&seen), &failed, compared);
    let sections = [
        (word!("At a glance"), Some(tables::glance(totals, &seen))),
        (word!("Logs and machines"), Some(explored)),
        (word!("Policy"), tables::policy(&seen, totals)),
        (word!("Distributions"), distributions::margins(&seen)),
        (
            word!("Exposure by cause"),
            Some(distributions::causes(&seen)),
        ),
        (
            word!("Machines that stand out"),
            outliers::section(compared),
        ),
        (word!("Events"), tables::events(&seen)),
        (
            word!("Logs that could not be analysed"),
            Some(tables::failed(
                &failed.iter().map(|(it, _)| *it).collect::<Vec<_>>(),
            )),
        ),
        (word!("Logs with lost data"), tables::losses(&seen)),
        (word!("Method and provenance"), Some(tables::method(&seen))),
    ];
    let content = html! {
        @for (title, content) in sections {
            @if let Some(content) = content { (section(title, content)) }
        }
    };
    let machines = match by_machine(&seen).len() {
        1 => word!("1 machine").into(),
        count => say!("{count} machines"),
    };
    Document {
        title: word!("How close the fleet came to tipping over"),
        subtitle: &say!(
            "{} of {machines}, {}{}.",
            logs(totals.logs),
            time(totals.duration_s),
            span(&seen)
        ),
        styles: &[CHART_STYLE, PAGE_STYLE],
        plots: None,
    }
    .render_with(&content, Some(&program))
}

/// The first and the last day, and how many logs have none.
fn span(seen: &[AnalysedLog<'_>]) -> String {
    let days: Vec<_> = (seen.iter().filter_map(|log| log.record.date())).collect();
    let span = match (days.iter().min(), days.iter().max()) {
        (Some(first), Some(last)) if first == last => format!(", {first}"),
        (Some(first), Some(last)) => say!(", {first} to {last}"),
        _ => String::new(),
    };
    match seen.len() - days.len() {
        0 => span,
        undated => span + &say!(" ({} without a date)", logs(undated)),
    }
}
