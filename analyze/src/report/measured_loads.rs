//! Measured beside computed loads: the comparison as a section, and where they contradict each other as findings.

use maud::{Markup, html};
use tipwatch_language::{say, word};

use crate::analysis::Analysis;
use crate::analysis::measured_loads::{Contradiction, TOTAL};
use crate::events::Finding;
use crate::page::{number, table_of, with_sure_band};

/// The comparison by load sensor; `None` without one in the log.
pub(super) fn section(analysis: &Analysis) -> Option<Markup> {
    let comparison = &analysis.load_comparison;
    if comparison.sensors.is_empty() {
        return None;
    }
    let known = |value: Option<f64>| value.map_or(word!("unknown").into(), number);
    let share = |value: Option<f64>| {
        value.map_or(word!("unknown").into(), |v| format!("{:.0} %", 100.0 * v))
    };
    let rows = comparison.sensors.iter().map(|sensor| {
        [
            (word!("Measured load"), sensor.sensor.clone()),
            (word!("Rows"), sensor.rows.to_string()),
            (
                word!("Mean of measured minus computed [N]"),
                known(sensor.bias_n),
            ),
            ("RMS [N]", known(sensor.rms_n)),
            (word!("σ computed [N]"), known(sensor.computed_sigma_n)),
            (word!("σ sensor [N]"), number(sensor.sensor_sigma_n)),
            (word!("Inside 1 σ"), share(sensor.inside_1_sigma)),
            (word!("Inside 2 σ"), share(sensor.inside_2_sigma)),
        ]
    });
    Some(html! {
        (table_of(rows))
        p.hint {
            (word!("The computed loads do not use the measured ones. Compared are an even selection of valid rows with all \
             of them on the ground. The split between the diagonals is an assumption where equilibrium leaves it open."))
        }
    })
}

/// A finding for each time in which measured and computed loads contradict each other.
pub(super) fn findings(analysis: &Analysis) -> impl Iterator<Item = Finding> {
    let spans = analysis.load_comparison.contradictions.iter();
    spans.map(|span| finding(analysis, span))
}

fn finding(analysis: &Analysis, span: &Contradiction) -> Finding {
    let seconds = |time_ns: i64| analysis.rows.seconds_at(time_ns);
    let what = match span.sensor.as_str() {
        TOTAL => word!("the sum of the measured loads").into(),
        sensor => say!("the measured load {sensor}"),
    };
    let differs = say!(
        "From t = {:.2} to {:.2} s {what} is {} N {} than computed",
        seconds(span.start_ns),
        seconds(span.end_ns),
        with_sure_band(span.difference_n.abs(), span.sigma_n),
        if span.difference_n < 0.0 {
            word!("less")
        } else {
            word!("more")
        }
    );
    Finding {
        headline: format!("{differs}{}", span.explanation()),
        evidence: vec![span.consequence().into()],
    }
}
