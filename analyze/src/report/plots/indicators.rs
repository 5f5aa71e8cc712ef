//! Indicators over time: centre of pressure, overturning moments and angles by edge.

use plotly::Traces;
use plotly::common::Visible;
use tipwatch_mechanics::Quantity;

use super::{FEWER_POINTS, Figure, Plotter, plain};

/// The name of an indicator, and its quantity by edge.
type Kind = (&'static str, fn(usize) -> Quantity);

impl Plotter<'_> {
    pub(super) fn stability(&self) -> Figure {
        let mut traces = Traces::new();
        traces.push(self.curve(0, "ZMP margin", &self.valid(Quantity::ZmpMargin)));
        let title = "Stability: distance of the centre of pressure (ZMP) from the nearest edge, inside positive";
        self.figure(title, "Margin [m]", 300, traces, false)
    }

    /// Overturning moments and angles about each edge.
    pub(super) fn edges(&self) -> Vec<Figure> {
        let moments: [Kind; 4] = [
            ("ITOM with wheels", Quantity::ItomFull),
            ("ITOM", Quantity::Itom),
            ("TOM", Quantity::Tom),
            ("MHS-type", Quantity::Mhs),
        ];
        let angles: [Kind; 2] = [
            ("Force-Angle", Quantity::ForceAngle),
            ("stability angle", Quantity::StabilityAngle),
        ];
        vec![
            self.by_edge(
                "Overturning moments about the edges of the support polygon, negative = stable",
                "Moment [N m]",
                &moments,
            ),
            self.by_edge(
                "Angles about the edges, positive = stable",
                "Angle [rad]",
                &angles,
            ),
        ]
    }

    /// The first kind is shown, the others on request.
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
