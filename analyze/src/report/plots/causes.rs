//! The contributions to the load of each wheel over time.

use plotly::Traces;
use tipwatch_mechanics::Quantity;

use super::plotter::{Plotter, axis};
use crate::page::{Figure, colour, readable};
use crate::report::sketch::{Curve, Point};

impl Plotter<'_> {
    /// For each wheel the stacked contributions, negative ones below zero; their sum is the OTF.
    pub(super) fn causes(&self) -> Vec<Figure> {
        let names = self.wheel_names();
        (0..names.len())
            .filter(|&wheel| !self.sketch.layers(wheel).is_empty())
            .map(|wheel| self.causes_of(wheel, &names[wheel]))
            .collect()
    }

    fn causes_of(&self, wheel: usize, name: &str) -> Figure {
        let mut traces = Traces::new();
        for layer in self.sketch.layers(wheel) {
            if !layer.matters {
                continue;
            }
            let label = readable(layer.cause.name());
            let fill = colour(layer.cause as usize, 0.55);
            let between = |points: &[Point]| {
                let between = points
                    .iter()
                    .map(|point| (point.row(), point.values()[0], point.values()[1]));
                self.between(&label, between, fill).legend_group(&label)
            };
            traces.push(between(&layer.above));
            traces.push(between(&layer.below).show_legend(false));
        }
        let otf = Quantity::Otf(wheel);
        // the fifth colour is black
        traces.push(self.curve(4, otf.kind().label, Curve::Result(otf)));
        let title = format!("Wheel {name}: contributions to its overturning force (OTF)");
        self.figure(&title, &axis("Contribution", otf), 340, traces)
    }
}
