//! Evaluation of many samples: columns in, columns out, several samples per vector register.

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Vector3;

use super::outcome::Outcome;
use crate::evaluate::evaluation::{evaluate, ground_wrench};
use crate::evaluate::model::Model;
use crate::evaluate::quantities::Quantity;
use crate::evaluate::scope::Scope;
use crate::evaluate::workspace::Workspace;
use crate::explain::sensitivity::{SensitivitySums, SquareSums};
use crate::geometry::spatial::Wrench;
use crate::machine::Machine;
use crate::number::Lanes;
use crate::state::{Reason, Reasons, State, StateColumns};

/// The outcomes of many rows, with one column per [`Quantity`].
#[derive(Debug, Clone)]
pub struct OutcomeColumns {
    /// The quantity of each column.
    pub quantities: Vec<Quantity>,
    /// The columns, in the order of `quantities`; NaN where a number cannot be computed.
    pub columns: Vec<Vec<f64>>,
    /// Sums of the rows' derivatives, if the scope includes them.
    pub sensitivity: SensitivitySums,
    /// [`Outcome::linkage_closure`](crate::Outcome::linkage_closure) of each row: it only decides whether the
    /// row is valid.
    linkage_closure: Vec<f64>,
    /// The columns that decide whether a row is valid.
    deciding: Vec<usize>,
}

impl OutcomeColumns {
    /// Columns without rows.
    #[must_use]
    pub fn empty(machine: &Machine, scope: Scope) -> Self {
        let quantities = Quantity::all(machine, scope);
        let decides = |(_, quantity): &(usize, &Quantity)| {
            matches!(
                quantity,
                Quantity::NormalForce | Quantity::ItomFull(_) | Quantity::Load(_)
            )
        };
        let deciding = quantities.iter().enumerate().filter(decides);
        Self {
            deciding: deciding.map(|(column, _)| column).collect(),
            columns: vec![Vec::new(); quantities.len()],
            quantities,
            sensitivity: SensitivitySums::none(machine),
            linkage_closure: Vec::new(),
        }
    }

    /// The column of this quantity.
    ///
    /// # Panics
    /// If there is no such column.
    #[must_use]
    pub fn column(&self, quantity: Quantity) -> &[f64] {
        let found = self.known_column(quantity);
        found.unwrap_or_else(|| panic!("no column of {quantity:?}"))
    }

    /// The column of this quantity; `None` if the scope or the model has none.
    #[must_use]
    pub fn known_column(&self, quantity: Quantity) -> Option<&[f64]> {
        Some(&self.columns[self.place(quantity)?])
    }

    /// The place of this quantity's column; `None` if there is none.
    #[must_use]
    pub fn place(&self, quantity: Quantity) -> Option<usize> {
        self.quantities.iter().position(|&known| known == quantity)
    }

    /// The reasons `so_far` of a row and those that its outcome adds, as [`Reasons::with_outcome`] does for a
    /// single evaluation.
    #[must_use]
    pub fn reasons(&self, row: usize, so_far: Reasons) -> Reasons {
        let mut signs = OutcomeSigns {
            linkage_closure: self.linkage_closure[row],
            normal_force: f64::NAN,
            largest_overturning_moment: f64::NEG_INFINITY,
            loads_are_finite: true,
        };
        for &column in &self.deciding {
            let value = self.columns[column][row];
            match self.quantities[column] {
                Quantity::NormalForce => signs.normal_force = value,
                Quantity::ItomFull(_) => {
                    signs.largest_overturning_moment = signs.largest_overturning_moment.max(value);
                }
                Quantity::Load(_) => signs.loads_are_finite &= value.is_finite(),
                _ => {}
            }
        }
        so_far.with_signs(&signs)
    }

    /// Rows of which nothing is known.
    #[must_use]
    pub fn unknown(machine: &Machine, scope: Scope, rows: usize) -> Self {
        let mut unknown = Self::empty(machine, scope);
        for column in unknown.every_column() {
            column.resize(rows, f64::NAN);
        }
        unknown
    }

