//! The comparison as text.

use std::fmt::Write as _;

use super::run::Validation;

/// The text of a validation.
#[must_use]
pub fn text(found: &Validation) -> String {
    let mut out = String::new();
    // writing to a string cannot fail
    let _ = write(&mut out, found);
    out
}

fn write(out: &mut String, found: &Validation) -> std::fmt::Result {
    for log in &found.logs {
        writeln!(out, "{}", log.log)?;
        writeln!(
            out,
            "  {:<16} {:>6} {:>10} {:>9} {:>9} {:>7} {:>9} {:>9} {:>8} {:>8}",
            "measured load",
            "rows",
            "mean (N)",
            "bias (N)",
            "RMS (N)",
            "(%)",
            "sigma (N)",
            "of sensor",
            "in 1 s.",
            "in 2 s."
        )?;
        for sensor in &log.sensors {
            let number = |value: Option<f64>| value.map_or("-".into(), |v| format!("{v:.1}"));
            let percent =
                |value: Option<f64>| value.map_or("-".into(), |v| format!("{:.2}", 100.0 * v));
            let share =
                |value: Option<f64>| value.map_or("-".into(), |v| format!("{:.0} %", 100.0 * v));
            writeln!(
                out,
                "  {:<16} {:>6} {:>10} {:>9} {:>9} {:>7} {:>9} {:>9.1} {:>8} {:>8}",
                sensor.sensor,
                sensor.rows,
                number(sensor.mean_measured_n),
                number(sensor.bias_n),
                number(sensor.rms_n),
                percent(sensor.rms_share),
                number(sensor.computed_sigma_n),
                sensor.sensor_sigma_n,
                share(sensor.inside_1_sigma),
                share(sensor.inside_2_sigma),
            )?;
        }
        for span in &log.contradictions {
            writeln!(
                out,
                "  contradiction from t = {:.2} s to {:.2} s, most at {}: measured minus computed {:+.0} N, standard \
                 deviation of both together {:.0} N{}",
                span.from_s,
                span.to_s,
                span.sensor,
                span.difference_n,
                span.sigma_n,
                span.explanation
            )?;
        }
        if log.rows_with_lifted_wheel > 0 {
            writeln!(
                out,
                "  {} rows with a lifted wheel were left out",
                log.rows_with_lifted_wheel
            )?;
        }
        for note in &log.notes {
            writeln!(out, "  note: {note}")?;
        }
    }
    for sentence in summary(found) {
        writeln!(out, "{sentence}")?;
    }
    Ok(())
}

/// Summarises the comparison of all logs, and its meaning.
pub(super) fn summary(found: &Validation) -> [String; 2] {
    let result = match (found.rms_n, found.rms_share, found.inside_sigma) {
        (Some(rms), Some(share), [Some(one), Some(two)]) => format!(
            "all loads: root mean square {rms:.1} N ({:.2} % of the mean load); {:.0} % inside one and {:.0} % inside two \
             standard deviations (a normal distribution: {:.0} % and {:.0} %)",
            100.0 * share,
            100.0 * one,
            100.0 * two,
            100.0 * found.expected_inside[0],
            100.0 * found.expected_inside[1]
        ),
        _ => "not decided: no measured load could be compared".into(),
    };
    let meaning = "The errors of one machine are much the same in all rows of a log: shares far from the expected ones need \
                   several machines or postures to mean anything. A single wheel's load includes the split between the \
                   diagonals, which uneven ground leaves open.";
    [result, meaning.into()]
}
