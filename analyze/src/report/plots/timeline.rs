//! The events over time: a lane for each kind of event of each wheel or edge.

use tipwatch_language::word;

use super::plotter::{Part, Plotter};
use super::quality::Lane;
use crate::events::{Event, EventKind};
use crate::page::Figure;
use crate::report::findings::Scene;

/// Most lanes: those of inputs are in another figure.
const MOST_LANES: usize = 24;

impl Plotter<'_> {
    /// `None` without an event of the machine.
    pub(super) fn timeline(&self) -> Option<Figure> {
        let scene = Scene::of(self.analysis);
        let key = |event: &Event| {
            let other_edge = event.other_edge().map(str::to_owned);
            (event.kind, event.subject.clone(), other_edge)
        };
        let mut lanes = Vec::new();
        let events = self.analysis.events.iter();
        for event in events.filter(|event| event.kind.is_stability()) {
            let span = self.span(event);
            let known = lanes.iter_mut().find(|(known, _)| *known == key(event));
            match known.map(|(_, lane): &mut (_, Lane)| lane) {
                Some(lane) => lane.spans.push(span),
                None => lanes.push((
                    key(event),
                    Lane {
                        name: scene.kind_and_subject(event),
                        colour: colour_of(event.kind),
                        spans: vec![span],
                    },
                )),
            }
        }
        // stable: of a kind, by time
        lanes.sort_by_key(|((kind, ..), _)| kind.rank());
        lanes.truncate(MOST_LANES);
        let lanes: Vec<Lane> = lanes.into_iter().map(|(_, lane)| lane).collect();
        (!lanes.is_empty())
            .then(|| self.lanes(Part::Events, word!("Events of the machine"), &lanes))
    }
}

/// Index of the colour of a kind.
fn colour_of(kind: EventKind) -> usize {
    match kind {
        EventKind::TipOver | EventKind::EdgeTipping => 1,
        EventKind::WheelLift => 3,
        EventKind::WheelLight => 6,
        EventKind::InputGap | EventKind::InputFault | EventKind::LiftNotExcluded => 4,
    }
}
