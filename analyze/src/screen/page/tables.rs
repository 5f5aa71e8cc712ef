//! Counts, failures and what the page means.

use std::collections::BTreeMap;

use super::super::record::{Outcome, Record};
use super::super::totals::Totals;
use super::{Seen, by_machine, log_link, raw_table, time};
use crate::events::EventKind;
use crate::page::html;

/// Logs that a table lists one by one; the data set has all.
const MOST_LOGS: usize = 200;

pub(super) fn glance(totals: &Totals, seen: &[Seen<'_>]) -> String {
    let exposed: f64 = seen.iter().map(|log| log.facts.exposure.exposed_s).sum();
    let with = |kind: EventKind| {
        seen.iter()
            .filter(|log| log.facts.events_of(kind) > 0)
            .count()
    };
    let mut facts = vec![
        (
            "Logs analysed".to_string(),
            format!("{} of {}", totals.analysed, totals.logs),
        ),
        (
            "Logs that could not be analysed".into(),
            totals.failed.to_string(),
        ),
        (
            "Logs of which a part was lost".into(),
            totals.with_losses.to_string(),
        ),
        (
            "Logs with findings (they have a report)".into(),
            totals.with_findings.to_string(),
        ),
    ];
    for &kind in EventKind::all()
        .iter()
        .filter(|kind| kind.is_stability())
        .rev()
    {
        let name = format!("Logs with {}", kind.name().replace('_', " "));
        facts.push((name, with(kind).to_string()));
    }
    let duration = format!("{} of {}", time(exposed), time(totals.duration_s));
    facts.push(("Time below the notice level".into(), duration));
    if seen.iter().any(|log| log.judgement.is_some()) {
        facts.push((
            "Logs that break the policy".into(),
            totals.breaking_policy.to_string(),
        ));
    }
    if totals.copies > 0 {
        let copies = format!("{} (counted once)", totals.copies);
        facts.push(("Paths with the content of another log".into(), copies));
    }
    html::facts(&facts)
}

/// The logs that break the policy and how; nothing without a policy.
pub(super) fn policy(seen: &[Seen<'_>]) -> String {
    let Some(name) = seen.iter().find_map(|log| Some(&log.judgement?.policy)) else {
        return String::new();
    };
    let broken: Vec<(&Seen<'_>, _)> = seen
        .iter()
        .filter_map(|log| Some((log, log.judgement.filter(|judgement| !judgement.passed)?)))
        .collect();
    let rows: Vec<Vec<String>> = (broken.iter().take(MOST_LOGS))
        .map(|(log, judgement)| {
            let rules = judgement.broken().map(|rule| {
                format!(
                    "{}: {}",
                    html::escape(&rule.rule),
                    html::escape(&rule.found)
                )
            });
            let rules: Vec<String> = rules.collect();
            vec![
                log_link(log.record),
                html::escape(log.machine()),
                rules.join("<br>"),
            ]
        })
        .collect();
    let judged = seen.iter().filter(|log| log.judgement.is_some()).count();
    format!(
        "<p>Policy {}: {} of {judged} logs break it.{}</p>\n{}",
        html::escape(name),
        broken.len(),
        rest(broken.len()),
        match rows.is_empty() {
            true => String::new(),
            false => raw_table("policy", &["log", "machine", "rules broken"], &rows),
        }
    )
}

fn rest(count: usize) -> String {
    match count > MOST_LOGS {
        true => format!(" The first {MOST_LOGS} are listed."),
        false => String::new(),
    }
}

/// Events by machine and kind.
pub(super) fn events(seen: &[Seen<'_>]) -> String {
    let kinds = EventKind::all();
    let rows: Vec<Vec<String>> = by_machine(seen)
        .iter()
        .map(|(name, logs)| {
            let hours = logs.iter().map(|log| log.facts.duration_s).sum::<f64>() / 3600.0;
            let counts = kinds.iter().map(|&kind| {
                let count: u64 = logs.iter().map(|log| log.facts.events_of(kind)).sum();
                let lasts = logs.iter().flat_map(|log| log.events);
                let lasts = lasts.filter(|event| event.kind == kind.name());
                let lasts: f64 = lasts.map(|event| event.duration_s).sum();
                match count {
                    0 => "0".to_string(),
                    _ => format!("{count} ({})", time(lasts)),
                }
            });
            let first = [
                html::escape(name),
                logs.len().to_string(),
                format!("{hours:.2} h"),
            ];
            first.into_iter().chain(counts).collect()
        })
        .collect();
    let names = kinds.iter().map(|kind| kind.name().replace('_', " "));
    let head = ["machine", "logs", "time"]
        .map(String::from)
        .into_iter()
        .chain(names);
    let head: Vec<String> = head.collect();
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    match rows.is_empty() {
        true => String::new(),
        false => raw_table("events", &head, &rows),
    }
}

/// Logs that failed, those of the same reason together.
pub(super) fn failed(failed: &[&Record]) -> String {
    if failed.is_empty() {
        return "<p>None.</p>\n".into();
    }
    let mut by_reason: BTreeMap<String, usize> = BTreeMap::new();
    for record in failed {
        *by_reason.entry(without_path(record)).or_default() += 1;
    }
    let mut reasons: Vec<(String, usize)> = by_reason.into_iter().collect();
    reasons.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    let reasons: Vec<Vec<String>> = (reasons.iter().take(MOST_LOGS))
        .map(|(reason, count)| vec![count.to_string(), reason.clone()])
        .collect();
    let logs: Vec<Vec<String>> = (failed.iter().take(MOST_LOGS))
        .map(|record| vec![record.path.clone(), without_path(record)])
        .collect();
    format!(
        "{}<p class=\"hint\">{} logs.{}</p>\n{}",
        html::table(&["logs", "reason"], &reasons),
        failed.len(),
        rest(failed.len()),
        html::table(&["log", "reason"], &logs)
    )
}

/// The reason, in which the log's own path says nothing new.
fn without_path(record: &Record) -> String {
    match &record.result {
        Outcome::Failed { reason } => reason.replace(&format!("{}: ", record.path), ""),
        Outcome::Analysed { .. } => String::new(),
    }
}

pub(super) fn losses(seen: &[Seen<'_>]) -> String {
    let lost: Vec<&Seen<'_>> = seen
        .iter()
        .filter(|log| {
            let facts = log.facts;
            facts.lost_ranges + facts.missing_messages + facts.undecodable_messages > 0
        })
        .collect();
    if lost.is_empty() {
        return String::new();
    }
    let rows: Vec<Vec<String>> = (lost.iter().take(MOST_LOGS))
        .map(|log| {
            let facts = log.facts;
            vec![
                log_link(log.record),
                format!("{} ({} bytes)", facts.lost_ranges, facts.lost_bytes),
                facts.missing_messages.to_string(),
                facts.undecodable_messages.to_string(),
            ]
        })
        .collect();
    let head = [
        "log",
        "lost ranges",
        "missing messages",
        "undecodable messages",
    ];
    format!(
        "<p class=\"hint\">{} logs.{}</p>\n{}",
        lost.len(),
        rest(lost.len()),
        raw_table("losses", &head, &rows)
    )
}

pub(super) fn meaning(seen: &[Seen<'_>]) -> String {
    let mut machines: BTreeMap<(String, String), usize> = BTreeMap::new();
    let mut versions: BTreeMap<String, usize> = BTreeMap::new();
    for log in seen {
        let record = log.record;
        if let Some(machine) = &record.machine {
            let key = (machine.name.clone(), machine.sha256.clone());
            *machines.entry(key).or_default() += 1;
        }
        let analysis = record.analysis_version.as_deref().unwrap_or("unknown");
        let version = format!(
            "tipwatch {}, model {}, analysis version {analysis}",
            record.tipwatch_version, record.model
        );
        *versions.entry(version).or_default() += 1;
    }
    let rows: Vec<Vec<String>> = machines
        .into_iter()
        .map(|((name, sha256), logs)| vec![name, sha256, logs.to_string()])
        .collect();
    let versions: Vec<String> = versions
        .into_iter()
        .map(|(v, logs)| format!("{logs} logs: {v}."))
        .collect();
    format!(
        "<p>The loads are computed from what the machines' sensors logged; nothing was weighed. The margin is \
         min over the wheels of OTF / static load, with OTF the load that a wheel has while all wheels are held to the ground \
         and the static load that at rest on level ground in the first posture of the log. One wheel off the ground is a real \
         event; a machine overturns about an edge. Standard deviations come from the uncertainties that the machine file states \
         and from the noise of the signals. Days are those of the logs' first stamps, UTC.</p>\n\
         <p>Every number here is in the data set beside this page, logs/ and events/.</p>\n{}{}",
        html::list("versions", &versions),
        html::table(&["machine", "SHA-256 of its machine file", "logs"], &rows)
    )
}
