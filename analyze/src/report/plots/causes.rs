//! The contributions to the load of each wheel over time.

use plotly::Traces;
use tipwatch_mechanics::{Contribution, Quantity};

use super::plotter::{Plotter, axis};
use crate::page::{Figure, colour, readable};

impl Plotter<'_> {
    /// For each wheel the stacked contributions, negative ones below zero; their sum is the OTF.
    pub(super) fn causes(&self) -> Vec<Figure> {
        let names = self.wheel_names();
        let known =
            |wheel: &usize| self.has(Quantity::Contribution(Contribution::ArmWeight, *wheel));
        (0..names.len())
            .filter(known)
            .map(|wheel| self.causes_of(wheel, &names[wheel]))
            .collect()
    }

    fn causes_of(&self, wheel: usize, name: &str) -> Figure {
        let rows = self.seconds.len();
        let (mut above, mut below) = (vec![0.0; rows], vec![0.0; rows]);
        let mut traces = Traces::new();
        for (index, cause) in Contribution::ALL.into_iter().enumerate() {
            let values = self.valid(Quantity::Contribution(cause, wheel));
            let matters = |value: &f64| value.abs() > 1.0;
            if cause == Contribution::LiftOff || !values.iter().any(matters) {
                continue;
            }
            let stacked = |base: &mut [f64], part: fn(f64) -> f64| {
                let from = base.to_vec();
                for (base, &value) in base.iter_mut().zip(&values) {
                    *base += part(value);
                }
                (from, base.to_vec())
            };
            let label = readable(cause.name());
            let fill = colour(index, 0.55);
            let (from, to) = stacked(&mut above, positive);
            traces.push(self.between(&label, &from, &to, fill).legend_group(&label));
            let (from, to) = stacked(&mut below, negative);
            let lower = self.between(&label, &to, &from, fill);
            traces.push(lower.legend_group(&label).show_legend(false));
        }
        let otf = Quantity::Otf(wheel);
        // the fifth colour is black
        traces.push(self.curve(4, otf.kind().label, &self.valid(otf)));
        let title = format!("Wheel {name}: contributions to its overturning force (OTF)");
        self.figure(&title, &axis("Contribution", otf), 340, traces)
    }
}

/// The value where it is positive, else zero; NaN stays.
fn positive(value: f64) -> f64 {
    if value < 0.0 { 0.0 } else { value }
}

/// The value where it is negative, else zero; NaN stays.
fn negative(value: f64) -> f64 {
    if value > 0.0 { 0.0 } else { value }
}
