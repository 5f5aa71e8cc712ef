//! The table of a log: a row for each time, computed when asked.
//!
//! The table holds times and reasons of all rows. Loads, indicators and sensitivities are computed block by block
//! (`Table::blocks`) or for a window of rows ([`Table::window`]), with the same bits, and are not kept.

use std::convert::Infallible;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use anyhow::{Result, bail};
use rayon::prelude::*;
use tipwatch_mechanics::machine::{Machine, Proofs, SessionProofs};
use tipwatch_mechanics::state::{Reason, Reasons};
use tipwatch_mechanics::{
    BatchEvaluator, Model, OutcomeColumns, Quantity, Scope, State, StateColumns,
};

use super::estimated::EstimatedRows;
use super::in_order::in_order;
use super::predicted::Predictions;
use super::rows::{Rows, Verdicts, counted_rows, row_at};
use super::state_source::StateSource;
use super::support_sets::{SupportSets, mark_contradictions};
use super::verdicts::{MonitorRecord, ProofRecord, RowJudge};
use super::widening::Widening;

/// Rows of a block that is computed at once.
pub const BLOCK_ROWS: usize = 512;

/// The rows of a log.
#[derive(Debug)]
pub struct Table {
    /// Times (ns) on the clock of the stamps.
    pub times_ns: Vec<i64>,
    /// Reasons why a row is not valid; empty for a valid row.
    pub reasons: Vec<Reasons>,
    /// The quantities of each row.
    pub quantities: Vec<Quantity>,
    states: Arc<dyn StateSource>,
    /// The first row among those of `states`.
    first: usize,
    evaluator: BatchEvaluator,
    record: MonitorRecord,
    /// Times, first and last, in which the platform rotates about an edge (ns).
    rotating: Vec<[i64; 2]>,
    proofs: ProofRecord,
    /// Whether the loads are those of a supposition, of which the recorded motion of the platform shows nothing.
    is_supposed: bool,
    /// Whether a gyro measured how the platform turned; an odometry knows nothing of a lean.
    has_gyro: bool,
    widening: Option<Arc<dyn Widening>>,
    /// The sets of supports, if they come and go; the machine of `evaluator` then only names the columns.
    supports: Option<Arc<SupportSets>>,
    /// Commanded rates of the joints, from the row at each time (ns) on, if rows are predicted.
    commands: Option<Vec<(i64, Vec<f64>)>>,
    whole: OnceLock<Arc<Rows>>,
}

counted_rows!(Table);

impl Table {
    /// The table of rows whose outcomes are not yet known.
    pub(crate) fn new(
        machine: &Machine,
        estimated: EstimatedRows,
        scope: Scope,
        model: &Arc<Model>,
        record: MonitorRecord,
    ) -> Self {
        Self {
            times_ns: estimated.times_ns,
            reasons: estimated.reasons,
            quantities: Quantity::all(machine, scope),
            states: estimated.states,
            first: estimated.first,
            evaluator: BatchEvaluator::new(machine, scope, model),
            record,
            rotating: Vec::new(),
            proofs: ProofRecord::default(),
            is_supposed: false,
            has_gyro: false,
            widening: None,
            supports: None,
            commands: None,
            whole: OnceLock::new(),
        }
    }

    /// Widens the bands of all rows computed from now on.
    pub(crate) fn widen_by(&mut self, widening: Arc<dyn Widening>) {
        self.widening = Some(widening);
    }

    /// States when the platform rotates about an edge, as the estimator knew it in each row: first and last times (ns).
    pub(crate) fn rotating(mut self, rotating: Vec<[i64; 2]>) -> Self {
        self.rotating = rotating;
        self
    }

    /// States it in retrospect: in the rows at these times the machine tips, and in no others by how its platform rotates.
    pub(crate) fn rotated(&mut self, rotating: Vec<[i64; 2]>) {
        for (&time_ns, reasons) in self.times_ns.iter().zip(&mut self.reasons) {
            *reasons = reasons.without(Reason::Tipping);
            if (rotating.iter()).any(|[first, last]| (*first..=*last).contains(&time_ns)) {
                reasons.add(Reason::Tipping);
            }
        }
        self.rotating = rotating;
    }

