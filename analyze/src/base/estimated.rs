//! The estimated rows of a log: their times, and their states wherever these come from.

use std::collections::BTreeMap;
use std::fmt::{self, Debug};
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use tipwatch_mechanics::State;
use tipwatch_mechanics::estimation::EstimatedStates;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::{Reason, Reasons};

use super::rows::counted_rows;
use super::state_source::StateSource;

/// The rows of a log before their outcomes are computed.
#[derive(Debug)]
pub struct EstimatedRows {
    /// Times (ns) on the clock of the stamps.
    pub times_ns: Vec<i64>,
    /// Reasons why a row is not valid, as far as the signals show.
    pub reasons: Vec<Reasons>,
    /// Activity of the machine in each row.
    pub(crate) activities: Vec<Activity>,
    /// The states of some rows.
    kept: BTreeMap<usize, State<f64>>,
    pub(super) states: Arc<dyn StateSource>,
    /// The first row among those of `states`.
    pub(crate) first: usize,
    /// Time of the first row of the log (ns), in the requested time range or not.
    pub(crate) begins_ns: i64,
}

/// Activity of the machine in a row.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Activity {
    pub(crate) has_velocity: bool,
    pub(crate) at_standstill: bool,
    pub(crate) travels: bool,
    /// Whether the base does not turn, and the arm moves slowly at most.
    pub(crate) is_quiet: bool,
    /// Activity of the machine, by its angular velocity and the change of its velocity.
    pub(crate) travel: f64,
    /// Activity of its arm.
    pub(crate) arm: f64,
}

counted_rows!(EstimatedRows);

impl EstimatedRows {
    /// Reads the states of all rows once, on all cores. The states of `kept` rows stay in memory.
    pub(crate) fn new(
        machine: &Machine,
        times_ns: Vec<i64>,
        states: Arc<dyn StateSource>,
        kept: &[usize],
        activity: impl Fn(&Machine, &State<f64>) -> Activity + Sync,
    ) -> Self {
        let unit = states.rows_at_once();
        let mut reasons = vec![Reasons::NONE; times_ns.len()];
        let mut activities = vec![Activity::default(); times_ns.len()];
        let blocks = (reasons.par_chunks_mut(unit)).zip(activities.par_chunks_mut(unit));
        let kept = blocks.enumerate().map(|(block, (reasons, activities))| {
            let first = block * unit;
            let rows = first..first + reasons.len();
            let block = states.read(rows.clone());
            reasons.copy_from_slice(&block.reasons);
            let mut state = State::zero(machine);
            for (row, of_row) in activities.iter_mut().enumerate() {
                block.states.get(row, &mut state);
                *of_row = activity(machine, &state);
            }
            let place = |row: usize| kept.partition_point(|&kept| kept < row);
            let kept = kept[place(rows.start)..place(rows.end)].iter().map(|&row| {
                block.states.get(row - first, &mut state);
                (row, state.clone())
            });
            kept.collect()
        });
        let kept: Vec<Vec<(usize, State<f64>)>> = kept.collect();
        Self {
            reasons,
            activities,
            kept: kept.into_iter().flatten().collect(),
            begins_ns: times_ns.first().copied().unwrap_or(0),
            times_ns,
            states,
            first: 0,
        }
    }

    /// Whether a row is in a window of the machine file (s), which counts from the first row of the log.
    pub(crate) fn is_in(&self, [from_s, to_s]: [f64; 2], row: usize) -> bool {
        let seconds = (self.times_ns[row] - self.begins_ns) as f64 * 1e-9;
        (from_s..to_s).contains(&seconds)
    }

    /// A time (ns) on the clock of the stamps, in seconds after the first row.
    pub(crate) fn seconds_at(&self, time_ns: i64) -> f64 {
        (time_ns - self.times_ns[0]) as f64 * 1e-9
    }

    /// Reads the state of a row.
    pub fn state(&self, row: usize, state: &mut State<f64>) {
        let row = self.first + row;
        match self.kept.get(&row) {
            Some(kept) => state.clone_from(kept),
            None => self.states.state(row, state),
        }
    }

