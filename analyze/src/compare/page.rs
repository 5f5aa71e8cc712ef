//! `comparison.html`: the same to look at. One file without scripts.

use super::comparison::Comparison;
use super::facts::in_words;
use super::series::shared_rows;
use super::side::Side;
use super::text::{event, origin};
use crate::base::number::number;
use crate::page::html;
use crate::page::svg::{CHART_STYLE, Chart};
use crate::report::STYLE;
use crate::report::section;

const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'";
/// Points of a curve.
const MOST_POINTS: usize = 600;

/// The comparison as an HTML page.
#[must_use]
pub fn render(comparison: &Comparison, a: &Side, b: &Side) -> String {
    let sides = [
        ("A".to_string(), origin(&comparison.a)),
        ("A says".into(), comparison.a.finding.clone()),
        ("B".into(), origin(&comparison.b)),
        ("B says".into(), comparison.b.finding.clone()),
        (
            "Log".into(),
            match comparison.same_log {
                true => "the same content on both sides".into(),
                false => "different logs".into(),
            },
        ),
    ];
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Comparison</title>\n<style>\n{STYLE}{CHART_STYLE}</style>\n</head>\n<body>\n\
         <h1>Two results side by side</h1>\n{}",
        html::facts(&sides)
    );
    page.push_str(&section("Events", &events(comparison)));
    page.push_str(&section("Curves", &curves(comparison, a, b)));
    page.push_str(&section("Whole log", &facts(comparison)));
    page.push_str(&section("Row by row", &series(comparison)));
    page.push_str("</body>\n</html>\n");
    page
}

fn events(comparison: &Comparison) -> String {
    if comparison.events.is_empty() {
        return "<p>Neither has an event.</p>\n".into();
    }
    let told: Vec<String> = comparison.events.iter().map(event).collect();
    html::list("events", &told)
}

fn facts(comparison: &Comparison) -> String {
    let rows: Vec<Vec<String>> = comparison
        .facts
        .iter()
        .map(|fact| {
            vec![
                fact.name.clone(),
                in_words(fact.a, fact.unit),
                in_words(fact.b, fact.unit),
                in_words(fact.difference, fact.unit),
                fact.unit.into(),
            ]
        })
        .collect();
    html::table(&["", "A", "B", "B - A", "unit"], &rows)
}

fn series(comparison: &Comparison) -> String {
    let Some(series) = &comparison.series else {
        let note = comparison.series_note.as_deref().unwrap_or("unknown");
        return format!("<p>Not compared row by row: {}.</p>\n", html::escape(note));
    };
    let rows: Vec<Vec<String>> = series
        .columns
        .iter()
        .map(|column| {
            vec![
                column.column.clone(),
                number(column.mean),
                number(column.rms),
                number(column.largest),
                column
                    .relative
                    .map_or(String::new(), |r| format!("{:.2} %", 100.0 * r)),
                column.unit.clone(),
            ]
        })
        .collect();
    let head = [
        "column",
        "mean B - A",
        "rms",
        "largest",
        "rms, relative",
        "unit",
    ];
    let mut text = format!(
        "<p class=\"hint\">{} rows that are valid on both sides.</p>\n",
        series.rows
    );
    text.push_str(&html::table(&head, &rows));
    for (letter, names) in [("A", &series.only_a), ("B", &series.only_b)] {
        if !names.is_empty() {
            text.push_str(&format!(
                "<p class=\"hint\">Only {letter} has {}.</p>\n",
                html::escape(&names.join(", "))
            ));
        }
    }
    text
}

