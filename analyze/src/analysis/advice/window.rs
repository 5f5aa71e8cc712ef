//! The rows that a change is simulated on: the event and the manoeuvre around it.

use std::ops::Range;
use std::sync::Arc;

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::{BatchEvaluator, ForcesByRule, Model, Scope, State, StateColumns};

use super::to_base::ToBase;
use crate::base::table::Table;
use crate::events::Event;

/// Least margin before and after the event (ns).
pub(super) const MARGIN_NS: i64 = 1_000_000_000;
/// Beyond the margin the window goes on until every joint rests, at most this far from the event (ns).
pub(super) const FARTHEST_REST_NS: i64 = 10_000_000_000;
/// Joints slower than this rest (rad/s or m/s).
const RESTING_RATE: f64 = 0.02;
/// Longest time for which the logged motion of the joints is followed after tipping began (ns).
pub(super) const LONGEST_TIPPING_NS: i64 = 5_000_000_000;

/// Rows to simulate.
#[derive(Debug)]
pub(super) struct Window {
    /// Computes loads of the machine with its sensor frame at the base frame.
    pub(super) evaluator: Arc<BatchEvaluator>,
    /// The states: `imu` is the motion of the base.
    pub(super) states: StateColumns,
    /// The rows of the log.
    pub(super) rows: Vec<usize>,
    /// Forward velocity (m/s) in the first row; NaN if unknown.
    pub(super) entry_speed: f64,
    /// Rows in which the machine was tipping.
    pub(super) held: Vec<bool>,
    /// Rows whose state is unknown.
    pub(super) left_out: usize,
    /// Rows of the event itself whose state is unknown.
    pub(super) left_out_of_event: usize,
}

/// Times (ns) of the event around `row`: the stability events that contain it, and those that overlap them. `None` if
/// no stability event contains it.
pub(super) fn event_around(events: &[Event], rows: &Table, row: usize) -> Option<[i64; 2]> {
    let last_ns = *rows.times_ns.last()?;
    let spans: Vec<[i64; 2]> = (events.iter())
        .filter(|event| event.kind.is_observed())
        .map(|event| [event.start_ns, event.end_ns.unwrap_or(last_ns)])
        .collect();
    let at = rows.times_ns[row];
    let mut all = *spans.iter().find(|span| span[0] <= at && at <= span[1])?;
    loop {
        let overlapping = spans.iter().filter(|s| s[0] <= all[1] && all[0] <= s[1]);
        let wider = overlapping.fold(all, |a, s| [a[0].min(s[0]), a[1].max(s[1])]);
        if wider == all {
            return Some(all);
        }
        all = wider;
    }
}

impl Window {
    /// The window around an event.
    pub(super) fn around(machine: &Machine, rows: &Table, event: [i64; 2]) -> Self {
        Self::of(machine, rows, span(machine, rows, event), event)
    }

    /// Some rows around an event.
    pub(super) fn of(machine: &Machine, rows: &Table, span: Range<usize>, event: [i64; 2]) -> Self {
        let mut found = Self {
            evaluator: Arc::new(Self::evaluator(&machine.measured_at_base())),
            states: StateColumns::unknown(machine, span.len()),
            rows: Vec::new(),
            entry_speed: f64::NAN,
            held: Vec::new(),
            left_out: 0,
            left_out_of_event: 0,
        };
        let mut base = BaseOfRows::new(machine);
        for row in span {
            match base.at(rows, row) {
                BaseAt::Known { held } => {
                    if found.rows.is_empty() {
                        found.entry_speed = base.state.base.velocity.x;
                    }
                    found.states.set(found.rows.len(), &mut base.state);
                    found.rows.push(row);
                    found.held.push(held);
                }
                BaseAt::Unknown => {
                    found.left_out += 1;
                    let time = rows.times_ns[row];
                    let in_event = event[0] <= time && time <= event[1];
                    found.left_out_of_event += usize::from(in_event);
                }
                BaseAt::TooLate => break,
            }
        }
        found.states.resize(found.rows.len());
        found
    }

    /// Computes the loads of a machine alone.
    pub(super) fn evaluator(machine: &Machine) -> BatchEvaluator {
        BatchEvaluator::new(machine, Scope::LOADS, &Arc::new(Model::WholeBody))
    }

    pub(super) fn machine(&self) -> &Machine {
        self.evaluator.machine()
    }

