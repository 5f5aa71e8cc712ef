//! Counts, policy, failures, losses, method.

use std::collections::BTreeMap;

use maud::{Markup, html};
use tipwatch_language::{say, word};

use super::super::record::{Outcome, Record};
use super::super::totals::Totals;
use super::analysed_log::{AnalysedLog, exposed, listed_machines, log_link};
use crate::events::EventKind;
use crate::events::support_words::SupportWord;
use crate::page::{facts, list, logs as in_logs, table, time};

/// Most logs that a table lists; the data set has all.
const MOST_LOGS: usize = 200;

pub(super) fn glance(totals: &Totals, seen: &[AnalysedLog<'_>]) -> Markup {
    let with = |kind: EventKind| {
        let has = |log: &&AnalysedLog<'_>| {
            let mut events = log.events.iter();
            events.any(|event| event.kind == kind && event.is_fact())
        };
        seen.iter().filter(has).count()
    };
    let computable: f64 = seen.iter().map(|log| log.facts.coverage.computable_s).sum();
    let covered: f64 = seen.iter().map(|log| log.facts.coverage.covered_s).sum();
    let mut rows = vec![
        (
            word!("Logs analysed").to_string(),
            say!("{} of {}", totals.analysed, totals.logs),
        ),
        (
            word!("Logs that could not be analysed").into(),
            totals.failed.to_string(),
        ),
        (
            word!("Logs with too little computable time to decide").into(),
            totals.undecided.to_string(),
        ),
        (
            word!("Logs with lost data").into(),
            totals.with_losses.to_string(),
        ),
        (
            word!("Logs with findings").into(),
            totals.with_findings.to_string(),
        ),
    ];
    let kinds = EventKind::ALL
        .iter()
        .filter(|kind| kind.is_stability())
        .rev();
    rows.extend(kinds.map(|&kind| {
        let name = say!("Logs with {}", SupportWord::OF_ANY_MACHINE.event(kind));
        (name, with(kind).to_string())
    }));
    rows.push((
        word!("Computable time").into(),
        say!("{} of {}", time(computable), time(covered)),
    ));
    let duration = say!("{} of {}", exposed(seen), time(computable));
    rows.push((word!("Time below the notice level").into(), duration));
    if seen.iter().any(|log| log.judgement.is_some()) {
        rows.push((
            word!("Logs that violate the policy").into(),
            totals.breaking_policy.to_string(),
        ));
    }
    if totals.copies > 0 {
        let copies = say!("{} (counted once)", totals.copies);
        rows.push((word!("Copies of another log").into(), copies));
    }
    facts(&rows)
}

