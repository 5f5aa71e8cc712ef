//! The Monte Carlo study: how far the loads and the wrench of the arm spread, as in Figs. 13 and 14 of the
//! first paper.

use plotly::Traces;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::studies::monte_carlo::Band;

use super::plotter::Plotter;
use crate::page::{Figure, colour, plain};
use crate::tables::table::name_and_unit;

/// What is plotted, its unit, and which quantities belong to it.
type Kind = (&'static str, &'static str, fn(Quantity) -> bool);

impl Plotter<'_> {
    /// Bands that hold 95 % of the random machines, if the study was requested.
    pub(super) fn drawn_machines(&self) -> Vec<Figure> {
        let Some(found) = &self.analysis.monte_carlo else {
            return Vec::new();
        };
        let study = &found.study;
        let study_text = format!(
            "95 % of {} random machines with lengths, angles, masses and inertias off by up to {:.0} %",
            study.draws,
            100.0 * study.spread
        );
        let kinds: [Kind; 3] = [
            ("Wheel loads", "Load [N]", |q| {
                matches!(q, Quantity::Load(_))
            }),
            ("Force of the arm on its base", "Force [N]", |q| {
                matches!(q, Quantity::ArmForce(_))
            }),
            ("Moment of the arm on its base", "Moment [N m]", |q| {
                matches!(q, Quantity::ArmMoment(_))
            }),
        ];
        kinds
            .into_iter()
            .map(|(what, unit, is_one)| {
                let bands = found.bands.iter().filter(|band| is_one(band.quantity));
                self.spread(&format!("{what}: {study_text}"), unit, bands)
            })
            .collect()
    }

    fn spread<'b>(&self, title: &str, unit: &str, bands: impl Iterator<Item = &'b Band>) -> Figure {
        let mut traces = Traces::new();
        for (index, band) in bands.enumerate() {
            let name = name_and_unit(&self.analysis.machine, band.quantity)
                .map_or(String::new(), |(name, _)| plain(&name));
            let shape = self.between(&name, &band.low, &band.high, colour(index, 0.25));
            traces.push(shape.show_legend(false));
            if self.has(band.quantity) {
                traces.push(self.curve(index, &name, &self.valid(band.quantity)));
            }
        }
        self.figure(title, unit, 340, traces, false)
    }
}
