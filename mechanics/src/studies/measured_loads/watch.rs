//! Contradictions between measured and computed loads, by the rows so far.

use super::compare::{compare, measures_supports};
use super::rows::{ComparedRow, MeasuredRow, RowPlace};
use super::run::Run;
use super::total::exchanged;
use super::total_row::TotalRow;
use super::unstated::UnstatedLoad;
use crate::estimation::Estimate;
use crate::estimation::support_configuration::GroundSet;
use crate::machine::{LoadSensor, Machine};
use crate::state::Reason;

/// Shortest time between two compared rows (ns): errors of one machine are much the same in all rows of a second.
pub(in crate::studies) const PERIOD_NS: i64 = 250_000_000;
/// Rows in the mean of a contradiction: somewhat more than the shortest one.
const ROWS: usize = 12;

/// Doubt about the computed loads because of measured loads.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoadDoubt {
    /// The load sensor that is furthest off, by its index in [`Machine::load_sensors`]: the loads of single sensors contradict the
    /// computed ones.
    pub sensor: Option<usize>,
    /// Whether the total of the measured loads contradicts the weight, or their moments those of the computed loads.
    pub is_total: bool,
    /// The load that would explain the total.
    pub unstated: Option<UnstatedLoad>,
    /// The supports whose sensors would explain the total if they were exchanged, by their places among those on the ground.
    pub exchanged: Option<[usize; 2]>,
}

impl LoadDoubt {
    /// Whether nothing is contradicted.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.sensor.is_none() && !self.is_total
    }
}

/// Follows the measured loads of one machine by past rows only. A contradiction stands from two seconds of rows that are off on
/// end until a row is not, or the machine stands on other supports. It never changes a computed load.
///
/// Comparing a row, four times a second, allocates; the other rows do not.
#[derive(Debug)]
pub struct LoadWatch {
    /// The machine on its last supports on the ground; `None` before, and for a machine that is always on the same ones.
    on: Option<(GroundSet, Option<Machine>)>,
    compared_ns: Option<i64>,
    singles: Run<ComparedRow>,
    totals: Run<TotalRow>,
    doubt: LoadDoubt,
}

impl LoadWatch {
    /// A watch that has seen nothing; `None` for a machine whose loads are not measured.
    #[must_use]
    pub fn new(machine: &Machine) -> Option<Self> {
        let is_measured = !machine.load_sensors().is_empty() || measures_supports(machine);
        is_measured.then(|| Self {
            on: None,
            compared_ns: None,
            singles: Run::new(ROWS),
            totals: Run::new(ROWS),
            doubt: LoadDoubt::default(),
        })
    }

    /// Returns the doubt after the last row.
    #[must_use]
    pub fn doubt(&self) -> &LoadDoubt {
        &self.doubt
    }

    /// Takes the next row; one beside a contradiction is doubted from here on.
    pub fn row(&mut self, machine: &Machine, estimate: &mut Estimate) {
        self.compare(machine, estimate);
        if !self.doubt.is_none() {
            estimate.reasons.add(Reason::Contradiction);
        }
    }

    fn compare(&mut self, machine: &Machine, estimate: &Estimate) {
        let time_ns = estimate.time_ns;
        let is_due = (self.compared_ns)
            .is_none_or(|before_ns| time_ns.saturating_sub(before_ns) >= PERIOD_NS);
        if !is_due || !estimate.reasons.leave_valid() || !self.follow(machine, estimate) {
            return;
        }
        self.compared_ns = Some(time_ns);
        let machine = self
            .on
            .as_ref()
            .and_then(|(_, on)| on.as_ref())
            .unwrap_or(machine);
        let sensors: Vec<&LoadSensor> = machine.load_sensors().iter().collect();
        let measured = MeasuredRow {
            sensors: &sensors,
            loads: &estimate.measured_loads,
            held: &|_| f64::NAN,
            unobserved: &|_| 0.0,
        };
        let place = RowPlace {
            row: 0,
            time_ns,
            set: None,
        };
        let (single, total) = compare(machine, &estimate.state, &measured, place);
        // rows without a number say nothing and end nothing
        if let Some((row, is_off)) = single.and_then(|row| row.is_off().map(|off| (row, off))) {
            self.singles.take(time_ns, is_off, row);
            let lasting = self.singles.lasting();
            self.doubt.sensor = lasting.map(|rows| ComparedRow::furthest_off(&rows, &sensors).0);
        }
        if let Some((row, is_off)) = total.and_then(|row| row.is_off().map(|off| (row, off))) {
            self.totals.take(time_ns, is_off, row);
            let lasting = self.totals.lasting();
            let pair = lasting.as_deref().and_then(exchanged);
            self.doubt.is_total = lasting.is_some();
            self.doubt.unstated =
                (lasting.as_deref()).and_then(|rows| UnstatedLoad::of(rows, pair.is_some()));
            self.doubt.exchanged = pair;
        }
    }

    /// Follows the supports on the ground; false while they are unknown, or if the machine cannot stand on them.
    fn follow(&mut self, machine: &Machine, estimate: &Estimate) -> bool {
        let set = match estimate.stands_on {
            None => return true,
            Some(Err(_)) => return false,
            Some(Ok(set)) => set,
        };
        if self.on.as_ref().is_none_or(|(on, _)| *on != set) {
            let on = machine.standing_on(&set.list(machine.supports())).ok();
            self.on = Some((set, on));
            self.singles.clear();
            self.totals.clear();
            self.doubt = LoadDoubt::default();
        }
        self.on.as_ref().is_some_and(|(_, on)| on.is_some())
    }
}
