//! Stability indicators over time: zero moment point, overturning moments and angles about each edge.

use plotly::Traces;
use plotly::common::Visible;
use tipwatch_mechanics::Quantity;

use super::plotter::{FEWER_POINTS, Plotter};
use crate::page::{Figure, plain};

/// The name of an indicator, and its quantity for each edge.
type Kind = (&'static str, fn(usize) -> Quantity);

impl Plotter<'_> {
    pub(super) fn stability(&self) -> Figure {
        let mut traces = Traces::new();
        traces.push(self.curve(0, "ZMP margin", &self.valid(Quantity::ZmpMargin)));
        let title =
            "Distance of the zero moment point (ZMP) from the nearest edge, positive inside";
        self.figure(title, "Margin [m]", 300, traces, false)
    }

    /// Overturning moments and angles about each edge.
    pub(super) fn edges(&self) -> Vec<Figure> {
        let moments: [Kind; 4] = [
            ("ITOM with wheels", Quantity::ItomFull),
            ("ITOM", Quantity::Itom),
            ("TOM", Quantity::Tom),
            ("MHS", Quantity::Mhs),
        ];
        let angles: [Kind; 2] = [
            ("Force-Angle", Quantity::ForceAngle),
            ("stability angle", Quantity::StabilityAngle),
        ];
        vec![
            self.by_edge(
                "Overturning moments about the edges of the support polygon (ITOM, TOM, MHS), negative is stable",
                "Moment [N m]",
                &moments,
            ),
            self.by_edge(
                "Stability angles about the edges, positive is stable",
                "Angle [rad]",
                &angles,
            ),
        ]
    }

    /// The first kind is shown; the others are hidden at first.
    fn by_edge(&self, title: &str, unit: &str, kinds: &[Kind]) -> Figure {
        let mut traces = Traces::new();
        for (place, (name, kind)) in kinds.iter().enumerate() {
            for (index, edge) in self.analysis.machine.polygon().edges().iter().enumerate() {
                let values = self.valid(kind(index));
                if !values.iter().any(|value| value.is_finite()) {
                    continue;
                }
                let name = format!("{name} {}", plain(&edge.name));
                traces.push(if place == 0 {
                    self.curve(index, &name, &values)
                } else {
                    let curve = self.curve_of(index, &name, &values, FEWER_POINTS);
                    curve.visible(Visible::LegendOnly)
                });
            }
        }
        self.figure(title, unit, 320, traces, false)
    }
}
