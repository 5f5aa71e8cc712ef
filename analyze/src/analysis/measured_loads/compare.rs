//! The rows at which measured and computed loads are compared.

use rayon::prelude::*;
use tipwatch_language::say;
use tipwatch_mechanics::State;
use tipwatch_mechanics::machine::{LoadSensor, Note};
use tipwatch_mechanics::studies::measured_loads::{
    ComparedRow, MeasuredRow, RowPlace, TotalRow, compare, measures_supports,
};

use super::super::notes::{NotedLog, Notes};
use super::super::quasi_static::StaticRows;
use super::contradiction::{Contradiction, in_total, of_sensors};
use super::statistics::{SensorStatistics, statistics};
use crate::base::estimated::EstimatedRows;
use crate::events::Event;
use crate::load::{MeasuredLoads, Standing};

/// Probability that the computed loads are right where measured ones contradict them, and that of either of two supports whose
/// sensors may be exchanged.
const EITHER: f64 = 0.5;
/// Most rows that are compared; more are thinned out evenly.
const MOST_ROWS: usize = 2000;

/// The comparison of all load sensors of a log.
#[derive(Debug, Default)]
pub struct LoadComparison {
    /// The sensors, in the order of the measured loads.
    pub sensors: Vec<SensorStatistics>,
    /// The compared rows.
    pub rows: Vec<ComparedRow>,
    /// Spans in which measured and computed loads contradict each other.
    pub contradictions: Vec<Contradiction>,
    /// Rows left out because a wheel is off the ground.
    pub lifted: usize,
}

impl LoadComparison {
    /// Weighs the events of the loads where measured and computed ones contradict each other: either may be wrong. What one sensor
    /// shows of its support is in doubt only where it may be another's.
    pub(crate) fn weigh(&self, events: &mut [Event]) {
        for event in events.iter_mut().filter(|event| event.rests_on_loads()) {
            let is_doubted = |span: &Contradiction| match event.measured_load_n {
                Some(_) => {
                    let mut exchanged = span.exchanged.iter().flatten();
                    exchanged.any(|name| name.to_lowercase() == event.subject)
                }
                None => !span.is_explained(),
            };
            let mut meanwhile = (self.contradictions.iter())
                .filter(|span| event.overlaps([span.start_ns, span.end_ns]));
            if meanwhile.any(is_doubted) {
                event.doubt_by(vec!["measured loads".into()], EITHER);
            }
        }
    }
}

/// The notes on measured against computed loads.
impl Notes for LoadComparison {
    fn notes(&self, log: &NotedLog<'_>) -> Vec<Note> {
        let of_sensors = self.sensors.iter().map(|sensor| {
            let (Some(bias), Some(rms), Some(inside)) =
                (sensor.bias_n, sensor.rms_n, sensor.inside_2_sigma)
            else {
                return say!(
                    "Measured load {}: no row to compare it with the computed load.",
                    sensor.sensor
                );
            };
            say!(
                "Measured load {}: measured minus computed {bias:+.0} N in the mean, {rms:.0} N root mean square over {} \
                 rows; {:.0} % of them inside two standard deviations of both.",
                sensor.sensor,
                sensor.rows,
                100.0 * inside
            )
        });
        let seconds = |time_ns: i64| (time_ns - log.start_ns) as f64 * 1e-9;
        let of_spans = self.contradictions.iter().map(|span| {
            say!(
                "From t = {:.2} s to {:.2} s measured and computed loads contradict each other, most at {}: measured minus \
                 computed {:+.0} N, standard deviation of both together {:.0} N{}. {}.",
                seconds(span.start_ns),
                seconds(span.end_ns),
                span.sensor,
                span.difference_n,
                span.sigma_n,
                span.explanation(),
                span.consequence()
            )
        });
        of_sensors.chain(of_spans).map(Note::from).collect()
    }
}

impl Notes for MeasuredLoads {
    fn notes(&self, _: &NotedLog<'_>) -> Vec<Note> {
        self.notes.iter().cloned().map(Note::from).collect()
    }
}

/// Rows that are looked at, of `count`.
pub(crate) fn sampled_rows(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(count.div_ceil(MOST_ROWS).max(1))
}

/// Inputs of the comparison.
pub(crate) struct Comparison<'a> {
    pub(crate) standing: &'a Standing<'a>,
    pub(crate) rows: &'a EstimatedRows,
    pub(crate) measured: &'a MeasuredLoads,
    /// Motion that may have occurred unobserved at static rows.
    pub(crate) motion: Option<&'a StaticRows>,
}

impl Comparison<'_> {
    /// Compares the valid rows.
    pub(crate) fn compare(&self) -> LoadComparison {
        if self.measured.is_empty() && !measures_supports(self.standing.machine()) {
            return LoadComparison::default();
        }
        let mut states: Vec<(usize, State<f64>)> = Vec::new();
        for row in sampled_rows(self.rows.len()).filter(|&row| self.rows.is_valid(row)) {
            let mut state = State::zero(self.standing.machine());
            self.rows.state(row, &mut state);
            states.push((row, state));
        }
        let sensors: Vec<&LoadSensor> = self.measured.sensors.iter().map(|m| &m.sensor).collect();
        let compared =
            (states.par_iter()).filter_map(|(row, state)| self.row(*row, state, &sensors));
        let (compared, totals): (Vec<Option<ComparedRow>>, Vec<Option<TotalRow>>) =
            compared.unzip();
        let lifted = match self.measured.is_empty() {
            true => 0,
            false => compared.iter().filter(|row| row.is_none()).count(),
        };
        let rows: Vec<ComparedRow> = compared.into_iter().flatten().collect();
        let totals: Vec<TotalRow> = totals.into_iter().flatten().collect();
        let mut contradictions = of_sensors(&sensors, &rows);
        contradictions.extend(in_total(&totals, self.standing));
        LoadComparison {
            sensors: statistics(&sensors, &rows),
            contradictions,
            rows,
            lifted,
        }
    }

    /// A row, `None` if a wheel is off the ground, where the band of its load is that of its lift-off; and its total, if some
    /// sensors carry every support on the ground. Neither where these supports are unknown.
    fn row(
        &self,
        row: usize,
        state: &State<f64>,
        sensors: &[&LoadSensor],
    ) -> Option<(Option<ComparedRow>, Option<TotalRow>)> {
        let time_ns = self.rows.times_ns[row];
        let machine = self.standing.at(time_ns)?;
        let unobserved = (self.motion).and_then(|motion| motion.loads(machine, state, time_ns));
        let loads: Vec<f64> = (0..sensors.len())
            .map(|sensor| self.measured.at(sensor, time_ns))
            .collect();
        let measured = MeasuredRow {
            sensors,
            loads: &loads,
            held: &|joint| self.measured.held.at(joint, time_ns),
            unobserved: &|factors| {
                (unobserved.as_ref()).map_or(0.0, |motion| motion.sigma(factors))
            },
        };
        let place = RowPlace {
            row,
            time_ns,
            set: self.standing.set_at(time_ns),
        };
        Some(compare(machine, state, &measured, place))
    }
}
