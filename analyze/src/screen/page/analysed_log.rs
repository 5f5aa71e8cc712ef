//! An analysed log, as the sections of the page see it.

use std::collections::{BTreeMap, HashMap};

use maud::{Markup, html};
use tipwatch_language::{say, word};

use crate::page::time;
use crate::policy::Judgement;
use crate::policy::facts::{EventFacts, LogFacts};
use crate::screen::record::Record;

/// An analysed log, as the sections of the page see it.
#[derive(Clone, Copy)]
pub(super) struct AnalysedLog<'a> {
    pub(super) record: &'a Record,
    /// The shortest end of its path that tells it from the other logs.
    pub(super) name: &'a str,
    pub(super) facts: &'a LogFacts,
    pub(super) events: &'a [EventFacts],
    pub(super) judgement: Option<&'a Judgement>,
    /// Whether the log decides nothing.
    pub(super) is_undecided: bool,
}

impl AnalysedLog<'_> {
    pub(super) fn machine(&self) -> &str {
        let machine = self.record.machine.as_ref();
        machine.map_or(word!("unknown"), |machine| &machine.name)
    }
}

/// Time below the notice level (s), and whether it is unknown of some of the logs; `None` if of all.
pub(super) fn exposed_s(seen: &[AnalysedLog<'_>]) -> Option<(f64, bool)> {
    let exposed = || seen.iter().map(|log| log.facts.exposure.exposed_s);
    let sum = exposed().flatten().reduce(|sum, seconds| sum + seconds)?;
    Some((sum, exposed().any(|seconds| seconds.is_none())))
}

/// Describes the time below the notice level.
pub(super) fn exposed(seen: &[AnalysedLog<'_>]) -> String {
    match exposed_s(seen) {
        None => word!("unknown").into(),
        Some((seconds, true)) => say!("at least {}", time(seconds)),
        Some((seconds, false)) => time(seconds),
    }
}

/// The logs of each machine, by name.
pub(super) fn by_machine<'a>(seen: &[AnalysedLog<'a>]) -> BTreeMap<String, Vec<AnalysedLog<'a>>> {
    let mut machines: BTreeMap<String, Vec<AnalysedLog<'a>>> = BTreeMap::new();
    for log in seen {
        machines.entry(log.machine().into()).or_default().push(*log);
    }
    machines
}

/// Most machines that a table lists; the table of the logs has a card for each.
const MOST_MACHINES: usize = 200;

/// The machines that a table lists, by name, those with the longest exposure, and what to say of the others.
pub(super) fn listed_machines<'a>(
    seen: &[AnalysedLog<'a>],
) -> (Vec<(String, Vec<AnalysedLog<'a>>)>, Markup) {
    let mut machines: Vec<_> = by_machine(seen).into_iter().collect();
    let all = machines.len();
    if all > MOST_MACHINES {
        let exposed =
            |logs: &[AnalysedLog<'_>]| exposed_s(logs).map_or(0.0, |(seconds, _)| seconds);
        machines.sort_by(|(_, a), (_, b)| exposed(b).total_cmp(&exposed(a)));
        machines.truncate(MOST_MACHINES);
        machines.sort_by(|(a, _), (b, _)| a.cmp(b));
    }
    let note = html! {
        @if all > MOST_MACHINES {
            p.hint {
                (say!("{MOST_MACHINES} of {all} machines, those with the longest time below the notice level."))
            }
        }
    };
    (machines, note)
}

/// The log's name, linked to its report if it has one.
pub(super) fn log_link(log: &AnalysedLog<'_>) -> Markup {
    let (record, name) = (log.record, log.name);
    html! {
        @if let Some(folder) = record.report_folder() {
            a href={ (folder) "/report.html" } title=(record.path) { (name) }
        } @else {
            span title=(record.path) { (name) }
        }
    }
}

/// The shortest end of each path, in whole names of folders and files, that tells it from the others; of one that ends another path,
/// all of it.
pub(super) fn distinguishing<'a>(paths: &[&'a str]) -> Vec<&'a str> {
    let mut ends: Vec<&str> = paths.iter().map(|&path| with_folder(path, "")).collect();
    loop {
        let mut counts: HashMap<&str, usize> = HashMap::new();
        for end in &ends {
            *counts.entry(*end).or_default() += 1;
        }
        let mut is_done = true;
        for (end, &path) in ends.iter_mut().zip(paths) {
            let is_shared = counts.get(*end).is_some_and(|count| *count > 1);
            if is_shared && end.len() < path.len() {
                *end = with_folder(path, end);
                is_done = false;
            }
        }
        if is_done {
            return ends;
        }
    }
}

/// The end of a path with one name more.
fn with_folder<'p>(path: &'p str, end: &str) -> &'p str {
    let before = &path[..path.len() - end.len()];
    let before = before.strip_suffix('/').unwrap_or(before);
    let from = before.rfind('/').map_or(0, |slash| slash + 1);
    &path[from..]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logs_of_one_name_are_told_apart_by_their_folders() {
        let paths = [
            "/a/1/clean.mcap",
            "/a/2/clean.mcap",
            "/b/2/clean.mcap",
            "/b/2/other.mcap",
            "bag/",
            "clean.mcap",
        ];
        let expected = [
            "1/clean.mcap",
            "a/2/clean.mcap",
            "b/2/clean.mcap",
            "other.mcap",
            "bag/",
            "clean.mcap",
        ];
        assert_eq!(distinguishing(&paths), expected);
        assert_eq!(distinguishing(&["/x", "/x", ""]), ["/x", "/x", ""]);
    }
}