    /// Writes all rows of `others` from row `first` on, its columns to those with the indices `places`. Sums of
    /// derivatives stay: those of `others` are of other parameters.
    ///
    /// # Panics
    /// There is no such row or column.
    pub fn write(&mut self, first: usize, others: &Self, places: &[usize]) {
        let rows = first..first + others.linkage_closure.len();
        for (&place, column) in places.iter().zip(&others.columns) {
            self.columns[place][rows.clone()].copy_from_slice(column);
        }
        self.linkage_closure[rows].copy_from_slice(&others.linkage_closure);
    }

    /// Some of the rows, without sums of derivatives.
    #[must_use]
    pub fn block(mut self, rows: Range<usize>) -> Self {
        for column in self.every_column() {
            column.truncate(rows.end);
            column.drain(..rows.start);
        }
        self
    }

    /// The columns with the indices `places`, as those of a machine and scope with as many quantities.
    #[must_use]
    pub fn chosen(&self, machine: &Machine, scope: Scope, places: &[usize]) -> Self {
        let mut chosen = Self::empty(machine, scope);
        for (&place, column) in places.iter().zip(&mut chosen.columns) {
            column.clone_from(&self.columns[place]);
        }
        chosen.linkage_closure.clone_from(&self.linkage_closure);
        chosen
    }

    fn every_column(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        self.columns.iter_mut().chain([&mut self.linkage_closure])
    }

    /// Appends the rows of `other`.
    pub fn append(&mut self, mut other: Self) {
        for (column, more) in self.columns.iter_mut().zip(&mut other.columns) {
            column.append(more);
        }
        self.linkage_closure.append(&mut other.linkage_closure);
        self.sensitivity.add(&other.sensitivity);
    }
}

/// Reusable memory of [`evaluate_into`], for one machine, scope and model.
#[derive(Debug)]
pub struct BatchWorkspace {
    workspace: Workspace<Lanes>,
    state: State<Lanes>,
    /// The last rows of each column.
    staged: Vec<[[f64; Lanes::COUNT]; LANES_STAGED]>,
}

/// Rows that are written to the columns at once: whole lines of the cache, as the next rows of a column are often out of
/// it. Columns of a power of two rows share few of its places.
const ROWS_STAGED: usize = LANES_STAGED * Lanes::COUNT;
const LANES_STAGED: usize = 4;

impl BatchWorkspace {
    /// Memory for this machine; with another machine the evaluation panics or gives wrong results.
    #[must_use]
    pub fn new(machine: &Machine, scope: Scope, model: &Arc<Model>) -> Self {
        let mut workspace = Workspace::with_model(machine, scope, Arc::clone(model));
        workspace.squares = scope.sensitivities.then(|| SquareSums::new(machine));
        Self {
            workspace,
            state: State::zero(machine),
            staged: Vec::new(),
        }
    }
}

/// Evaluates blocks of rows of one machine, scope and model on any number of threads. The memory of a block is kept for
/// the next one.
#[derive(Debug)]
pub struct BatchEvaluator {
    machine: Machine,
    scope: Scope,
    model: Arc<Model>,
    /// Memory that no thread uses at the moment.
    idle: Mutex<Vec<BatchWorkspace>>,
    /// Memory for outcomes that are only looked at, and that no thread uses at the moment.
    idle_outcomes: Mutex<Vec<OutcomeColumns>>,
}

impl BatchEvaluator {
    /// An evaluator before its first block.
    #[must_use]
    pub fn new(machine: &Machine, scope: Scope, model: &Arc<Model>) -> Self {
        Self {
            machine: machine.clone(),
            scope,
            model: Arc::clone(model),
            idle: Mutex::default(),
            idle_outcomes: Mutex::default(),
        }
    }

