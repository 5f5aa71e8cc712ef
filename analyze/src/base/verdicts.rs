//! Judges rows in order, with the same judge as live.

use std::collections::BTreeMap;

use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::{Commissioned, Machine, Proofs, SessionProofs, SupportId};
use tipwatch_mechanics::prediction::{PacedPredictor, Prediction};
use tipwatch_mechanics::studies::needed_proofs::NeededProofs;
use tipwatch_mechanics::verdict::{
    Conditions, Judge, Latch, Level, LiftOff, LiftOffForecast, RowFacts,
};
use tipwatch_mechanics::{Quantity, State};

use super::predicted::Predictions;
use super::rows::{Rows, Verdicts, last_until};
use super::support_sets::SupportSets;

/// Record of a monitor in the log, and the state with which its session began.
#[derive(Debug, Clone, Default)]
pub(crate) struct MonitorRecord {
    /// Input faults, and whether the alarm was acknowledged, by time of the row.
    pub(crate) conditions: BTreeMap<i64, (Conditions, bool)>,
    /// The latched alarm with which the session began.
    pub(crate) inherited: Latch,
    /// Whether the sensors were contradicted in a session before: all rows are doubted.
    pub(crate) is_contradicted: bool,
    /// Times of rows in which signals are doubted since they failed visibly in a session before (ns).
    pub(crate) doubted_rows: Vec<i64>,
}

/// Proofs on which the verdicts of a log rest.
#[derive(Debug, Clone)]
pub(crate) struct ProofRecord {
    /// Proofs that the loads need.
    pub(crate) needed: NeededProofs,
    /// Proofs by a commissioning.
    pub(crate) commissioned: Commissioned,
    /// Proofs by the signals of the session, from the row at each time (ns) on, in order.
    pub(crate) shown: Vec<(i64, SessionProofs)>,
}

impl Default for ProofRecord {
    fn default() -> Self {
        Self {
            needed: NeededProofs::ALL,
            commissioned: Commissioned::NONE,
            shown: Vec::new(),
        }
    }
}

impl ProofRecord {
    /// What the signals of the whole log show.
    pub(super) fn shown_at_end(&self) -> SessionProofs {
        let shown = self.shown.last();
        shown.map_or(SessionProofs::NONE, |(_, shown)| *shown)
    }

    /// What a commissioning or the motion of the whole log has proven, and nothing disputes.
    pub(super) fn proven(&self) -> Proofs {
        let shown = self.shown_at_end();
        let proven = self.commissioned.proofs().with(shown.proven);
        proven.without(shown.disputed)
    }

    /// Returns the needed proofs that are missing in the row at this time, with the joints there. `on` is the set of supports that
    /// come and go, where it is known.
    fn unproven_at(
        &self,
        time_ns: i64,
        joints: &[Motion<f64>],
        on: Option<&[SupportId]>,
    ) -> Proofs {
        let shown = last_until(&self.shown, time_ns);
        let shown = shown.map_or(SessionProofs::NONE, |(_, shown)| *shown);
        shown.unproven(self.needed.on(on), self.commissioned.at(joints))
    }
}

/// Judges the rows of a log, block by block.
#[derive(Debug)]
pub(crate) struct RowJudge<'a> {
    machine: &'a Machine,
    record: &'a MonitorRecord,
    /// Times in which the platform rotates about an edge (ns).
    rotating: &'a [[i64; 2]],
    proofs: &'a ProofRecord,
    judge: Judge,
    forecast: LiftOffForecast,
    state: State<f64>,
    otf: Vec<f64>,
    /// The sets of supports, if they come and go.
    supports: Option<&'a SupportSets>,
    /// The set of the forecast.
    set: Option<usize>,
    ahead: Option<RowPredictor<'a>>,
}

/// Predicts row by row.
#[derive(Debug)]
struct RowPredictor<'a> {
    machine: &'a Machine,
    /// Commanded rates of the joints, from the row at each time (ns) on.
    commands: &'a [(i64, Vec<f64>)],
    predictor: PacedPredictor,
    state: State<f64>,
}

impl<'a> RowPredictor<'a> {
    fn new(machine: &'a Machine, commands: &'a [(i64, Vec<f64>)]) -> Self {
        Self {
            machine,
            commands,
            predictor: PacedPredictor::new(machine),
            state: State::zero(machine),
        }
    }

