//! Stability indicators over time, one figure each: zero moment point, overturning moments and angles about each edge.

use tipwatch_language::{say, word};
use tipwatch_mechanics::Quantity;

use super::plotter::{Part, Plotter, axis};
use crate::events::support_words::edge_word;
use crate::page::{Figure, readable};
use crate::report::sketch::Curve;

/// Height of the figure of an indicator (pixels).
const HEIGHT: usize = 170;

/// An indicator: its quantity for each edge.
type OfEdge = fn(usize) -> Quantity;

impl Plotter<'_> {
    /// Each indicator with its limit.
    pub(super) fn indicators(&self) -> Vec<Figure> {
        let edges: [(OfEdge, &str, &str); 6] = [
            (Quantity::ItomFull, word!("Moment"), word!("tips above")),
            (Quantity::Itom, word!("Moment"), word!("tips above")),
            (Quantity::Tom, word!("Moment"), word!("tips above")),
            (Quantity::Mhs, word!("Moment"), word!("tips above")),
            (Quantity::ForceAngle, word!("Angle"), word!("tips below")),
            (
                Quantity::StabilityAngle,
                word!("Angle"),
                word!("tips below"),
            ),
        ];
        let edges = edges.map(|(kind, what, limit)| self.by_edge(kind, what, limit));
        let found = [self.margin()].into_iter().chain(edges);
        found.filter(Figure::has_traces).collect()
    }

    fn margin(&self) -> Figure {
        let margin = Quantity::ZmpMargin;
        let title = word!("Distance of the zero moment point (ZMP) from the nearest edge");
        let mut figure = self.figure(
            Part::Indicators,
            title,
            &axis(word!("Margin"), margin),
            HEIGHT,
        );
        if self.is_known(Curve::Result(margin)) {
            let curve = self.curve(0, &readable(margin.kind().label), Curve::Result(margin));
            figure.add(curve.unnamed());
            figure.limit(0.0, word!("tips below"));
        }
        figure
    }

    /// An indicator about every edge of the support polygon.
    fn by_edge(&self, kind: OfEdge, what: &str, limit: &str) -> Figure {
        let title = say!("{} about each edge", readable(kind(0).kind().label));
        let mut figure = self.figure(Part::Indicators, &title, &axis(what, kind(0)), HEIGHT);
        for (index, edge) in self.analysis.machine.polygon().edges().iter().enumerate() {
            let curve = Curve::Result(kind(index));
            if self.is_known(curve) {
                figure.add(self.curve(index, &edge_word(&edge.name), curve));
            }
        }
        if figure.has_traces() {
            figure.limit(0.0, limit);
        }
        figure
    }
}
