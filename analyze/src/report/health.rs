//! The health of the sensors: one table of what their stamps show, one of what their numbers show.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, word};

use crate::analysis::Analysis;
use crate::analysis::health::{NumberHealth, RateChange, SensorHealth};
use crate::page::{or_dash, percent, readable, short, table_of};

/// Most changes of a rate that are written out.
const MOST_CHANGES: usize = 3;

/// The section.
pub(super) fn section(analysis: &Analysis) -> Markup {
    let start_ns = analysis.rows.times_ns[0];
    let sensors = analysis.health.iter();
    let numbers = sensors.clone().flat_map(|sensor| {
        let row = |number| number_row(&sensor.signal, number, start_ns);
        sensor.numbers.iter().map(row)
    });
    html! {
        p {
            (word!("What the sensors show by themselves, whatever the machine. Noise and vibration is the root mean square of what is \
            faster than some 3 Hz, in half a second. A dash means that the rate is too low to tell, or that a number may rest \
            where it is."))
        }
        (table_of(sensors.map(|sensor| sensor_row(sensor, start_ns))))
        (table_of(numbers))
    }
}

fn seconds(time_ns: i64, start_ns: i64) -> f64 {
    time_ns.saturating_sub(start_ns) as f64 * 1e-9
}

fn sensor_row(sensor: &SensorHealth, start_ns: i64) -> [(&'static str, String); 8] {
    let change = |change: &RateChange| {
        let RateChange {
            at_ns,
            from_hz,
            to_hz,
        } = *change;
        let at_s = seconds(at_ns, start_ns);
        say!("{from_hz:.1} to {to_hz:.1} Hz at t = {at_s:.1} s")
    };
    let changes = match &sensor.rate_changes {
        None => word!("irregular").to_owned(),
        Some(changes) if changes.is_empty() => word!("none").to_owned(),
        Some(changes) => {
            let listed: Vec<String> = changes.iter().take(MOST_CHANGES).map(change).collect();
            match changes.len().saturating_sub(MOST_CHANGES) {
                0 => listed.join("; "),
                more => say!("{}; {more} more", listed.join("; ")),
            }
        }
    };
    let gap = sensor.longest_gap_s.zip(sensor.longest_gap_ns);
    let gap = gap
        .map(|(gap_s, from_ns)| say!("{gap_s:.3} s from t = {:.2} s", seconds(from_ns, start_ns)));
    let (clock_steps, implausible) = (sensor.clock_steps, sensor.implausible);
    [
        (word!("Signal"), readable(&sensor.signal)),
        (word!("Topic"), sensor.topic.clone()),
        (word!("Samples"), sensor.samples.to_string()),
        (word!("Rate [Hz]"), or_dash(sensor.rate_hz, 1)),
        (word!("Changes of the rate"), changes),
        (word!("Longest gap"), gap.unwrap_or_else(|| "–".to_owned())),
        (
            word!("Steps of its clock and the recorder's"),
            clock_steps.to_string(),
        ),
        (word!("Implausible samples"), implausible.to_string()),
    ]
}

fn number_row(signal: &str, number: &NumberHealth, start_ns: i64) -> [(&'static str, String); 9] {
    let dash = || "–".to_owned();
    let range = number.least.zip(number.greatest);
    let vibration = number.vibration_rms.zip(number.greatest_vibration_rms);
    let vibration = vibration.zip(number.greatest_vibration_ns);
    let range = range.map_or_else(
        || word!("in no sample").to_owned(),
        |(least, greatest)| say!("{} to {}", short(least), short(greatest)),
    );
    let vibration = vibration.map_or_else(dash, |((usual, greatest), at_ns)| {
        let at_s = seconds(at_ns, start_ns);
        say!("{} ({} at t = {at_s:.1} s)", short(usual), short(greatest))
    });
    let (constant_s, outliers) = (number.longest_constant_s, number.outliers);
    [
        (word!("Signal"), readable(signal)),
        (word!("Number"), readable(&number.name)),
        (word!("Unit"), number.unit.clone()),
        (word!("Least to greatest"), range),
        (
            word!("Resolution"),
            number.resolution.map_or_else(dash, short),
        ),
        (
            word!("Noise and vibration, usual (greatest, at)"),
            vibration,
        ),
        (
            word!("At its limit"),
            number.clipped_share.map_or_else(dash, percent),
        ),
        (
            word!("Longest time without change [s]"),
            decimals(format!("{constant_s:.2}")),
        ),
        (
            word!("Outliers"),
            outliers.map_or_else(dash, |count| count.to_string()),
        ),
    ]
}
