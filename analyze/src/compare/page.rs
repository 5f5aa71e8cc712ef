//! `comparison.html`: the comparison as a page. One file without scripts.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, told, word};

use super::comparison::Comparison;
use super::facts::{FactDifference, formatted};
use super::inputs::{InputDifference, NOT_HELD};
use super::series::{in_words, printed_unit, shared_rows};
use super::side::Side;
use super::text::{self, origin, valid_rows, zero_of_times};
use crate::analysis::Analysis;
use crate::events::support_words::support_word;
use crate::page::svg::{CHART_STYLE, Chart};
use crate::page::{self, Document, list, number, part, rows_to_draw, section, table};
use crate::report::drawn_machines;

/// Lines of a list on the sheet; the others are folded.
const MOST_LINES: usize = 12;
/// Points of a curve.
const MOST_POINTS: usize = 600;

/// The comparison as an HTML page: what changes on one sheet, every figure behind it.
#[must_use]
pub fn render(comparison: &Comparison, a: &Side, b: &Side) -> String {
    rendered(comparison, a, b, &html! {})
}

/// The comparison of two analyses as an HTML page, with their machines drawn.
pub(crate) fn render_drawn(
    comparison: &Comparison,
    [a, b]: [&Side; 2],
    analyses: [&Analysis; 2],
) -> String {
    let drawn = html! {
        @for (letter, drawing) in ["A", "B"].into_iter().zip(&drawn_machines(analyses)) {
            (section(&say!("The machine in {letter}"), drawing))
        }
    };
    rendered(comparison, a, b, &drawn)
}

fn rendered(comparison: &Comparison, a: &Side, b: &Side, drawn: &Markup) -> String {
    let sides = [("A", &comparison.a), ("B", &comparison.b)].map(|(letter, side)| {
        let name = side.log.first().filter(|log| **log != side.name);
        let name = name.map_or(side.name.clone(), |log| say!("{} of {log}", side.name));
        (letter, format!("{name}. {}", side.finding))
    });
    let least: Vec<&FactDifference> = comparison
        .facts
        .iter()
        .filter(|fact| fact.is_least_otf())
        .collect();
    let (curves, differences) = curves(comparison, a, b);
    let sheet = html! {
        div.sheet {
            (page::facts(&sides))
            (section(word!("Inputs that differ"), inputs(comparison)))
            (section(word!("Events"), events(comparison)))
            (drawn)
            (section(word!("Overturning force (OTF)"), html! { p.hint { (valid_rows(comparison)) } (facts(&least)) (curves) }))
            @if !comparison.caveats.is_empty() {
                (section(word!("What this cannot show"), list(comparison.caveats.iter())))
            }
        }
    };
    let folded = html! {
        @if let Some(differences) = &differences {
            (part("differences", word!("Differences of the OTF"), false, differences))
        }
        (part("figures", word!("Figures of all valid rows"), false, facts(&comparison.facts.iter().collect::<Vec<_>>())))
        (part("rows", word!("Row by row"), false, series(comparison)))
        (part("provenance", word!("Provenance"), false, page::facts(&[("A", origin(&comparison.a)), ("B", origin(&comparison.b))])))
    };
    Document {
        title: word!("Comparison of two results"),
        subtitle: match comparison.same_log {
            true => word!("Both results are of the same log."),
            false => word!("The results are of different logs."),
        },
        styles: &[CHART_STYLE],
        plots: None,
    }
    .render_sheet(&sheet, &folded)
}

fn inputs(comparison: &Comparison) -> Markup {
    let row = |of: &InputDifference| of.cells().to_vec();
    let rows: Vec<Vec<String>> = comparison.inputs.iter().map(row).collect();
    let shown = |rows: &[Vec<String>]| table(&[word!("Input"), "A", "B"], rows);
    html! {
        @if rows.is_empty() {
            p { (match comparison.same_log { true => word!("None."), false => word!("None but the logs.") }) }
        } @else {
            (folded(&rows, shown))
            @if comparison.inputs.iter().any(InputDifference::is_of_machine_files) { p { (told(NOT_HELD)) } }
        }
    }
}

/// The first lines, and the others folded.
fn folded<T>(all: &[T], shown: impl Fn(&[T]) -> Markup) -> Markup {
    let (first, others) = all.split_at(all.len().min(MOST_LINES));
    html! {
        (shown(first))
        @if !others.is_empty() {
            details { summary { (say!("{} more", others.len())) } (shown(others)) }
        }
    }
}

fn events(comparison: &Comparison) -> Markup {
    let events = text::events(&comparison.events);
    html! {
        @if events.is_empty() {
            p { (word!("Neither result has an event.")) }
        } @else {
            @if let Some(zero) = zero_of_times(comparison) { p.hint { (zero) } }
            (folded(&events, |events| list(events.iter())))
        }
    }
}

fn facts(facts: &[&FactDifference]) -> Markup {
    let row = |fact: &&FactDifference| {
        let values = [fact.a, fact.b, fact.difference].map(|value| formatted(value, fact.unit));
        let why = fact
            .why_not
            .map_or(String::new(), |why| format!(" ({why})"));
        let name = [format!("{}{why}", fact.name.in_words())].into_iter();
        name.chain(values)
            .chain([printed_unit(fact.unit)])
            .collect()
    };
    let rows: Vec<Vec<String>> = facts.iter().map(row).collect();
    table(
        &[word!("Quantity"), "A", "B", "B - A", word!("Unit")],
        &rows,
    )
}

