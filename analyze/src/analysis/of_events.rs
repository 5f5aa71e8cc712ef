//! The events of the machine, found on each set of its supports.

use super::standing_rows::StandingRows;
use super::study::{Block, StudiedLog, Study};
use crate::events::{Event, EventPass, LowestOtf};

/// Finds the events of the machine.
pub(super) struct EventStudy<'a>(Vec<(&'a StandingRows<'a>, EventPass<'a>)>);

/// The events found.
#[derive(Default)]
pub(super) struct FoundEvents {
    /// The events, in no order.
    pub(super) all: Vec<Event>,
    /// The smallest OTF in them.
    pub(super) lowest: Option<LowestOtf>,
}

impl EventStudy<'_> {
    /// The row before which all events are known, of `rows` rows so far.
    pub(super) fn settled(&self, rows: usize) -> usize {
        let settled = self.0.iter().map(|(_, pass)| pass.settled());
        settled.min().unwrap_or(rows)
    }

    /// The events that are known so far.
    pub(super) fn known(&self) -> Vec<Event> {
        let known = self.0.iter().flat_map(|(_, pass)| pass.events());
        known.cloned().collect()
    }
}

impl<'a> Study<'a> for EventStudy<'a> {
    type Found = FoundEvents;

    fn begin(log: &StudiedLog<'a>) -> Self {
        let pass = |standing: &'a StandingRows<'a>| {
            EventPass::new(
                standing.machine,
                standing.rows(),
                standing.min_loads_n.as_deref(),
                log.scope,
                log.rotations,
                log.measured_loads,
            )
        };
        let all = log.standing.iter();
        Self(all.map(|standing| (standing, pass(standing))).collect())
    }

    fn take(&mut self, block: &Block<'a>) {
        for part in &block.parts {
            for (index, (standing, pass)) in self.0.iter_mut().enumerate() {
                match &part.standing {
                    Some((place, _, rows)) if *place == index => pass.take(rows),
                    _ => pass.skip(&standing.rows().reasons[part.span.clone()]),
                }
            }
        }
    }
}

impl From<EventStudy<'_>> for FoundEvents {
    fn from(study: EventStudy<'_>) -> Self {
        let mut found = Self::default();
        for (_, pass) in study.0 {
            let (events, lowest) = pass.finish();
            found.all.extend(events);
            found.lowest = LowestOtf::lower(found.lowest, lowest);
        }
        found
    }
}
