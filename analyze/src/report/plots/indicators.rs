//! Stability indicators over time: zero moment point, overturning moments and angles about each edge.

use plotly::Traces;
use plotly::common::Visible;
use tipwatch_mechanics::Quantity;

use super::plotter::{Plotter, axis};
use crate::page::{Figure, plain};
use crate::report::sketch::Curve;

/// An indicator: its quantity for each edge.
type OfEdge = fn(usize) -> Quantity;

impl Plotter<'_> {
    pub(super) fn stability(&self) -> Figure {
        let mut traces = Traces::new();
        let margin = Quantity::ZmpMargin;
        traces.push(self.curve(0, margin.kind().label, Curve::Result(margin)));
        let title =
            "Distance of the zero moment point (ZMP) from the nearest edge, positive inside";
        self.figure(title, &axis("Margin", margin), 300, traces)
    }

    /// Overturning moments and angles about each edge.
    pub(super) fn edges(&self) -> Vec<Figure> {
        let moments: [OfEdge; 4] = [
            Quantity::ItomFull,
            Quantity::Itom,
            Quantity::Tom,
            Quantity::Mhs,
        ];
        let angles: [OfEdge; 2] = [Quantity::ForceAngle, Quantity::StabilityAngle];
        vec![
            self.by_edge(
                "Overturning moments about the edges of the support polygon (ITOM, TOM, MHS), negative is stable",
                "Moment",
                &moments,
            ),
            self.by_edge(
                "Stability angles about the edges, positive is stable",
                "Angle",
                &angles,
            ),
        ]
    }

    /// The first kind is shown; the others are hidden at first.
    fn by_edge(&self, title: &str, what: &str, kinds: &[OfEdge]) -> Figure {
        let mut traces = Traces::new();
        for (place, kind) in kinds.iter().enumerate() {
            for (index, edge) in self.analysis.machine.polygon().edges().iter().enumerate() {
                let curve = Curve::Result(kind(index));
                if !self.is_known(curve) {
                    continue;
                }
                let name = format!("{} {}", kind(index).kind().label, plain(&edge.name));
                let curve = self.curve(index, &name, curve);
                traces.push(match place {
                    0 => curve,
                    _ => curve.visible(Visible::LegendOnly),
                });
            }
        }
        self.figure(title, &axis(what, kinds[0](0)), 320, traces)
    }
}
