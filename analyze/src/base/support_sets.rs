//! The machine on each set of supports, and the set of each row.

use std::ops::Range;

use tipwatch_mechanics::estimation::support_configuration::doubts_by_measured_loads;
use tipwatch_mechanics::machine::{ActuatedJoint, Machine};
use tipwatch_mechanics::state::{Reason, Reasons};
use tipwatch_mechanics::{
    BatchEvaluator, ColumnNames, OutcomeColumns, Quantity, Scope, State, StateColumns,
    evaluate_rows,
};

/// A machine on different supports in the course of a log.
#[derive(Debug, Clone)]
pub(crate) struct SupportSets {
    /// The sets.
    pub(crate) sets: Vec<SupportSet>,
    /// Rows without gaps, in order, each with the index of its set; `None` where the set is unknown.
    pub(crate) spans: Vec<(Range<usize>, Option<usize>)>,
    /// Rows of a transition in which supports that were in the air take the weight, and none of those before alone has left the ground, as
    /// past samples tell.
    pub(crate) taken: Vec<Range<usize>>,
    /// Whether the loads of supports were measured: then the loads of a supposition contradict no measurement.
    pub(crate) are_measured: bool,
}

/// A machine on one set of supports.
#[derive(Debug, Clone)]
pub(crate) struct SupportSet {
    /// The machine.
    pub(crate) machine: Machine,
    /// Column of the table for each of its quantities.
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

    /// Whether supports take the weight in a row that were in the air before.
    pub(crate) fn is_taken(&self, row: usize) -> bool {
        self.taken.iter().any(|rows| rows.contains(&row))
    }

    /// The set of a row; `None` where it is unknown.
    pub(crate) fn of_row(&self, row: usize) -> Option<&SupportSet> {
        self.index_of_row(row).map(|set| &self.sets[set])
    }

    /// Whether loads of the supports of a set were measured.
    pub(crate) fn have_loads_of(&self, set: &SupportSet) -> bool {
        let measures = |joint: &ActuatedJoint| joint.support_place().is_some();
        let mut joints = set.machine.contact().actuated_joints.iter();
        self.are_measured && joints.any(measures)
    }

    /// Outcomes of some rows of the table, which begin at row `first`, and their reasons, without those by measured loads.
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
            let Some(set) = set.map(|set| &self.sets[set]) else {
                for reasons in &mut reasons[rows] {
                    reasons.add(Reason::SupportsUnknown);
                }
                continue;
            };
            let of_set = evaluate_rows(&set.machine, states, rows.clone(), scope, model);
            for (row, reasons) in reasons[rows.clone()].iter_mut().enumerate() {
                *reasons = of_set.reasons(row, *reasons);
            }
            outcomes.write(rows.start, &of_set, &set.places);
        }
        (outcomes, reasons)
    }

    /// The spans of some rows of the table: their rows, counted from the first of them, and the indices of their sets; `None`
    /// where these are unknown.
    pub(crate) fn spans_within(
        &self,
        all: Range<usize>,
    ) -> impl Iterator<Item = (Range<usize>, Option<usize>)> {
        let begin = self
            .spans
            .partition_point(|(rows, _)| rows.end <= all.start);
        let within = self.spans[begin..].iter();
        let within = within.take_while(move |(rows, _)| rows.start < all.end);
        within.map(move |(rows, set)| {
            let rows = rows.start.max(all.start) - all.start..rows.end.min(all.end) - all.start;
            (rows, *set)
        })
    }
}

/// Marks the rows in which the measured load of a support contradicts equilibrium.
pub(super) fn mark_contradictions(
    machine: &Machine,
    states: &StateColumns,
    outcomes: &OutcomeColumns,
    reasons: &mut [Reasons],
) {
    let mut state = State::zero(machine);
    let joints = 0..machine.contact().actuated_joints.len();
    let residuals: Vec<_> = joints
        .map(|joint| outcomes.known_column(Quantity::TorqueResidual(joint)))
        .collect();
    let wheels = 0..machine.wheels().len();
    let sigmas: Vec<_> = wheels
        .map(|wheel| outcomes.known_column(Quantity::LoadSigma(wheel)))
        .collect();
    for (row, reasons) in reasons.iter_mut().enumerate() {
        states.get(row, &mut state);
        reasons.add_all(doubts_by_measured_loads(
            machine,
            &state,
            |joint| residuals[joint].map(|column| column[row]),
            |wheel| sigmas[wheel].map(|column| column[row]),
        ));
    }
}
