//! The Monte Carlo study: how far the loads and the wrench of the arm spread, as in Figs. 13 and 14 of the
//! first paper.

use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::Axis;
use tipwatch_mechanics::studies::monte_carlo::Band;
use tipwatch_mechanics::{ColumnNames, Quantity};

use super::plotter::{Part, Plotter, axis};
use crate::page::{Figure, Look, rows_to_draw};
use crate::report::sketch::{Curve, Detail};

/// Title of a plot, the title of its axis, and one of the quantities that belong to it.
type Kind = (&'static str, &'static str, Quantity);

impl Plotter<'_> {
    /// Bands that hold 95 % of the random machines, if the study was requested.
    pub(super) fn drawn_machines(&self) -> Vec<Figure> {
        let Some(found) = &self.analysis.monte_carlo else {
            return Vec::new();
        };
        let study = found;
        let study_text = say!(
            "95 % of {} random machines with lengths, angles, masses and inertias off by up to {:.0} %",
            study.draws,
            100.0 * study.spread
        );
        let kinds: [Kind; 3] = [
            (word!("Wheel loads"), word!("Load"), Quantity::Load(0)),
            (
                word!("Force of the arm on its base"),
                word!("Force"),
                Quantity::ArmForce(Axis::X),
            ),
            (
                word!("Moment of the arm on its base"),
                word!("Moment"),
                Quantity::ArmMoment(Axis::X),
            ),
        ];
        kinds
            .into_iter()
            .map(|(what, axis_title, one)| {
                let is_alike = |band: &&Band| band.quantity.kind() == one.kind();
                let bands = found.bands.iter().filter(is_alike);
                self.spread(
                    &format!("{what}: {study_text}"),
                    &axis(axis_title, one),
                    bands,
                )
            })
            .collect()
    }

    fn spread<'b>(&self, title: &str, unit: &str, bands: impl Iterator<Item = &'b Band>) -> Figure {
        let mut figure = self.figure(Part::Study, title, unit, 260);
        let names = ColumnNames::of(&self.analysis.machine);
        for (index, band) in bands.enumerate() {
            let name = band.quantity.column(&names);
            let shape = self.between(Look::Area, index, &name, thinned(band));
            figure.add(shape.unnamed());
            if self.has(band.quantity) {
                figure.add(self.curve(index, &name, Curve::Result(band.quantity)));
            }
        }
        figure
    }
}

/// The rows of a band to draw, with its ends.
fn thinned(band: &Band) -> impl Iterator<Item = (usize, f64, f64)> {
    let most = Detail::WHOLE.fewer_points;
    let mut rows = rows_to_draw(&band.low, most);
    rows.extend(rows_to_draw(&band.high, most));
    rows.sort_unstable();
    rows.dedup();
    (rows.into_iter()).map(|row| (row, band.low[row], band.high[row]))
}
