//! The machine on the supports that are on the ground at a time.

use tipwatch_mechanics::machine::Machine;

use super::supports::SupportTimeline;

/// A machine on each set of supports of a log.
#[derive(Debug)]
pub(crate) struct Standing<'a> {
    machine: &'a Machine,
    timeline: Option<&'a SupportTimeline>,
    /// Machine on each set of the timeline; `None` for a set on which the machine cannot stand.
    on_sets: Vec<Option<Machine>>,
}

impl<'a> Standing<'a> {
    /// `machine` on the sets of a timeline, or always on the same supports.
    pub(crate) fn of(machine: &'a Machine, timeline: Option<&'a SupportTimeline>) -> Self {
        let sets = timeline.into_iter().flat_map(|timeline| &timeline.sets);
        Self {
            machine,
            timeline,
            on_sets: sets.map(|on| machine.standing_on(on).ok()).collect(),
        }
    }

    /// The machine as it stands at a time (ns); `None` where its supports are unknown.
    pub(crate) fn at(&self, time_ns: i64) -> Option<&Machine> {
        match self.timeline {
            None => Some(self.machine),
            Some(timeline) => self.on_sets[timeline.set_at(time_ns)?].as_ref(),
        }
    }

    /// The index of the set of supports at a time (ns); `None` where it is unknown, and on supports that never change.
    pub(crate) fn set_at(&self, time_ns: i64) -> Option<usize> {
        self.timeline?.set_at(time_ns)
    }

    /// The machine on whichever supports: states are the same for all of them.
    pub(crate) fn machine(&self) -> &Machine {
        self.machine
    }
}
