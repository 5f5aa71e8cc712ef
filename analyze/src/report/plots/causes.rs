//! The contributions to the load of the wheels that matter over time.

use tipwatch_language::{say, word};
use tipwatch_mechanics::Quantity;

use super::plotter::{Part, Plotter, axis};
use crate::events::support_words::SupportWord;
use crate::page::{Figure, Look, Point, readable};
use crate::report::findings::incidents;
use crate::report::sketch::Curve;

/// Most wheels whose contributions are drawn.
const MOST_WHEELS: usize = 3;
/// Height of the figure of a wheel (pixels).
const HEIGHT: usize = 260;
/// Black, or white on a dark page.
const INK: usize = 4;

impl Plotter<'_> {
    /// For the wheels of the gravest incidents the stacked contributions, negative ones below zero; their sum is the OTF.
    pub(super) fn causes(&self) -> Vec<Figure> {
        let names = self.wheel_names();
        let wheels = self.wheels_that_matter(&names).into_iter();
        wheels
            .filter(|&wheel| !self.sketch.layers(wheel).is_empty())
            .map(|wheel| self.causes_of(wheel))
            .collect()
    }

    /// The wheels with events, in the order of their gravity; without one, the wheel that came closest to lifting.
    fn wheels_that_matter(&self, names: &[String]) -> Vec<usize> {
        let mut found = Vec::new();
        for incident in incidents(&self.analysis.events) {
            for event in &incident.events {
                let wheel = names
                    .iter()
                    .position(|name| name.to_lowercase() == event.subject);
                if let Some(wheel) = wheel.filter(|wheel| !found.contains(wheel)) {
                    found.push(wheel);
                }
            }
        }
        if found.is_empty() {
            found.extend(self.analysis.digest.lightest.map(|(_, wheel)| wheel));
        }
        found.truncate(MOST_WHEELS);
        found
    }

    fn causes_of(&self, wheel: usize) -> Figure {
        let otf = Quantity::Otf(wheel);
        let named = SupportWord::headed(&self.analysis.machine.wheels()[wheel]);
        let title = say!("{named}: contributions to its overturning force (OTF)");
        let unit = axis(word!("Contribution"), otf);
        let mut figure = self.figure(Part::Causes, &title, &unit, HEIGHT);
        for layer in self
            .sketch
            .layers(wheel)
            .iter()
            .filter(|layer| layer.matters)
        {
            let label = readable(layer.cause.name());
            let between = |points: &[Point]| {
                let between = points
                    .iter()
                    .map(|point| (point.row(), point.values()[0], point.values()[1]));
                let area = self.between(Look::Area, layer.cause as usize, &label, between);
                area.hatched()
            };
            figure.add(between(&layer.above));
            figure.add(between(&layer.below).unnamed());
        }
        figure.add(
            self.curve(INK, &readable(otf.kind().label), Curve::Result(otf))
                .solid(),
        );
        figure.limit(0.0, word!("lifts below"));
        figure
    }
}
