//! The states of a log under hypotheses.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use tipwatch_mechanics::estimation::EstimatedStates;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{ForcesByRule, State};

use super::hypothesis::{Hypothesis, Supposed};
use super::to_base::ToBase;
use crate::base::state_source::StateSource;
use crate::base::support_sets::SupportSets;

/// States whose sensor is at the base frame, changed by hypotheses in their order. Measured forces change by what those of the
/// split rule change, see [`ForcesByRule`].
pub(crate) struct SupposedStates {
    recorded: Arc<dyn StateSource>,
    /// The machine that was recorded.
    recorded_by: Machine,
    /// The recorded machine with its sensor at the base frame.
    machine: Machine,
    /// The machine as recorded and as supposed, on each set of its supports, with its sensor at the base frame.
    standing: Vec<[Machine; 2]>,
    /// Sets of supports on which the rows are; `None` for a machine that is always on the same supports.
    supports: Option<SupportSets>,
    hypotheses: Vec<Hypothesis>,
    /// Times of the rows (ns), and the index of the recorded state of the first row.
    times_ns: Vec<i64>,
    first: usize,
}

impl fmt::Debug for SupposedStates {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("SupposedStates")
            .field("hypotheses", &self.hypotheses)
            .finish_non_exhaustive()
    }
}

impl SupposedStates {
    pub(crate) fn new(
        recorded: Arc<dyn StateSource>,
        recorded_by: Machine,
        (standing, supports): (Vec<[Machine; 2]>, Option<SupportSets>),
        hypotheses: Vec<Hypothesis>,
        (times_ns, first): (Vec<i64>, usize),
    ) -> Self {
        Self {
            recorded,
            machine: recorded_by.measured_at_base(),
            standing,
            supports,
            recorded_by,
            hypotheses,
            times_ns,
            first,
        }
    }

    /// Row of a recorded state; of one beside the rows, which is read with them, the nearest row.
    fn row_of(&self, state: usize) -> usize {
        let last = self.times_ns.len().saturating_sub(1);
        state.saturating_sub(self.first).min(last)
    }

    /// Calls `change` with each row and its state.
    fn changed(&self, mut each: impl FnMut(&mut dyn FnMut(usize, &mut State<f64>))) {
        let mut to_base = ToBase::new(&self.recorded_by);
        let mut supposed = Supposed::new(&self.machine);
        let mut forces: Vec<_> = self.standing.iter().map(|_| None).collect();
        each(&mut |place, state| {
            let row = self.row_of(place);
            let time_ns = self.times_ns.get(row).copied().unwrap_or(0);
            to_base.apply(&self.recorded_by, state);
            let mut change = |state: &mut State<f64>| {
                for hypothesis in &self.hypotheses {
                    supposed.apply(hypothesis, time_ns, state);
                }
            };
            let on = match &self.supports {
                Some(supports) => supports.index_of_row(row),
                None => Some(0),
            };
            match on.and_then(|on| Some((self.standing.get(on)?, forces.get_mut(on)?))) {
                Some(([from, to], forces)) => {
                    let forces = forces.get_or_insert_with(|| ForcesByRule::new(to));
                    forces.change([from, to], state, &mut change);
                }
                // on what it stands is not known, and so no load
                None => change(state),
            }
        });
    }
}

impl StateSource for SupposedStates {
    fn rows_at_once(&self) -> usize {
        self.recorded.rows_at_once()
    }

    fn read(&self, rows: Range<usize>) -> EstimatedStates {
        let mut found = self.recorded.read(rows.clone());
        let mut state = State::zero(&self.machine);
        self.changed(|change| {
            for (place, row) in rows.clone().enumerate() {
                found.states.get(place, &mut state);
                change(row, &mut state);
                found.states.set(place, &mut state);
            }
        });
        found
    }

    fn state(&self, row: usize, state: &mut State<f64>) {
        self.recorded.state(row, state);
        self.changed(|change| change(row, state));
    }

    fn failure(&self) -> Option<String> {
        self.recorded.failure()
    }
}