    /// Looks at the states through `wrap` from now on.
    pub(crate) fn look_through(
        &mut self,
        wrap: impl FnOnce(Arc<dyn StateSource>) -> Arc<dyn StateSource>,
    ) {
        self.kept.clear();
        self.states = wrap(Arc::clone(&self.states));
    }

    /// Changes the states of the rows at these times, first and last (ns), from now on; `change` is given the row.
    pub(crate) fn change(
        &mut self,
        machine: &Machine,
        spans_ns: &[[i64; 2]],
        change: impl Fn(usize, &mut State<f64>) + Send + Sync + 'static,
    ) {
        let rows = spans_ns.iter().map(|&span_ns| {
            let rows = self.rows_at(span_ns);
            self.first + rows.start..self.first + rows.end
        });
        let rows: Vec<Range<usize>> = rows.filter(|rows| !rows.is_empty()).collect();
        if rows.is_empty() {
            return;
        }
        let first = self.first;
        let change = move |row: usize, state: &mut State<f64>| change(row - first, state);
        for rows in &rows {
            (self.kept.range_mut(rows.clone())).for_each(|(row, state)| change(*row, state));
        }
        self.states = Arc::new(ChangedStates {
            source: Arc::clone(&self.states),
            rows,
            change: Arc::new(change),
            blank: State::zero(machine),
        });
    }

    /// Adds a reason to the rows at these times, first and last (ns).
    pub(crate) fn add_reason(&mut self, spans_ns: &[[i64; 2]], reason: Reason) {
        for &span_ns in spans_ns {
            let rows = self.rows_at(span_ns);
            let reasons = self.reasons.get_mut(rows).into_iter().flatten();
            reasons.for_each(|reasons| reasons.add(reason));
        }
    }

    /// The rows from a time to another one (ns).
    fn rows_at(&self, [from_ns, to_ns]: [i64; 2]) -> Range<usize> {
        let times = &self.times_ns;
        times.partition_point(|&time| time < from_ns)..times.partition_point(|&time| time <= to_ns)
    }

    /// Keeps some consecutive rows.
    #[must_use]
    pub(crate) fn cut(mut self, rows: Range<usize>) -> Self {
        self.first += rows.start;
        cut(&mut self.times_ns, &rows);
        cut(&mut self.reasons, &rows);
        cut(&mut self.activities, &rows);
        self
    }
}

/// Keeps some of the numbers of a column, in its memory: a long log has no room for a copy.
fn cut<T>(column: &mut Vec<T>, rows: &Range<usize>) {
    column.truncate(rows.end);
    column.drain(..rows.start);
}

/// Changes the state of a row.
type Change = dyn Fn(usize, &mut State<f64>) + Send + Sync;

/// The states of another source, of which some are changed.
struct ChangedStates {
    source: Arc<dyn StateSource>,
    /// The rows that are, in order.
    rows: Vec<Range<usize>>,
    change: Arc<Change>,
    /// A state of the machine.
    blank: State<f64>,
}

impl Debug for ChangedStates {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut of = formatter.debug_struct("ChangedStates");
        of.field("source", &self.source).field("rows", &self.rows);
        of.finish_non_exhaustive()
    }
}

impl StateSource for ChangedStates {
    fn rows_at_once(&self) -> usize {
        self.source.rows_at_once()
    }

    fn read(&self, rows: Range<usize>) -> EstimatedStates {
        let mut read = self.source.read(rows.clone());
        let mut state = self.blank.clone();
        for changed in &self.rows {
            for row in changed.start.max(rows.start)..changed.end.min(rows.end) {
                read.states.get(row - rows.start, &mut state);
                (self.change)(row, &mut state);
                read.states.set(row - rows.start, &mut state);
            }
        }
        read
    }

    fn state(&self, row: usize, state: &mut State<f64>) {
        self.source.state(row, state);
        if self.rows.iter().any(|rows| rows.contains(&row)) {
            (self.change)(row, state);
        }
    }

    fn failure(&self) -> Option<String> {
        self.source.failure()
    }
}
