//! Measured beside computed loads.

use maud::{Markup, html};

use crate::analysis::Analysis;
use crate::page::{number, table};

/// The comparison by load sensor; `None` without one in the log.
pub(super) fn section(analysis: &Analysis) -> Option<Markup> {
    let comparison = &analysis.load_comparison;
    if comparison.sensors.is_empty() && comparison.contradictions.is_empty() {
        return None;
    }
    let known = |value: Option<f64>| value.map_or("unknown".into(), number);
    let share =
        |value: Option<f64>| value.map_or("unknown".into(), |v| format!("{:.0} %", 100.0 * v));
    let rows: Vec<Vec<String>> = (comparison.sensors.iter())
        .map(|sensor| {
            vec![
                sensor.sensor.clone(),
                sensor.rows.to_string(),
                known(sensor.bias_n),
                known(sensor.rms_n),
                known(sensor.computed_sigma_n),
                number(sensor.sensor_sigma_n),
                share(sensor.inside_1_sigma),
                share(sensor.inside_2_sigma),
            ]
        })
        .collect();
    let head = [
        "Measured load",
        "Rows",
        "Mean of measured minus computed [N]",
        "RMS [N]",
        "σ computed [N]",
        "σ sensor [N]",
        "Inside 1 σ",
        "Inside 2 σ",
    ];
    let start_ns = analysis.rows.times_ns.first().copied().unwrap_or(0);
    let seconds = |time_ns: i64| format!("{:.2} s", (time_ns - start_ns) as f64 * 1e-9);
    Some(html! {
        @if !rows.is_empty() {
            (table(&head, &rows))
            p.hint {
                "The computed loads do not use the measured ones. Compared are an even selection of valid rows with all \
                 of them on the ground. The split between the diagonals is an assumption where equilibrium leaves it open."
            }
        }
        @for span in &comparison.contradictions {
            p {
                "From t = " (seconds(span.start_ns)) " to " (seconds(span.end_ns))
                " measured and computed loads contradict each other, most at " (span.sensor) ": "
                (number(span.difference_n)) " N, standard deviation of both together " (number(span.sigma_n))
                " N. " (span.consequence()) (span.explanation()) "."
            }
        }
    })
}
