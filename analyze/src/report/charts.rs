//! Charts of the wheel loads for paper.

use maud::{Markup, html};
use tipwatch_mechanics::Quantity;

use crate::analysis::Analysis;
use crate::page::svg::{Chart, round_up};
use crate::page::{number, rows_to_draw};

/// Points of a curve: paper shows no more.
const POINTS: usize = 600;

/// A chart for each wheel: its load with its band, its envelope and its limit.
pub(super) fn section(analysis: &Analysis) -> Markup {
    let seconds: Vec<f64> = (0..analysis.rows.len())
        .map(|row| analysis.rows.seconds(row))
        .collect();
    let wheels = 0..analysis.machine.wheels().len();
    let highest = wheels
        .clone()
        .map(|wheel| Curves::of(analysis, wheel).highest());
    let end = round_up(highest.fold(1.0, f64::max));
    html! {
        p {
            "Loads over time, in seconds from the first row. Line: load under the stated split; dark area: two standard deviations on \
            either side (± 2 σ); pale area: the envelope, the range over all splits that equilibrium allows; dashed: load limit. Curves \
            break where loads cannot be computed."
        }
        div.grid { @for wheel in wheels { (chart(analysis, wheel, &seconds, end)) } }
    }
}

/// What a chart shows, row by row; NaN where unknown.
struct Curves {
    load: Vec<f64>,
    sigma: Vec<f64>,
    least: Vec<f64>,
    largest: Vec<f64>,
}

impl Curves {
    fn of(analysis: &Analysis, wheel: usize) -> Self {
        let rows = &analysis.rows;
        let column = |quantity: Quantity| -> Vec<f64> {
            if !rows.outcomes.quantities.contains(&quantity) {
                return vec![f64::NAN; rows.len()];
            }
            let values = rows.outcomes.column(quantity).iter().zip(&rows.reasons);
            let usable = values.map(|(&value, reasons)| {
                if reasons.leave_loads() {
                    value
                } else {
                    f64::NAN
                }
            });
            usable.collect()
        };
        Self {
            load: column(Quantity::Load(wheel)),
            sigma: column(Quantity::LoadSigma(wheel)),
            least: column(Quantity::LoadLeast(wheel)),
            largest: column(Quantity::LoadLargest(wheel)),
        }
    }

    fn highest(&self) -> f64 {
        let all = self.load.iter().chain(&self.largest);
        all.copied()
            .filter(|value| value.is_finite())
            .fold(0.0, f64::max)
    }
}

fn chart(analysis: &Analysis, wheel: usize, seconds: &[f64], end: f64) -> Markup {
    let curves = Curves::of(analysis, wheel);
    let last = seconds.last().copied().unwrap_or(0.0).max(1e-3);
    let name = &analysis.machine.wheels()[wheel].name;
    let mut chart = Chart::new(&format!("Wheel {name}: load [N]"), (0.0, last), (0.0, end));
    let mut rows = rows_to_draw(&curves.load, POINTS);
    rows.extend(rows_to_draw(&curves.least, POINTS / 2));
    rows.extend(rows_to_draw(&curves.largest, POINTS / 2));
    rows.sort_unstable();
    rows.dedup();
    let envelope = rows
        .iter()
        .map(|&row| (seconds[row], curves.least[row], curves.largest[row]));
    chart.area(&envelope.collect::<Vec<_>>(), "envelope");
    let band = rows.iter().map(|&row| {
        let (load, two_sigma) = (curves.load[row], 2.0 * curves.sigma[row]);
        (
            seconds[row],
            (load - two_sigma).max(0.0).min(load),
            load + two_sigma,
        )
    });
    chart.area(&band.collect::<Vec<_>>(), "band");
    let load = rows.iter().map(|&row| (seconds[row], curves.load[row]));
    chart.line(&load.collect::<Vec<_>>(), "line-a");
    if let Some(limits) = &analysis.min_loads_n {
        chart.line(&[(0.0, limits[wheel]), (last, limits[wheel])], "limit");
    }
    for share in [0.0, 0.5, 1.0] {
        chart.label_y(share * end, &number(share * end));
        chart.label_x(share * last, &format!("{:.1}", share * last));
    }
    chart.caption_x("Time [s]");
    chart.finish()
}
