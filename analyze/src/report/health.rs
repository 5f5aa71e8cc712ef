//! The health of the sensors: one table of what their stamps show, one of what their numbers show.

use maud::{Markup, html};

use crate::analysis::Analysis;
use crate::analysis::health::{NumberHealth, RateChange, SensorHealth};
use crate::page::{or_dash, percent, readable, short, table};

/// Most changes of a rate that are written out.
const MOST_CHANGES: usize = 3;

/// The section.
pub(super) fn section(analysis: &Analysis) -> Markup {
    let start_ns = analysis.rows.times_ns[0];
    let sensors_head = [
        "Signal",
        "Topic",
        "Samples",
        "Rate [Hz]",
        "Changes of the rate",
        "Longest gap",
        "Steps of its clock and the recorder's",
        "Implausible samples",
    ];
    let numbers_head = [
        "Signal",
        "Number",
        "Unit",
        "Least to greatest",
        "Resolution",
        "Noise and vibration, usual (greatest, at)",
        "At its limit",
        "Longest time without change [s]",
        "Outliers",
    ];
    let sensors = analysis.health.iter();
    let sensors: Vec<_> = sensors.map(|sensor| sensor_row(sensor, start_ns)).collect();
    let rows = |sensor: &SensorHealth| -> Vec<Vec<String>> {
        let numbers = sensor.numbers.iter();
        let row = |number| number_row(&sensor.signal, number, start_ns);
        numbers.map(row).collect()
    };
    let numbers: Vec<_> = analysis.health.iter().flat_map(rows).collect();
    html! {
        p {
            "What the sensors show by themselves, whatever the machine. Noise and vibration is the root mean square of what is "
            "faster than some 3 Hz, in half a second. A dash means that the rate is too low to tell, or that a number may rest "
            "where it is."
        }
        (table(&sensors_head, &sensors))
        (table(&numbers_head, &numbers))
    }
}

fn seconds(time_ns: i64, start_ns: i64) -> f64 {
    time_ns.saturating_sub(start_ns) as f64 * 1e-9
}

fn sensor_row(sensor: &SensorHealth, start_ns: i64) -> Vec<String> {
    let change = |change: &RateChange| {
        let RateChange {
            at_ns,
            from_hz,
            to_hz,
        } = *change;
        let at_s = seconds(at_ns, start_ns);
        format!("{from_hz:.1} to {to_hz:.1} Hz at t = {at_s:.1} s")
    };
    let changes = match &sensor.rate_changes {
        None => "irregular".to_owned(),
        Some(changes) if changes.is_empty() => "none".to_owned(),
        Some(changes) => {
            let listed: Vec<String> = changes.iter().take(MOST_CHANGES).map(change).collect();
            match changes.len().saturating_sub(MOST_CHANGES) {
                0 => listed.join("; "),
                more => format!("{}; {more} more", listed.join("; ")),
            }
        }
    };
    let gap = sensor.longest_gap_s.zip(sensor.longest_gap_ns);
    let gap = gap.map(|(gap_s, from_ns)| {
        format!("{gap_s:.3} s from t = {:.2} s", seconds(from_ns, start_ns))
    });
    vec![
        readable(&sensor.signal),
        sensor.topic.clone(),
        sensor.samples.to_string(),
        or_dash(sensor.rate_hz, 1),
        changes,
        gap.unwrap_or_else(|| "–".to_owned()),
        sensor.clock_steps.to_string(),
        sensor.implausible.to_string(),
    ]
}

fn number_row(signal: &str, number: &NumberHealth, start_ns: i64) -> Vec<String> {
    let dash = || "–".to_owned();
    let range = number.least.zip(number.greatest);
    let vibration = number.vibration_rms.zip(number.greatest_vibration_rms);
    let vibration = vibration.zip(number.greatest_vibration_ns);
    vec![
        readable(signal),
        readable(&number.name),
        number.unit.clone(),
        range.map_or_else(
            || "in no sample".to_owned(),
            |(least, greatest)| format!("{} to {}", short(least), short(greatest)),
        ),
        number.resolution.map_or_else(dash, short),
        vibration.map_or_else(dash, |((usual, greatest), at_ns)| {
            let at_s = seconds(at_ns, start_ns);
            format!("{} ({} at t = {at_s:.1} s)", short(usual), short(greatest))
        }),
        number.clipped_share.map_or_else(dash, percent),
        format!("{:.2}", number.longest_constant_s),
        number.outliers.map_or_else(dash, |count| count.to_string()),
    ]
}
