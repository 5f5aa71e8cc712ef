//! The comparison as a page: measured and computed loads over time, and the differences.

use maud::{Markup, html};

use super::run::{LogValidation, Validation};
use crate::page::{self, Columns, Document, Figure, Look, Plots, Scripts, Trace, section, table};

const HEIGHT: usize = 300;

/// The page. The same validation gives the same bytes.
#[must_use]
pub fn page(found: &Validation) -> String {
    let columns = Columns::default();
    let logs = found.logs.iter();
    let figures: Vec<Figure> = logs.flat_map(|log| figures(log, &columns)).collect();
    let content = html! {
        (section("Result", result(found)))
        @for log in &found.logs { (section(&log.log, of_log(log))) }
        (section("Over time", html! { (page::figures_help()) (page::figures(&figures, "")) }))
    };
    Document {
        title: "Computed against measured wheel loads",
        subtitle: &format!("Machine file {}", found.machine_file),
        styles: &[],
        plots: Some(Plots {
            figures: &figures,
            columns: &columns,
            scripts: Scripts::Within(""),
            data: &html! {},
        }),
    }
    .render(&content)
}

fn result(found: &Validation) -> Markup {
    html! { @for sentence in super::print::summary(found) { p { (sentence) } } }
}

fn of_log(log: &LogValidation) -> Markup {
    let number = |value: Option<f64>| value.map_or("unknown".into(), |v| format!("{v:.1}"));
    let share =
        |value: Option<f64>| value.map_or("unknown".into(), |v| format!("{:.1} %", 100.0 * v));
    let rows: Vec<Vec<String>> = (log.sensors.iter())
        .map(|sensor| {
            vec![
                sensor.sensor.clone(),
                sensor.rows.to_string(),
                number(sensor.mean_measured_n),
                number(sensor.bias_n),
                number(sensor.rms_n),
                number(sensor.computed_sigma_n),
                number(Some(sensor.sensor_sigma_n)),
                share(sensor.inside_1_sigma),
                share(sensor.inside_2_sigma),
            ]
        })
        .collect();
    let head = [
        "Measured load",
        "Rows",
        "Mean (N)",
        "Bias (N)",
        "RMS (N)",
        "σ computed (N)",
        "σ sensor (N)",
        "Inside 1 σ",
        "Inside 2 σ",
    ];
    let contradictions = log.contradictions.iter().map(|span| {
        format!(
            "Contradiction from t = {:.2} s to {:.2} s, most at {}: measured minus computed {:+.0} N, standard deviation of \
             both together {:.0} N{}.",
            span.from_s, span.to_s, span.sensor, span.difference_n, span.sigma_n, span.explanation
        )
    });
    html! {
        (table(&head, &rows))
        p.hint { "SHA-256 of the log: " (log.sha256.join(", ")) "." }
        (page::list(contradictions.chain(log.notes.iter().cloned())))
    }
}

/// One figure of loads and one of differences. The numbers of their curves are added to `columns`.
fn figures(log: &LogValidation, columns: &Columns) -> [Figure; 2] {
    let rows = &log.comparison.rows;
    let seconds: Vec<f64> = (rows.iter())
        .map(|row| (row.time_ns - log.start_ns) as f64 * 1e-9)
        .collect();
    let last = seconds.last().copied().unwrap_or(0.0);
    let column = |of: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..rows.len()).map(of).collect() };
    let title = format!(
        "{}: loads, with bands of two standard deviations of computed and measured load together",
        log.log
    );
    let mut loads = Figure::new(&title, "Load [N]", HEIGHT, last);
    let title = format!("{}: measured minus computed load", log.log);
    let mut differences = Figure::new(&title, "Difference [N]", HEIGHT, last);
    for (k, sensor) in log.sensors.iter().enumerate() {
        let name = &sensor.sensor;
        let sigma = |row: usize| rows[row].sigma[k].hypot(sensor.sensor_sigma_n);
        let low = column(&|row| rows[row].computed[k] - 2.0 * sigma(row));
        let high = column(&|row| rows[row].computed[k] + 2.0 * sigma(row));
        let times = seconds.iter().chain(seconds.iter().rev()).copied();
        let edges = high.iter().chain(low.iter().rev()).copied();
        let (times, edges): (Vec<f64>, Vec<f64>) = (times.collect(), edges.collect());
        let band = format!("{name} ± 2 σ");
        let band = Trace::new(columns, Look::Area, k, &band, &times, &edges);
        loads.add(band.unnamed());
        let computed = column(&|row| rows[row].computed[k]);
        let label = format!("{name} computed");
        loads.add(Trace::line(columns, k, &label, &seconds, &computed));
        let measured = column(&|row| rows[row].measured[k]);
        let label = format!("{name} measured");
        let points = Trace::new(columns, Look::Points, k, &label, &seconds, &measured);
        loads.add(points);
        let difference = column(&|row| rows[row].measured[k] - rows[row].computed[k]);
        differences.add(Trace::line(columns, k, name, &seconds, &difference));
    }
    [loads, differences]
}
