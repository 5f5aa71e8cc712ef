//! The tables.

use std::fmt::Write;

use super::alarms::{KINDS, false_alarms, lead_s};
use super::followed::{AHEAD_S, Followed};

/// Lead time and false alarms of every kind of alarm, and the errors of the loads ahead.
#[must_use]
pub fn of(set: &str, logs: &[Followed], each: bool) -> String {
    let mut text = String::new();
    let lifts: usize = logs.iter().map(|log| log.lifts().len()).sum();
    let hours = logs.iter().map(|log| log.on_ground_s).sum::<f64>() / 3600.0;
    writeln!(
        text,
        "\n## {set}: {} logs, {lifts} lifts, {:.0} s with all wheels on the ground\n",
        logs.len(),
        hours * 3600.0
    )
    .expect("memory");
    writeln!(
        text,
        "| alarm | lead, median | lead, least | missed or late | false | false per hour |"
    )
    .expect("memory");
    writeln!(text, "|---|---|---|---|---|---|").expect("memory");
    for kind in &KINDS {
        let mut leads: Vec<f64> = Vec::new();
        for log in logs {
            leads.extend(log.lifts().iter().map(|lift| lead_s(log, lift, kind)));
        }
        let missed = leads.iter().filter(|lead| !(**lead > 0.0)).count();
        leads.retain(|lead| *lead > 0.0);
        leads.sort_by(f64::total_cmp);
        let median = leads.get(leads.len() / 2).copied().unwrap_or(f64::NAN);
        let least = leads.first().copied().unwrap_or(f64::NAN);
        let wrong: usize = logs.iter().map(|log| false_alarms(log, kind)).sum();
        writeln!(
            text,
            "| {} | {median:.2} s | {least:.2} s | {missed} of {lifts} | {wrong} | {:.0} |",
            kind.name,
            wrong as f64 / hours
        )
        .expect("memory");
    }
    writeln!(
        text,
        "\n| loads ahead | prediction | present loads | rows |\n|---|---|---|---|"
    )
    .expect("memory");
    for (place, ahead_s) in AHEAD_S.iter().enumerate() {
        let all = logs
            .iter()
            .flat_map(|log| &log.rows)
            .map(|row| row.errors[place]);
        let both: Vec<[f64; 2]> = all.filter(|e| e.iter().all(|e| e.is_finite())).collect();
        let rms = |which: usize| {
            let sum: f64 = both.iter().map(|errors| errors[which]).sum();
            100.0 * (sum / both.len() as f64).sqrt()
        };
        writeln!(
            text,
            "| {ahead_s} s | {:.1} % | {:.1} % | {} |",
            rms(0),
            rms(1),
            both.len()
        )
        .expect("memory");
    }
    if each {
        for log in logs {
            let rms = |place: usize, which: usize| {
                let all = log.rows.iter().map(|row| row.errors[place][which]);
                let all: Vec<f64> = all.filter(|e| e.is_finite()).collect();
                100.0 * (all.iter().sum::<f64>() / all.len() as f64).sqrt()
            };
            write!(text, "{:14} {:4.1} s, lifts", log.name, log.on_ground_s).expect("memory");
            for lift in log.lifts() {
                write!(text, " {:.2} (", lift.time_s).expect("memory");
                for kind in &KINDS[..7] {
                    write!(text, " {:.2}", lead_s(log, lift, kind)).expect("memory");
                }
                write!(text, ")").expect("memory");
            }
            let wrong: Vec<_> = KINDS[..7]
                .iter()
                .map(|kind| false_alarms(log, kind))
                .collect();
            write!(text, "; false {wrong:?}; error").expect("memory");
            for place in 0..AHEAD_S.len() {
                write!(text, " {:.1}/{:.1}", rms(place, 0), rms(place, 1)).expect("memory");
            }
            writeln!(text, " %").expect("memory");
        }
    }
    text
}