    /// The prediction of a row of `rows`, whose level is known.
    fn predict(&mut self, rows: &Rows, row: usize, level: Level) -> &Prediction {
        rows.states.get(row, &mut self.state);
        let (time_ns, reasons) = (rows.times_ns[row], rows.reasons[row]);
        if let Some((_, commands)) = last_until(self.commands, time_ns) {
            self.predictor.set_commands(commands);
        }
        (self.predictor).row(self.machine, time_ns, &self.state, reasons, level)
    }
}

impl<'a> RowJudge<'a> {
    /// A judge before the first row.
    pub(crate) fn new(
        machine: &'a Machine,
        record: &'a MonitorRecord,
        rotating: &'a [[i64; 2]],
        proofs: &'a ProofRecord,
        supports: Option<&'a SupportSets>,
    ) -> Self {
        let mut judge = Judge::new(machine.limits());
        judge.resume(record.inherited);
        Self {
            machine,
            record,
            rotating,
            proofs,
            judge,
            forecast: LiftOffForecast::new(machine),
            state: State::zero(machine),
            otf: vec![f64::NAN; machine.wheels().len()],
            supports,
            set: None,
            ahead: None,
        }
    }

    /// Adds predictions: for states that know nothing of later samples.
    pub(crate) fn predicting(mut self, commands: &'a [(i64, Vec<f64>)]) -> Self {
        self.ahead = Some(RowPredictor::new(self.machine, commands));
        self
    }

    /// The forecast begins anew on other supports.
    fn follow_supports(&mut self, row: usize) {
        let Some(supports) = self.supports else {
            return;
        };
        if let Some(index) = supports.index_of_row(row)
            && self.set.replace(index) != Some(index)
        {
            self.forecast = LiftOffForecast::new(&supports.sets[index].machine);
        }
    }

    /// The next wheel to lift, by the OTF of a row of the log with meaningful loads.
    fn forecast(&mut self, row: usize, time_ns: i64) -> Option<LiftOff> {
        let Some(supports) = self.supports else {
            return self.forecast.row(self.machine, time_ns, &self.otf);
        };
        let machine = &supports.sets[supports.index_of_row(row)?].machine;
        let of_set: Vec<f64> = (machine.stands_on().iter())
            .map(|support| self.otf[support.index()])
            .collect();
        self.forecast.row(machine, time_ns, &of_set)
    }

    /// Verdicts of the next rows.
    pub(crate) fn judge(&mut self, rows: &Rows) -> Verdicts {
        let wheels = 0..self.otf.len();
        let otf_columns: Vec<&[f64]> = wheels
            .map(|wheel| rows.outcomes.column(Quantity::Otf(wheel)))
            .collect();
        let utilisation = rows.outcomes.column(Quantity::Utilisation);
        let recorded = &self.record.conditions;
        let mut all = Verdicts {
            verdicts: Vec::with_capacity(rows.len()),
            time_to_lift_off_s: Vec::with_capacity(rows.len()),
            predictions: (self.ahead.as_ref()).map(|_| Predictions::none(self.otf.len())),
            recorded: Vec::new(),
        };
        for row in 0..rows.len() {
            let (time_ns, reasons) = (rows.times_ns[row], rows.reasons[row]);
            let (conditions, is_acknowledged) = recorded.get(&time_ns).copied().unwrap_or_default();
            for (otf, column) in self.otf.iter_mut().zip(&otf_columns) {
                *otf = column[row];
            }
            rows.states.get(row, &mut self.state);
            let on = (self.supports).and_then(|supports| supports.of_row(rows.first + row));
            let on = on.map(|set| set.machine.stands_on());
            let verdict = self.judge.row(&RowFacts {
                time_ns,
                reasons,
                utilisation: utilisation[row],
                is_wheel_unloaded: self.otf.iter().any(|otf| *otf <= 0.0),
                rotates: (self.rotating.iter())
                    .any(|[first, last]| (*first..=*last).contains(&time_ns)),
                takes_support: (self.supports)
                    .is_some_and(|supports| supports.is_taken(rows.first + row)),
                unproven: self.proofs.unproven_at(time_ns, &self.state.joints, on),
                conditions,
                is_acknowledged,
            });
            all.verdicts.push(verdict);
            self.follow_supports(rows.first + row);
            let next = (reasons.leave_loads())
                .then(|| self.forecast(rows.first + row, time_ns))
                .flatten()
                .filter(|_| verdict.level.announces_lift_off());
            all.time_to_lift_off_s
                .push(next.map_or(f64::NAN, |next| next.in_s));
            if let (Some(ahead), Some(predictions)) = (&mut self.ahead, &mut all.predictions) {
                predictions.push(ahead.predict(rows, row, verdict.level));
            }
            if !recorded.is_empty() {
                all.recorded.push(conditions);
            }
        }
        all
    }
}