    /// The machine.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The scope.
    #[must_use]
    pub fn scope(&self) -> Scope {
        self.scope
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Evaluates rows as [`evaluate_rows`] does, in parallel.
    #[must_use]
    pub fn evaluate(&self, states: &StateColumns, rows: Range<usize>) -> OutcomeColumns {
        let mut outcomes = OutcomeColumns::empty(&self.machine, self.scope);
        self.evaluate_into(states, rows, &|_| {}, &mut outcomes);
        outcomes
    }

    /// Evaluates `rows` of `states` after `change` has changed each of them, and shows the outcomes to `look`.
    pub fn look_at<R>(
        &self,
        states: &StateColumns,
        rows: Range<usize>,
        change: &dyn Fn(&mut State<Lanes>),
        look: impl FnOnce(&OutcomeColumns) -> R,
    ) -> R {
        let idle = lock(&self.idle_outcomes).pop();
        let mut outcomes = idle.unwrap_or_else(|| OutcomeColumns::empty(&self.machine, self.scope));
        self.evaluate_into(states, rows, change, &mut outcomes);
        let seen = look(&outcomes);
        lock(&self.idle_outcomes).push(outcomes);
        seen
    }

    fn evaluate_into(
        &self,
        states: &StateColumns,
        rows: Range<usize>,
        change: &dyn Fn(&mut State<Lanes>),
        outcomes: &mut OutcomeColumns,
    ) {
        let (machine, scope) = (&self.machine, self.scope);
        let idle = lock(&self.idle).pop();
        let mut workspace =
            idle.unwrap_or_else(|| BatchWorkspace::new(machine, scope, &self.model));
        evaluate_changed(machine, states, rows, change, &mut workspace, outcomes);
        lock(&self.idle).push(workspace);
    }
}

fn lock<T>(idle: &Mutex<Vec<T>>) -> MutexGuard<'_, Vec<T>> {
    idle.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Evaluates `rows` of `states`, [`Lanes::COUNT`] at a time, with the same bits as one by one.
#[must_use]
pub fn evaluate_rows(
    machine: &Machine,
    states: &StateColumns,
    rows: Range<usize>,
    scope: Scope,
    model: &Arc<Model>,
) -> OutcomeColumns {
    let mut workspace = BatchWorkspace::new(machine, scope, model);
    let mut outcomes = OutcomeColumns::empty(machine, scope);
    evaluate_into(machine, states, rows, &mut workspace, &mut outcomes);
    outcomes
}

/// Evaluates rows as [`evaluate_rows`] does, into columns whose previous rows it replaces. Blocks no longer than those before do
/// not allocate.
///
/// # Panics
/// `outcomes` are columns of another machine, or of a larger scope than that of the workspace.
pub fn evaluate_into(
    machine: &Machine,
    states: &StateColumns,
    rows: Range<usize>,
    workspace: &mut BatchWorkspace,
    outcomes: &mut OutcomeColumns,
) {
    evaluate_changed(machine, states, rows, &|_| {}, workspace, outcomes);
}

/// Evaluates rows as [`evaluate_into`] does, of states that `change` has changed. It is not generic: the equations shall be
/// compiled in this crate, where everything small is inlined.
fn evaluate_changed(
    machine: &Machine,
    states: &StateColumns,
    rows: Range<usize>,
    change: &dyn Fn(&mut State<Lanes>),
    workspace: &mut BatchWorkspace,
    outcomes: &mut OutcomeColumns,
) {
    let BatchWorkspace {
        workspace,
        state,
        staged,
    } = workspace;
    for column in outcomes.every_column() {
        column.resize(rows.len().next_multiple_of(ROWS_STAGED), f64::NAN);
    }
    staged.resize(
        outcomes.columns.len() + 1,
        [[0.0; Lanes::COUNT]; LANES_STAGED],
    );
    if let Some(sums) = &mut workspace.squares {
        sums.clear();
    }
    for first in rows.clone().step_by(ROWS_STAGED) {
        let end = rows.end.min(first + ROWS_STAGED);
        for (lanes, first) in (first..end).step_by(Lanes::COUNT).enumerate() {
            states.get_lanes(first, rows.end, state);
            change(state);
            if let Some(sums) = &mut workspace.squares {
                sums.count_first(rows.end - first);
            }
            let outcome = evaluate(machine, state, workspace);
            // a chained iterator would move each register through the stack several times
            for (staged, &quantity) in staged.iter_mut().zip(&outcomes.quantities) {
                staged[lanes] = outcome.get(quantity).to_array();
            }
            if let Some(closure) = staged.last_mut() {
                closure[lanes] = outcome.linkage_closure.to_array();
            }
        }
        let place = first - rows.start;
        for (column, staged) in outcomes.every_column().zip(&*staged) {
            column[place..place + ROWS_STAGED].copy_from_slice(staged.as_flattened());
        }
    }
    if let Some(sums) = &workspace.squares {
        sums.write_total(&mut outcomes.sensitivity);
    }
    for column in outcomes.every_column() {
        column.truncate(rows.len());
    }
}

/// The wrench that the ground exerts in each of `rows`, as [`evaluate`] has it, without the loads that it is divided into.
pub fn ground_wrenches(
    machine: &Machine,
    states: &StateColumns,
    rows: Range<usize>,
    workspace: &mut BatchWorkspace,
) -> Vec<Wrench<f64>> {
    of_rows(states, rows, workspace, |state, workspace| {
        in_lanes(&ground_wrench(machine, state, workspace))
    })
}

/// The wrench that the ground exerts in each of `rows`, and the unit normal of the plane through the contact points, which
/// points up; both in base axes.
pub fn ground_forces(
    machine: &Machine,
    states: &StateColumns,
    rows: Range<usize>,
    workspace: &mut BatchWorkspace,
) -> Vec<(Wrench<f64>, Vector3<f64>)> {
    of_rows(states, rows, workspace, |state, workspace| {
        let outcome = evaluate(machine, state, workspace);
        let wrench = in_lanes(&outcome.ground_wrench);
        let normal = outcome.contact_normal.map(Lanes::to_array);
        std::array::from_fn(|lane| (wrench[lane], normal.map(|of_lanes| of_lanes[lane])))
    })
}

/// The wrench of each lane.
fn in_lanes(wrench: &Wrench<Lanes>) -> [Wrench<f64>; Lanes::COUNT] {
    let force = wrench.force.map(Lanes::to_array);
    let moment = wrench.moment.map(Lanes::to_array);
    std::array::from_fn(|lane| Wrench {
        force: force.map(|of_lanes| of_lanes[lane]),
        moment: moment.map(|of_lanes| of_lanes[lane]),
    })
}

/// Returns the result of `look` for each of `rows`, which it gets as many at a time as there are lanes.
fn of_rows<R>(
    states: &StateColumns,
    rows: Range<usize>,
    workspace: &mut BatchWorkspace,
    mut look: impl FnMut(&State<Lanes>, &mut Workspace<Lanes>) -> [R; Lanes::COUNT],
) -> Vec<R> {
    let BatchWorkspace {
        workspace, state, ..
    } = workspace;
    let mut found = Vec::with_capacity(rows.len().next_multiple_of(Lanes::COUNT));
    for first in rows.clone().step_by(Lanes::COUNT) {
        states.get_lanes(first, rows.end, state);
        found.extend(look(state, workspace));
    }
    found.truncate(rows.len());
    found
}

/// The values of an outcome that determine whether it is valid.
struct OutcomeSigns {
    linkage_closure: f64,
    normal_force: f64,
    largest_overturning_moment: f64,
    loads_are_finite: bool,
}

impl Reasons {
    /// Returns these reasons with those that the row's outcome adds.
    #[must_use]
    pub fn with_outcome(self, outcome: &Outcome<f64>) -> Self {
        self.with_signs(&OutcomeSigns {
            linkage_closure: outcome.linkage_closure,
            normal_force: outcome.normal_force,
            largest_overturning_moment: largest(outcome.itom_full.iter().copied()),
            loads_are_finite: outcome.load.iter().all(|load| load.is_finite()),
        })
    }

    fn with_signs(mut self, signs: &OutcomeSigns) -> Self {
        // a measured rotation says nothing of the loads
        let are_signals_sound = (self.iter()).all(|it| {
            matches!(
                it,
                Reason::Tipping | Reason::Settling | Reason::Contradiction
            )
        });
        let rotates = self.has(Reason::Tipping);
        if signs.linkage_closure < 0.0 {
            self.add(Reason::LinkageOpen);
        }
        if signs.normal_force <= 0.0 {
            self.add(Reason::NoGroundContact);
        } else if signs.largest_overturning_moment > 0.0 {
            self.add(Reason::Tipping);
        }
        if !signs.loads_are_finite && (self.leave_inputs_known() || (rotates && are_signals_sound))
        {
            self.add(Reason::NotFinite);
        }
        self
    }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NEG_INFINITY, f64::max)
}