/// The logs that violate the policy and how; `None` without a policy.
pub(super) fn policy(seen: &[AnalysedLog<'_>], totals: &Totals) -> Option<Markup> {
    let name = seen.iter().find_map(|log| Some(&log.judgement?.policy))?;
    let broken: Vec<_> = (seen.iter())
        .filter_map(|log| Some((log, log.judgement.filter(|judgement| !judgement.passed)?)))
        .collect();
    let listed = broken.iter().take(MOST_LOGS).map(|(log, judgement)| {
        let rules = html! {
            @for rule in judgement.violated() { div { (rule.rule) ": " (rule.found) } }
        };
        vec![log_link(log), html! { (log.machine()) }, rules]
    });
    let judged = seen.iter().filter(|log| log.judgement.is_some()).count();
    let failed = totals.failed_unaccepted;
    Some(html! {
        p {
            (say!("Policy {name}: {} of {judged} analysed logs violate it, and {} that could not be analysed.",
                broken.len(), in_logs(failed)))
            (rest(broken.len()))
        }
        @if !broken.is_empty() {
            (table(&[word!("Log"), word!("Machine"), word!("Violated rules")], &listed.collect::<Vec<_>>()))
        }
    })
}

fn rest(count: usize) -> String {
    match count > MOST_LOGS {
        true => say!(" The first {MOST_LOGS} are listed."),
        false => String::new(),
    }
}

/// Events by machine and kind; `None` without logs.
pub(super) fn events(seen: &[AnalysedLog<'_>]) -> Option<Markup> {
    let kinds = EventKind::ALL;
    let row = |(machine, logs): (String, Vec<AnalysedLog<'_>>)| -> Vec<String> {
        let computable = logs.iter().map(|log| log.facts.coverage.computable_s);
        let computable = time(computable.sum());
        let counts = kinds.iter().map(|&kind| {
            let known = logs.iter().filter_map(|log| log.facts.events_of(kind));
            let count: u64 = known.sum();
            let events = logs.iter().flat_map(|log| log.events);
            let events = events.filter(|event| event.kind == kind);
            let duration: f64 = events.map(|event| event.duration_s).sum();
            match count {
                0 => "0".to_string(),
                _ => format!("{count} ({})", time(duration)),
            }
        });
        let first = [machine, logs.len().to_string(), computable];
        first.into_iter().chain(counts).collect()
    };
    let (machines, note) = listed_machines(seen);
    let rows: Vec<_> = machines.into_iter().map(row).collect();
    let names = (kinds.iter()).map(|&kind| SupportWord::OF_ANY_MACHINE.event(kind));
    let head = [word!("Machine"), word!("Logs"), word!("Computable time")]
        .map(String::from)
        .into_iter()
        .chain(names);
    (!rows.is_empty()).then(|| html! { (note) (table(&head.collect::<Vec<_>>(), &rows)) })
}

/// Logs that failed, grouped by reason, then one by one.
pub(super) fn failed(failed: &[&Record]) -> Markup {
    if failed.is_empty() {
        return html! { p { (word!("None.")) } };
    }
    let mut by_reason: BTreeMap<String, usize> = BTreeMap::new();
    for record in failed {
        *by_reason.entry(reason(record)).or_default() += 1;
    }
    let mut reasons: Vec<(String, usize)> = by_reason.into_iter().collect();
    reasons.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    let reasons = reasons.into_iter().take(MOST_LOGS);
    let reasons: Vec<_> = reasons
        .map(|(reason, count)| vec![count.to_string(), reason])
        .collect();
    let logs = failed.iter().take(MOST_LOGS);
    let logs: Vec<_> = logs
        .map(|record| vec![record.path.clone(), reason(record)])
        .collect();
    html! {
        (table(&[word!("Logs"), word!("Reason")], &reasons))
        p.hint { (in_logs(failed.len())) "." (rest(failed.len())) }
        (table(&[word!("Log"), word!("Reason")], &logs))
    }
}

fn reason(record: &Record) -> String {
    match &record.result {
        Outcome::Failed { reason, .. } => reason.clone(),
        Outcome::Analysed { .. } => String::new(),
    }
}

/// Logs of which data was lost; `None` without any.
pub(super) fn losses(seen: &[AnalysedLog<'_>]) -> Option<Markup> {
    let has_lost = |log: &&AnalysedLog<'_>| log.facts.has_losses();
    let lost: Vec<&AnalysedLog<'_>> = seen.iter().filter(has_lost).collect();
    let rows = lost.iter().take(MOST_LOGS).map(|log| {
        let facts = log.facts;
        vec![
            log_link(log),
            html! { (say!("{} ({} bytes)", facts.lost_ranges, facts.lost_bytes)) },
            html! { @match facts.missing_messages { Some(count) => (count), None => (word!("unknown")) } },
            html! { (facts.undecodable_messages) },
        ]
    });
    let rows: Vec<_> = rows.collect();
    let head = [
        word!("Log"),
        word!("Lost ranges"),
        word!("Missing messages"),
        word!("Undecodable messages"),
    ];
    (!lost.is_empty()).then(|| {
        html! {
            p.hint { (in_logs(lost.len())) "." (rest(lost.len())) }
            (table(&head, &rows))
        }
    })
}

pub(super) fn method(seen: &[AnalysedLog<'_>]) -> Markup {
    let mut machines: BTreeMap<(String, String), usize> = BTreeMap::new();
    let mut versions: BTreeMap<String, usize> = BTreeMap::new();
    for log in seen {
        let record = log.record;
        if let Some(machine) = &record.machine {
            let key = (machine.name.clone(), machine.sha256.clone());
            *machines.entry(key).or_default() += 1;
        }
        let analysis = record
            .analysis_version
            .as_deref()
            .unwrap_or(word!("unknown"));
        let version = say!(
            "tipwatch {}, model {}, analysis version {analysis}",
            &*record.tipwatch_version,
            &*record.model
        );
        *versions.entry(version).or_default() += 1;
    }
    let of_all = machines.len();
    let machines = machines.into_iter().take(MOST_LOGS);
    let rows: Vec<_> = machines
        .map(|((name, sha256), logs)| vec![name, sha256, logs.to_string()])
        .collect();
    html! {
        p {
            (word!("The loads of wheels and other supports are computed from logged sensor signals. The margin is the minimum over them of \
                OTF / static load. A single wheel or support off the ground is a real event; the machine overturns about an edge of \
                the support polygon. Standard deviations come from the uncertainties stated in the machine file and from the noise of \
                the signals. The day of a log is that of its first row, in UTC, by the recorder's \
                clock where its stamps count from zero."))
        }
        p { (word!("All numbers are in the data set beside this page, in logs/, events/ and comparisons/.")) }
        (list(versions.iter().map(|(version, logs)| format!("{version}: {}", in_logs(*logs)))))
        @if of_all > rows.len() { p.hint { (say!("The first {} of {of_all} machine files; the data set has all.", rows.len())) } }
        (table(&[word!("Machine"), word!("SHA-256 of its machine file"), word!("Logs")], &rows))
    }
}
