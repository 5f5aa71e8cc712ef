//! Events of a machine on different supports: the times on each set are looked into by themselves, with the machine on
//! that set. A support that is set down or raised is in no such time, so that its load passes through zero unnoticed.

use std::sync::Arc;

use tipwatch_mechanics::Scope;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reasons;

use super::event::Event;
use super::pass::{EventPass, Found, LowestOtf};
use super::rotation::FoundRotation;
use crate::base::rows::Rows;
use crate::base::support_sets::SupportSet;
use crate::base::table::Table;
use crate::load::MeasuredLoads;

/// The times on one set of supports, and the table of their rows.
pub(crate) struct OnSet<'a> {
    /// Index of the set.
    pub(crate) index: usize,
    pub(crate) set: &'a SupportSet,
    pub(crate) table: Table,
    pub(crate) min_loads_n: Option<Vec<f64>>,
}

impl<'a> OnSet<'a> {
    /// Those of all sets of a table; empty for a machine that is always on the same supports.
    pub(crate) fn all(
        table: &'a Table,
        min_loads_n: impl Fn(&Machine) -> Option<Vec<f64>>,
    ) -> Vec<Self> {
        let sets = table.supports().map_or(&[][..], |supports| &supports.sets);
        let sets = sets.iter().enumerate();
        let times = sets.map(|(index, set)| Self {
            index,
            set,
            table: table.on_set(index, &set.machine),
            min_loads_n: min_loads_n(&set.machine),
        });
        times.collect()
    }
}

/// Finds the events of a log, on whichever supports the machine stands.
pub(crate) enum AnyPass<'a> {
    /// Always on the same ones.
    Whole(Box<EventPass<'a>>),
    /// On different ones.
    Sets(SetsPass<'a>),
}

/// Finds the events on each set.
pub(crate) struct SetsPass<'a> {
    table: &'a Table,
    scope: Scope,
    passes: Vec<(&'a OnSet<'a>, EventPass<'a>)>,
    /// Reasons of the rows so far.
    reasons: Vec<Reasons>,
    /// The events so far.
    events: Vec<Event>,
}

impl<'a> AnyPass<'a> {
    pub(crate) fn new(
        machine: &'a Machine,
        table: &'a Table,
        min_loads_n: Option<&'a [f64]>,
        sets: &'a [OnSet<'a>],
        scope: Scope,
        rotations: &'a [FoundRotation],
        measured: &'a MeasuredLoads,
    ) -> Self {
        if table.supports().is_none() {
            return Self::Whole(Box::new(EventPass::new(
                machine,
                table,
                min_loads_n,
                scope,
                rotations,
                measured,
            )));
        }
        let pass = |on: &'a OnSet<'a>| {
            let min_loads_n = on.min_loads_n.as_deref();
            let pass = EventPass::new(
                &on.set.machine,
                &on.table,
                min_loads_n,
                scope,
                rotations,
                measured,
            );
            (on, pass)
        };
        Self::Sets(SetsPass {
            table,
            scope,
            passes: sets.iter().map(pass).collect(),
            reasons: Vec::with_capacity(table.len()),
            events: Vec::new(),
        })
    }

    /// Takes the next block.
    pub(crate) fn take(&mut self, rows: &Arc<Rows>) {
        match self {
            Self::Whole(pass) => pass.take(rows),
            Self::Sets(pass) => pass.take(rows),
        }
    }

    /// The row before which all events of the machine are known.
    pub(crate) fn settled(&self) -> usize {
        match self {
            Self::Whole(pass) => pass.settled(),
            Self::Sets(sets) => {
                let passes = sets.passes.iter().map(|(_, pass)| pass.settled());
                passes.min().unwrap_or(sets.reasons.len())
            }
        }
    }

    /// The events of the machine that are known.
    pub(crate) fn events(&self) -> &[Event] {
        match self {
            Self::Whole(pass) => pass.events(),
            Self::Sets(pass) => &pass.events,
        }
    }

    /// After the last block.
    pub(crate) fn finish(self) -> Found {
        match self {
            Self::Whole(pass) => pass.finish(),
            Self::Sets(pass) => pass.finish(),
        }
    }
}

impl SetsPass<'_> {
    fn take(&mut self, rows: &Rows) {
        let all = rows.first..rows.first + rows.len();
        let supports = self.table.supports().into_iter();
        for (part, set) in supports.flat_map(|supports| supports.spans_within(all.clone())) {
            for (on, pass) in &mut self.passes {
                if set == Some(on.index) {
                    let of_set = rows.on_set(on.set, self.scope, part.clone());
                    pass.take(&Arc::new(of_set));
                } else {
                    let first = rows.first + part.start;
                    pass.skip(&on.table.reasons[first..first + part.len()]);
                }
            }
        }
        self.reasons.extend_from_slice(&rows.reasons);
        let events = self.passes.iter().flat_map(|(_, pass)| pass.events());
        self.events = events.cloned().collect();
    }

    fn finish(self) -> Found {
        let (mut events, mut lowest) = (Vec::new(), None);
        for (_, pass) in self.passes {
            let found = pass.finish();
            events.extend(found.events);
            lowest = LowestOtf::lower(lowest, found.lowest);
        }
        Found {
            events,
            lowest,
            reasons: self.reasons,
        }
    }
}