fn series(comparison: &Comparison) -> Markup {
    let Some(series) = &comparison.series else {
        let note = comparison
            .series_note
            .as_deref()
            .unwrap_or(word!("unknown"));
        return html! { p { (say!("Not compared row by row: {note}.")) } };
    };
    let columns = series.columns.iter();
    let columns = columns.filter(|column| !column.is_derivative() && !column.is_variance());
    let (shown, alike): (Vec<_>, Vec<_>) = columns.partition(|column| column.differs());
    let rows = shown.into_iter().map(|column| {
        let relative = column
            .relative
            .map_or(String::new(), |r| decimals(format!("{:.2} %", 100.0 * r)));
        let of = [column.mean, column.rms, column.largest].map(number);
        let name = [column.in_words()].into_iter();
        name.chain(of)
            .chain([relative, printed_unit(&column.unit)])
            .collect()
    });
    let head = [
        word!("Quantity"),
        word!("Mean of B - A"),
        word!("RMS"),
        word!("Largest"),
        word!("RMS, relative"),
        word!("Unit"),
    ];
    html! {
        p.hint { (say!("{} rows are valid in both results.", series.rows)) }
        (table(&head, &rows.collect::<Vec<Vec<String>>>()))
        @if !alike.is_empty() {
            p.hint { (say!("Alike in both to the digits shown: {}.", alike.iter().map(|column| column.in_words()).collect::<Vec<_>>().join("; "))) }
        }
        @for (side, names) in [("A", &series.only_a), ("B", &series.only_b)] {
            @if !names.is_empty() {
                p.hint { (say!("Only {side} has {}.", names.iter().map(|name| in_words(name)).collect::<Vec<_>>().join(", "))) }
            }
        }
    }
}

/// The OTF of each wheel that both have, and its difference, over the rows that they share; otherwise each over its own time.
fn curves(comparison: &Comparison, a: &Side, b: &Side) -> (Markup, Option<Markup>) {
    let names = a.columns.iter().map(|column| column.name.as_str());
    let wheels: Vec<&str> = names
        .filter_map(|name| name.strip_prefix("otf_"))
        .filter(|wheel| !wheel.ends_with("_sigma") && b.column(&format!("otf_{wheel}")).is_some())
        .collect();
    if wheels.is_empty() {
        let none = html! { p { (word!("The machines have no wheel of the same name.")) } };
        return (none, None);
    }
    let (together, is_one_clock) = (comparison.series.is_some(), comparison.b_begins_s.is_some());
    let zero_b = if is_one_clock { a } else { b };
    let (zero_a_ns, zero_b_ns) = (a.first_ns(), zero_b.first_ns());
    let rows = match together {
        true => shared_rows(a, b),
        false => Vec::new(),
    };
    let (mut both, mut differences) = (Vec::new(), Vec::new());
    for wheel in wheels {
        let column = format!("otf_{wheel}");
        let Some((on_a, on_b)) = a.column(&column).zip(b.column(&column)) else {
            continue;
        };
        let curves = [
            curve(a, zero_a_ns, &on_a.values),
            curve(b, zero_b_ns, &on_b.values),
        ];
        let wheel = support_word(wheel);
        let classes = ["line-a", "line-b"];
        both.push(chart(&say!("OTF {wheel} (N)"), &curves, &classes));
        if together {
            let of_row = |&(i, j): &(usize, usize)| {
                (seconds(a, zero_a_ns, i), on_b.values[j] - on_a.values[i])
            };
            let points: Vec<_> = rows.iter().map(of_row).collect();
            let title = say!("B - A, OTF {wheel} (N)");
            differences.push(chart(&title, &[thinned(&points)], &classes));
        }
    }
    let overlaid = html! {
        p.hint {
            @if is_one_clock {
                (word!("OTF of each wheel over time, at the same times in both results. Solid: A; dashed: B."))
            } @else {
                (word!("OTF of each wheel over time, from the first row of each result. Solid: A; dashed: B."))
            }
        }
        div.grid { @for chart in &both { (chart) } }
    };
    let apart = together.then(|| html! { div.grid { @for chart in &differences { (chart) } } });
    (overlaid, apart)
}

fn seconds(side: &Side, zero_ns: i64, row: usize) -> f64 {
    (side.times_ns[row] - zero_ns) as f64 * 1e-9
}

/// Values over time, interrupted where a row is invalid.
fn curve(side: &Side, zero_ns: i64, values: &[f64]) -> Vec<(f64, f64)> {
    let points = values.iter().enumerate().map(|(row, &value)| {
        let value = if side.valid[row] { value } else { f64::NAN };
        (seconds(side, zero_ns, row), value)
    });
    thinned(&points.collect::<Vec<_>>())
}

/// At most as many points as a chart can show.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let values: Vec<f64> = points.iter().map(|point| point.1).collect();
    let rows = rows_to_draw(&values, MOST_POINTS);
    rows.into_iter().map(|row| points[row]).collect()
}

fn chart(title: &str, curves: &[Vec<(f64, f64)>], classes: &[&str]) -> Markup {
    let all = || curves.iter().flatten().filter(|point| point.1.is_finite());
    let low = all().map(|point| point.1).fold(0.0, f64::min);
    let high = all().map(|point| point.1).fold(0.0, f64::max);
    let first = all().map(|point| point.0).fold(0.0, f64::min);
    let last = all().map(|point| point.0).fold(0.0, f64::max);
    let room = 0.05 * (high - low).max(1e-9);
    let mut chart = Chart::new(title, (first, last.max(1e-9)), (low - room, high + room));
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