    /// States the proofs on which the verdicts rest. Without them nothing is proven.
    pub(crate) fn resting_on(mut self, proofs: ProofRecord) -> Self {
        self.proofs = proofs;
        self
    }

    /// The signals that a commissioning or the motion of the whole log has proven.
    pub(crate) fn proven(&self) -> Proofs {
        self.proofs.proven()
    }

    /// What the signals of the whole log show of their proofs.
    pub(crate) fn shown(&self) -> SessionProofs {
        self.proofs.shown_at_end()
    }

    /// States whether the loads are those of something supposed.
    pub(crate) fn supposing(mut self, is_supposed: bool) -> Self {
        self.is_supposed = is_supposed;
        self
    }

    /// Whether the loads are those of a supposition.
    pub(crate) fn is_supposed(&self) -> bool {
        self.is_supposed
    }

    /// States whether a gyro measured how the platform turned.
    pub(crate) fn turning_by_gyro(mut self, has_gyro: bool) -> Self {
        self.has_gyro = has_gyro;
        self
    }

    /// Whether a gyro measured how the platform turned.
    pub(crate) fn has_gyro(&self) -> bool {
        self.has_gyro
    }

    /// Predicts the motion ahead of each row: for rows whose states know nothing of later samples.
    ///
    /// `commands` are the rates that are asked of the joints, from the row at each time (ns) on.
    pub(crate) fn predicting(mut self, commands: Vec<(i64, Vec<f64>)>) -> Self {
        self.commands = Some(commands);
        self
    }

    /// The table of a machine on different supports, which `machine` names.
    pub(crate) fn on_supports(mut self, machine: &Machine, supports: SupportSets) -> Self {
        let scope = self.evaluator.scope();
        self.quantities = Quantity::all(machine, scope);
        self.evaluator = BatchEvaluator::new(machine, scope, self.evaluator.model());
        self.supports = Some(Arc::new(supports));
        self
    }

    /// Returns the rows on the set of supports with this index, without those at other times: their reasons say so.
    pub(crate) fn on_set(&self, index: usize, machine: &Machine) -> Self {
        let mut reasons = self.reasons.clone();
        let spans = self.supports().map_or(&[][..], |supports| &supports.spans);
        for (rows, _) in spans.iter().filter(|(_, set)| *set != Some(index)) {
            for reasons in &mut reasons[rows.clone()] {
                reasons.add(Reason::SupportsUnknown);
            }
        }
        let scope = self.evaluator.scope();
        Self {
            times_ns: self.times_ns.clone(),
            reasons,
            quantities: Quantity::all(machine, scope),
            states: Arc::clone(&self.states),
            first: self.first,
            evaluator: BatchEvaluator::new(machine, scope, self.evaluator.model()),
            record: MonitorRecord::default(),
            rotating: self.rotating.clone(),
            proofs: self.proofs.clone(),
            is_supposed: self.is_supposed,
            has_gyro: self.has_gyro,
            widening: self.widening.clone(),
            supports: None,
            commands: None,
            whole: OnceLock::new(),
        }
    }

    /// The sets of supports, if they come and go.
    pub(crate) fn supports(&self) -> Option<&SupportSets> {
        self.supports.as_deref()
    }

    /// The machine on the supports of a row; `None` where these are unknown.
    #[must_use]
    pub fn machine_at(&self, row: usize) -> Option<&Machine> {
        match &self.supports {
            Some(supports) => supports.of_row(row).map(|set| &set.machine),
            None => Some(self.evaluator.machine()),
        }
    }

    /// The row at a time, or the next one.
    #[must_use]
    pub fn at(&self, time_ns: i64) -> usize {
        row_at(&self.times_ns, time_ns)
    }

    /// A time (ns) on the clock of the stamps, in seconds after the first row.
    #[must_use]
    pub fn seconds_at(&self, time_ns: i64) -> f64 {
        time_ns.saturating_sub(self.times_ns[0]) as f64 * 1e-9
    }