    /// Some of the rows.
    pub(super) fn pick(&self, picked: &[usize]) -> Self {
        Self {
            evaluator: Arc::clone(&self.evaluator),
            states: self.states.picked(picked.iter().copied()),
            rows: picked.iter().map(|&row| self.rows[row]).collect(),
            entry_speed: self.entry_speed,
            held: picked.iter().map(|&row| self.held[row]).collect(),
            left_out: self.left_out,
            left_out_of_event: self.left_out_of_event,
        }
    }

    /// Whether measured actuator forces may determine a part of the split.
    pub(super) fn may_measure_split(&self) -> bool {
        !self.machine().contact().actuated_joints.is_empty()
    }

    /// Calls `visit` with each state.
    pub(super) fn for_each_state(&self, mut visit: impl FnMut(&State<f64>)) {
        let mut state = State::zero(self.machine());
        for row in 0..self.rows.len() {
            self.states.get(row, &mut state);
            visit(&state);
        }
    }
}

/// Rows of the event with its margins, on to where every joint rests.
fn span(machine: &Machine, rows: &Table, event: [i64; 2]) -> Range<usize> {
    let mut state = State::zero(machine);
    let mut rests = |row: usize| {
        rows.state(row, &mut state);
        let joints = state.joints.iter().enumerate();
        joints
            .filter(|(joint, _)| !machine.joint_spins_wheel(*joint))
            .all(|(_, motion)| motion.rate.abs() < RESTING_RATE)
    };
    let with = |margin: i64| {
        [
            event[0].saturating_sub(margin),
            event[1].saturating_add(margin),
        ]
    };
    let (least, most) = (with(MARGIN_NS), with(FARTHEST_REST_NS));
    let (mut first, mut last) = (rows.at(least[0]), rows.at(least[1]));
    let near = |row: usize| (most[0]..=most[1]).contains(&rows.times_ns[row]);
    while first > 0 && near(first - 1) && !rests(first) {
        first -= 1;
    }
    while last + 1 < rows.len() && near(last + 1) && !rests(last) {
        last += 1;
    }
    first..last + 1
}

/// The motion of the base, row by row.
struct BaseOfRows<'a> {
    machine: &'a Machine,
    at_base: Machine,
    state: State<f64>,
    to_base: ToBase,
    forces: ForcesByRule<f64>,
    /// The last row in which the machine was not tipping.
    before: Option<State<f64>>,
    /// Time at which the machine began to tip (ns).
    tipping_since: Option<i64>,
}

enum BaseAt {
    /// The motion of the base is in `state`.
    Known {
        held: bool,
    },
    Unknown,
    TooLate,
}

impl<'a> BaseOfRows<'a> {
    fn new(machine: &'a Machine) -> Self {
        Self {
            machine,
            at_base: machine.measured_at_base(),
            state: State::zero(machine),
            to_base: ToBase::new(machine),
            forces: ForcesByRule::new(machine),
            before: None,
            tipping_since: None,
        }
    }

    /// The state of a row with the motion of the base as its sensor's. Once the machine tips, the measured motion of the
    /// base is that of the fall: the base then keeps its motion from before, and the joints move as logged. Measured forces change
    /// by what those of the split rule do.
    fn at(&mut self, rows: &Table, row: usize) -> BaseAt {
        let (machine, reasons) = (self.machine, rows.reasons[row]);
        let tips = reasons.has(Reason::Tipping) || reasons.has(Reason::NoGroundContact);
        let may_be_used = |reason| {
            matches!(
                reason,
                Reason::Tipping
                    | Reason::NoGroundContact
                    | Reason::NotFinite
                    | Reason::Contradiction
            )
        };
        rows.state(row, &mut self.state);
        let joints_are_known = self.state.joints.iter().all(|j| j.position.is_finite());
        let usable = if tips {
            reasons.iter().all(may_be_used)
        } else {
            reasons.leave_valid()
        };
        if !usable || !joints_are_known {
            return BaseAt::Unknown;
        }
        if tips {
            let since = *self.tipping_since.get_or_insert(rows.times_ns[row]);
            if rows.times_ns[row].saturating_sub(since) > LONGEST_TIPPING_NS {
                return BaseAt::TooLate;
            }
            let Some(before) = &self.before else {
                return BaseAt::Unknown;
            };
            let falling = std::mem::replace(&mut self.state, before.clone());
            let machines = [&self.at_base; 2];
            self.forces.change(machines, &mut self.state, |state| {
                let (imu, base) = (state.imu, state.base);
                *state = falling;
                (state.imu, state.base) = (imu, base);
            });
        } else {
            self.tipping_since = None;
            self.to_base.apply(machine, &mut self.state);
            self.before = Some(self.state.clone());
        }
        BaseAt::Known { held: tips }
    }
}