/// OTF of each wheel that both have, over the rows that they share; else each over its own time.
fn curves(comparison: &Comparison, a: &Side, b: &Side) -> String {
    let names = a.columns.iter().map(|column| column.name.as_str());
    let wheels: Vec<&str> = names
        .filter_map(|name| name.strip_prefix("otf_"))
        .filter(|wheel| !wheel.ends_with("_sigma") && b.column(&format!("otf_{wheel}")).is_some())
        .collect();
    if wheels.is_empty() {
        return "<p>The two machines have no wheel of the same name.</p>\n".into();
    }
    let together = comparison.series.is_some();
    let rows = match together {
        true => shared_rows(a, b),
        false => Vec::new(),
    };
    let (mut both, mut differences) = (String::new(), String::new());
    for wheel in wheels {
        let column = format!("otf_{wheel}");
        let Some((on_a, on_b)) = a.column(&column).zip(b.column(&column)) else {
            continue;
        };
        let curves = [curve(a, &on_a.values), curve(b, &on_b.values)];
        let wheel = wheel.to_uppercase();
        both.push_str(&chart(
            &format!("OTF {wheel} (N)"),
            &curves,
            &["line-a", "line-b"],
        ));
        let points = rows
            .iter()
            .map(|&(i, j)| (seconds(a, i), on_b.values[j] - on_a.values[i]));
        let points: Vec<_> = points.collect();
        if together {
            let title = format!("B - A, OTF {wheel} (N)");
            differences.push_str(&chart(&title, &[thinned(&points)], &["line-a"]));
        }
    }
    let when = match together {
        true => "on both sides at the same time",
        false => "each from its own first row",
    };
    format!(
        "<p class=\"hint\">OTF of each wheel over time, {when}. Solid: A; dashed: B.</p>\n\
         <div class=\"grid\">\n{both}</div>\n<div class=\"grid\">\n{differences}</div>\n"
    )
}

fn seconds(side: &Side, row: usize) -> f64 {
    (side.times_ns[row] - side.times_ns[0]) as f64 * 1e-9
}

/// Values over time, broken where a row is not valid.
fn curve(side: &Side, values: &[f64]) -> Vec<(f64, f64)> {
    let points = values.iter().enumerate().map(|(row, &value)| {
        let value = if side.valid[row] { value } else { f64::NAN };
        (seconds(side, row), value)
    });
    thinned(&points.collect::<Vec<_>>())
}

/// At most so many points as a chart can show, with the lowest and the highest of each stretch.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let stretch = points.len().div_ceil(MOST_POINTS / 2).max(1);
    if stretch <= 2 {
        return points.to_vec();
    }
    let mut kept = Vec::new();
    for part in points.chunks(stretch) {
        let finite = || part.iter().filter(|point| point.1.is_finite());
        let low = finite().min_by(|a, b| a.1.total_cmp(&b.1));
        let high = finite().max_by(|a, b| a.1.total_cmp(&b.1));
        match (low, high) {
            (Some(low), Some(high)) => {
                let mut two = [*low, *high];
                two.sort_by(|a, b| a.0.total_cmp(&b.0));
                kept.extend(two);
            }
            _ => kept.extend(part.first()),
        }
    }
    kept
}

fn chart(title: &str, curves: &[Vec<(f64, f64)>], classes: &[&str]) -> String {
    let all = || curves.iter().flatten().filter(|point| point.1.is_finite());
    let low = all().map(|point| point.1).fold(0.0, f64::min);
    let high = all().map(|point| point.1).fold(0.0, f64::max);
    let last = all().map(|point| point.0).fold(0.0, f64::max);
    let room = 0.05 * (high - low).max(1e-9);
    let mut chart = Chart::new(title, (0.0, last.max(1e-9)), (low - room, high + room));
    chart.guide(0.0);
    for (points, class) in curves.iter().zip(classes) {
        chart.line(points, class);
    }
    chart.label_y(0.0, "0");
    let end = if high >= -low { high } else { low };
    if end.abs() > 0.15 * (high - low) {
        chart.label_y(end, &number(end));
    }
    chart.label_x(0.0, "0");
    chart.label_x(last, &format!("{last:.1} s"));
    chart.finish()
}
