//! The machine on each set of supports, and the set of each row.

use std::ops::Range;

use tipwatch_mechanics::machine::{ForceSource, Machine};
use tipwatch_mechanics::state::{Reason, Reasons};
use tipwatch_mechanics::{
    BatchEvaluator, ColumnNames, OutcomeColumns, Quantity, Scope, State, StateColumns,
    evaluate_rows,
};

/// A measured load contradicts equilibrium from so many standard deviations on.
const CONTRADICTS_SIGMAS: f64 = 5.0;

/// A machine on different supports in the course of a log.
#[derive(Debug, Clone)]
pub(crate) struct SupportSets {
    /// The sets.
    pub(crate) sets: Vec<SupportSet>,
    /// Rows without gaps, in order, each with the index of its set; `None` where the set is unknown.
    pub(crate) spans: Vec<(Range<usize>, Option<usize>)>,
}

/// A machine on one set of supports.
#[derive(Debug, Clone)]
pub(crate) struct SupportSet {
    /// The machine.
    pub(crate) machine: Machine,
    /// For each of its quantities, the column of the table.
    pub(crate) places: Vec<usize>,
}

impl SupportSet {
    /// The set as part of a table with the quantities of `whole`. Columns are found by their names.
    pub(crate) fn new(machine: Machine, whole: &Machine, scope: Scope) -> Self {
        let names = |machine: &Machine| -> Vec<String> {
            let names = ColumnNames::of(machine);
            let all = Quantity::all(machine, scope).into_iter();
            all.map(|quantity| quantity.column(&names)).collect()
        };
        let columns = names(whole);
        let place = |name: &String| columns.iter().position(|column| column == name);
        let places = names(&machine).iter().filter_map(place).collect();
        Self { machine, places }
    }
}

impl SupportSets {
    /// The index of the set of a row; `None` where it is unknown.
    pub(crate) fn index_of_row(&self, row: usize) -> Option<usize> {
        let place = self.spans.partition_point(|(rows, _)| rows.end <= row);
        let (_, set) = self.spans.get(place)?;
        *set
    }

    /// The set of a row; `None` where it is unknown.
    pub(crate) fn of_row(&self, row: usize) -> Option<&SupportSet> {
        self.index_of_row(row).map(|set| &self.sets[set])
    }

    /// Outcomes of some rows of the table, which begin at row `first`, and their reasons.
    pub(crate) fn evaluate(
        &self,
        whole: &BatchEvaluator,
        first: usize,
        states: &StateColumns,
        so_far: &[Reasons],
    ) -> (OutcomeColumns, Vec<Reasons>) {
        let (scope, model) = (whole.scope(), whole.model());
        let mut outcomes = OutcomeColumns::unknown(whole.machine(), scope, so_far.len());
        let mut reasons = so_far.to_vec();
        for (rows, set) in self.spans_within(first..first + so_far.len()) {
            let Some(set) = set else {
                for reasons in &mut reasons[rows] {
                    reasons.add(Reason::SupportsUnknown);
                }
                continue;
            };
            let of_set = evaluate_rows(&set.machine, states, rows.clone(), scope, model);
            for (row, reasons) in reasons[rows.clone()].iter_mut().enumerate() {
                *reasons = of_set.reasons(row, *reasons);
            }
            mark_contradictions(
                &set.machine,
                states,
                rows.start,
                &of_set,
                &mut reasons[rows.clone()],
            );
            outcomes.write(rows.start, &of_set, &set.places);
        }
        (outcomes, reasons)
    }

    /// The spans of some rows of the table: their rows, counted from the first of them, and their sets; `None` where
    /// these are unknown.
    pub(crate) fn spans_within(
        &self,
        all: Range<usize>,
    ) -> impl Iterator<Item = (Range<usize>, Option<&SupportSet>)> {
        let begin = self
            .spans
            .partition_point(|(rows, _)| rows.end <= all.start);
        let within = self.spans[begin..].iter();
        let within = within.take_while(move |(rows, _)| rows.start < all.end);
        within.map(move |(rows, set)| {
            let rows = rows.start.max(all.start) - all.start..rows.end.min(all.end) - all.start;
            (rows, set.map(|set| &self.sets[set]))
        })
    }
}

/// Marks the rows in which the measured load of a support contradicts equilibrium. One that is reported as set while it measures
/// no load may not stand on the ground; one that carries another load than computed leaves the row doubted.
fn mark_contradictions(
    machine: &Machine,
    states: &StateColumns,
    first: usize,
    outcomes: &OutcomeColumns,
    reasons: &mut [Reasons],
) {
    let mut state = State::zero(machine);
    for (index, joint) in machine.contact().actuated_joints.iter().enumerate() {
        let ForceSource::Support {
            wheel: Some(wheel), ..
        } = joint.source
        else {
            continue;
        };
        let has = |quantity: Quantity| outcomes.quantities.contains(&quantity);
        if !has(Quantity::TorqueResidual(index)) || !has(Quantity::LoadSigma(wheel)) {
            continue;
        }
        let residual = outcomes.column(Quantity::TorqueResidual(index));
        let load_sigma = outcomes.column(Quantity::LoadSigma(wheel));
        for (row, reasons) in reasons.iter_mut().enumerate() {
            if residual[row].abs() <= CONTRADICTS_SIGMAS * joint.force_sigma {
                continue;
            }
            states.get(first + row, &mut state);
            // measured loads contradict the computed ones in this time, and here they are missing
            if state.follows_supports > 0.0 && state.actuator_force[index].is_nan() {
                reasons.add(Reason::Contradiction);
            }
            let friction = joint.friction_share * state.actuator_force[index];
            let of_load = if load_sigma[row].is_finite() {
                load_sigma[row]
            } else {
                0.0
            };
            let sigma = joint.force_sigma.hypot(friction).hypot(of_load);
            if residual[row].abs() > CONTRADICTS_SIGMAS * sigma {
                let carries = state.actuator_force[index] > CONTRADICTS_SIGMAS * joint.force_sigma;
                reasons.add(match carries {
                    true => Reason::Contradiction,
                    false => Reason::SupportsUnknown,
                });
            }
        }
    }
}