    /// Whether the model computes a quantity.
    #[must_use]
    pub fn has(&self, quantity: Quantity) -> bool {
        self.quantities.contains(&quantity)
    }

    /// All rows. They are computed and kept, if they were not before.
    pub fn whole(&self) -> &Rows {
        self.whole.get_or_init(|| Arc::new(self.compute_whole()))
    }

    /// Whether the whole table is kept in memory.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.whole.get().is_some()
    }

    /// Reads the state of a row.
    pub fn state(&self, row: usize, state: &mut State<f64>) {
        self.states.state(self.first + row, state);
    }

    /// Checks that all states could be read so far. Rows without a state are unknown.
    ///
    /// # Errors
    /// States could not be read.
    pub(crate) fn check(&self) -> Result<()> {
        let widening = self.widening.as_ref();
        let failure = widening.and_then(|widening| widening.failure());
        match self.states.failure().or(failure) {
            Some(failure) => {
                bail!("expected the samples of the log, found that they cannot be read: {failure}")
            }
            None => Ok(()),
        }
    }

    /// Computes a window of rows, without verdicts: these depend on all rows before.
    #[must_use]
    pub fn window(&self, rows: Range<usize>) -> Rows {
        let states = self.states.read(self.at_source(&rows)).states;
        self.evaluated(rows, states)
    }

    fn at_source(&self, rows: &Range<usize>) -> Range<usize> {
        self.first + rows.start..self.first + rows.end
    }

    fn evaluated(&self, rows: Range<usize>, states: StateColumns) -> Rows {
        let so_far = &self.reasons[rows.clone()];
        let evaluator = &self.evaluator;
        let (outcomes, reasons) = match &self.supports {
            Some(supports) => supports.evaluate(evaluator, rows.start, &states, so_far),
            None => {
                let outcomes = evaluator.evaluate(&states, 0..rows.len());
                let before = so_far.iter().enumerate();
                let reasons = before.map(|(row, &reasons)| outcomes.reasons(row, reasons));
                let reasons = reasons.collect();
                (outcomes, reasons)
            }
        };
        let next_ns = self.times_ns.get(rows.end).copied();
        let mut rows = Rows {
            first: rows.start,
            start_ns: self.times_ns[0],
            reasons,
            times_ns: self.times_ns[rows].to_vec(),
            states,
            outcomes,
            verdicts: None,
        };
        match (&self.widening, &self.supports) {
            (None, None) => {}
            (Some(widening), None) => widening.widen(evaluator.machine(), &mut rows, next_ns),
            (widening, Some(supports)) => {
                widen_on_supports(
                    supports,
                    widening.as_deref(),
                    evaluator.scope(),
                    &mut rows,
                    next_ns,
                );
            }
        }
        rows
    }

    /// Computes all rows on all cores; `take` receives the blocks in order, with their verdicts, while the next ones
    /// are computed. What `with` makes of a block is handed over with it.
    ///
    /// # Errors
    /// The first error of `take`.
    pub(crate) fn blocks<W: Send, E: Send>(
        &self,
        with: impl Fn(&Rows) -> W + Sync,
        mut take: impl FnMut(Vec<(Rows, W)>) -> Result<(), E> + Send,
    ) -> Result<(), E> {
        // the rows whose states are estimated together, split into blocks
        let unit = self.states.rows_at_once();
        let compute_unit = |unit: Range<usize>| -> Vec<(Rows, W)> {
            let states = self.states.read(self.at_source(&unit)).states;
            let firsts: Vec<usize> = (0..unit.len()).step_by(BLOCK_ROWS).collect();
            let blocks = firsts.into_par_iter().map(|first| {
                let rows = first..(first + BLOCK_ROWS).min(unit.len());
                let states = states.block(rows.clone());
                let rows = self.evaluated(unit.start + rows.start..unit.start + rows.end, states);
                let more = with(&rows);
                (rows, more)
            });
            blocks.collect()
        };
        let units = self.first / unit..(self.first + self.len()).div_ceil(unit);
        let unit_at = |place: usize| {
            let start = (place * unit).saturating_sub(self.first);
            start
                ..((place + 1) * unit)
                    .saturating_sub(self.first)
                    .min(self.len())
        };
        let evaluator = &self.evaluator;
        let mut judge = evaluator.scope().sensitivities.then(|| {
            let judge = RowJudge::new(
                evaluator.machine(),
                &self.record,
                &self.rotating,
                &self.proofs,
                self.supports(),
            );
            match &self.commands {
                Some(commands) => judge.predicting(commands),
                None => judge,
            }
        });
        in_order(
            units.map(unit_at),
            compute_unit,
            |mut blocks| -> Result<(), E> {
                if let Some(judge) = &mut judge {
                    for (rows, _) in &mut blocks {
                        rows.verdicts = Some(judge.judge(rows));
                    }
                }
                take(blocks)
            },
        )
    }

    /// Hands all rows to `take`, block by block and in order: those that are kept, or computed once more.
    ///
    /// # Errors
    /// The first error of `take`.
    pub(crate) fn feed<E: Send>(
        &self,
        take: &mut (dyn FnMut(&Arc<Rows>) -> Result<(), E> + Send),
    ) -> Result<(), E> {
        if let Some(whole) = self.whole.get() {
            return take(whole);
        }
        self.blocks(
            |_| (),
            |blocks| {
                let mut blocks = blocks.into_iter();
                blocks.try_for_each(|(rows, ())| take(&Arc::new(rows)))
            },
        )
    }

    /// Keeps the whole table.
    pub(crate) fn keep(&self, rows: Rows) {
        // the first one stays: all have the same bits
        let _ = self.whole.set(Arc::new(rows));
    }

    /// The whole table without a row.
    pub(crate) fn no_rows(&self) -> Rows {
        let (machine, scope) = (self.evaluator.machine(), self.evaluator.scope());
        Rows {
            first: 0,
            start_ns: self.times_ns.first().copied().unwrap_or(0),
            times_ns: Vec::new(),
            reasons: Vec::new(),
            states: StateColumns::unknown(machine, 0),
            outcomes: OutcomeColumns::empty(machine, scope),
            verdicts: scope.sensitivities.then(|| Verdicts {
                predictions: (self.commands.is_some())
                    .then(|| Predictions::none(machine.wheels().len())),
                ..Verdicts::default()
            }),
        }
    }

    fn compute_whole(&self) -> Rows {
        let mut whole = self.no_rows();
        let taken: Result<(), Infallible> = self.blocks(
            |_| (),
            |blocks| {
                blocks.into_iter().for_each(|(rows, ())| whole.append(rows));
                Ok(())
            },
        );
        match taken {
            Ok(()) => whole,
        }
    }
}

/// Widens the bands of rows, each span with the machine on its supports, and marks the rows in which a measured load is not within
/// them; `next_ns` is the time of the row that follows.
fn widen_on_supports(
    supports: &SupportSets,
    widening: Option<&dyn Widening>,
    scope: Scope,
    all: &mut Rows,
    next_ns: Option<i64>,
) {
    for (rows, set) in supports.spans_within(all.first..all.first + all.len()) {
        let Some(set) = set.map(|set| &supports.sets[set]) else {
            continue;
        };
        let has_loads = supports.have_loads_of(set);
        if widening.is_none() && !has_loads {
            continue;
        }
        let next_ns = all.times_ns.get(rows.end).copied().or(next_ns);
        let mut of_set = all.on_set(set, scope, rows.clone());
        if let Some(widening) = widening {
            widening.widen(&set.machine, &mut of_set, next_ns);
            all.outcomes
                .write(rows.start, &of_set.outcomes, &set.places);
        }
        if has_loads {
            let reasons = &mut all.reasons[rows];
            mark_contradictions(&set.machine, &of_set.states, &of_set.outcomes, reasons);
        }
    }
}
