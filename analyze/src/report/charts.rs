//! Charts of the wheel loads for paper.

use maud::{Markup, html};
use tipwatch_language::{say, word};

use super::sketch::{Curve, Sketch};
use crate::analysis::Analysis;
use crate::events::support_words::SupportWord;
use crate::page::svg::{Chart, round_up};
use crate::page::{Point, number};

/// A chart for each wheel: its load with its band, its envelope and its limit.
pub(super) fn section(analysis: &Analysis, sketch: &Sketch) -> Markup {
    let wheels = 0..analysis.machine.wheels().len();
    // each wheel on its own scale
    let end = |wheel| round_up(highest(sketch.points(Curve::OnPaper(wheel))).max(1.0));
    html! {
        p {
            (word!("Loads over time, in seconds from the first row. Line: load under the stated split; dark area: two standard deviations on \
            either side (± 2 σ); pale area: the envelope, the range over all splits that equilibrium allows; dashed: load limit. Curves \
            break where loads cannot be computed."))
        }
        div.grid { @for wheel in wheels { (chart(analysis, wheel, sketch, end(wheel))) } }
    }
}

/// The largest load in the chart of a wheel (N).
fn highest(points: &[Point]) -> f64 {
    let all = points
        .iter()
        .flat_map(|point| [point.values()[0], point.values()[3]]);
    all.filter(|value| value.is_finite()).fold(0.0, f64::max)
}

fn chart(analysis: &Analysis, wheel: usize, sketch: &Sketch, end: f64) -> Markup {
    let points = sketch.points(Curve::OnPaper(wheel));
    let seconds = |row: usize| analysis.rows.seconds(row);
    let last = analysis.rows.len().checked_sub(1);
    let last = last.map_or(0.0, seconds).max(1e-3);
    let facts = &analysis.machine.wheels()[wheel];
    let (word, name) = (SupportWord::of_kind(facts.kind).head, &facts.name);
    let mut chart = Chart::new(&say!("{word} {name}: load [N]"), (0.0, last), (0.0, end));
    let envelope = points.iter().map(|point| {
        let [_, _, least, largest] = point.values();
        (seconds(point.row()), least, largest)
    });
    chart.area(&envelope.collect::<Vec<_>>(), "envelope");
    let band = points.iter().map(|point| {
        let [load, sigma, ..] = point.values();
        let two_sigma = 2.0 * sigma;
        (
            seconds(point.row()),
            (load - two_sigma).max(0.0).min(load),
            load + two_sigma,
        )
    });
    chart.area(&band.collect::<Vec<_>>(), "band");
    let load = points
        .iter()
        .map(|point| (seconds(point.row()), point.values()[0]));
    chart.curve(name, &load.collect::<Vec<_>>(), "line-a");
    if let Some(limits) = &analysis.min_loads_n {
        chart.line(&[(0.0, limits[wheel]), (last, limits[wheel])], "limit");
    }
    for share in [0.0, 0.5, 1.0] {
        chart.label_y(share * end, &number(share * end));
        chart.label_x(share * last, &format!("{:.1}", share * last));
    }
    chart.caption_x(word!("Time [s]"));
    chart.finish()
}
