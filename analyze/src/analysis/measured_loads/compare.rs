//! The rows at which measured and computed loads are compared.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use tipwatch_mechanics::machine::{ForceSource, LoadSensor, Machine};
use tipwatch_mechanics::{
    Scope, State, Workspace, combination_sigma, evaluate_one, self_equilibrated_loads,
};

use super::super::quasi_static::StaticRows;
use super::compared_row::ComparedRow;
use super::contradiction::{Contradiction, contradictions};
use super::singles::Singles;
use super::statistics::{SensorStatistics, statistics};
use super::total::{self, sensors_of_all};
use super::total_row::TotalRow;
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
    /// Where measured and computed loads contradict each other.
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

/// Rows that are looked at, of `count`.
pub(crate) fn sampled_rows(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(count.div_ceil(MOST_ROWS).max(1))
}

/// Whether the load of a support is measured by its jack.
pub(crate) fn measures_supports(machine: &Machine) -> bool {
    let joints = machine.contact().actuated_joints.iter();
    joints
        .map(|joint| &joint.source)
        .any(|source| matches!(source, ForceSource::Support { .. }))
}

/// What is compared.
pub(crate) struct Comparison<'a> {
    pub(crate) standing: &'a Standing<'a>,
    pub(crate) rows: &'a EstimatedRows,
    pub(crate) measured: &'a MeasuredLoads,
    /// What motion that was not observed can have done at static rows.
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
        let mut contradictions = contradictions(&sensors, &rows);
        contradictions.extend(total::contradictions(&totals, self.standing));
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
        of_sensors: &[&LoadSensor],
    ) -> Option<(Option<ComparedRow>, Option<TotalRow>)> {
        let time_ns = self.rows.times_ns[row];
        let machine = self.standing.at(time_ns)?;
        let all = sensors_of_all(of_sensors, machine);
        let scope = Scope {
            sensitivities: true,
            ..Scope::LOADS
        };
        let mut workspace = Workspace::with_scope(machine, scope);
        let loads = evaluate_one(machine, state, &mut workspace).load.clone();
        let sensors = &self.measured.sensors;
        let unobserved = (self.motion).and_then(|motion| motion.loads(machine, state, time_ns));
        let sigma_of = |factors: &[f64]| {
            let by_motion = (unobserved.as_ref()).map_or(0.0, |motion| motion.sigma(factors));
            combination_sigma(machine, state, &workspace, factors).hypot(by_motion)
        };
        let singles = Singles::of(machine, state, self.measured, time_ns);
        let of_sensors = all.map(|all| {
            let measured: f64 = all.iter().map(|&k| self.measured.at(k, time_ns)).sum();
            let variance: f64 = all.iter().map(|&k| sensors[k].sensor.sigma.powi(2)).sum();
            (measured, variance.sqrt())
        });
        let measured = of_sensors.filter(|(total, _)| total.is_finite());
        let measured = measured.or_else(|| singles.as_ref().map(Singles::total));
        let total = measured.map(|(measured, of_sensors)| TotalRow {
            time_ns,
            set: self.standing.set_at(time_ns),
            difference: measured - loads.iter().sum::<f64>(),
            sigma: of_sensors.hypot(sigma_of(&vec![1.0; loads.len()])),
            gravity: loads.iter().sum::<f64>() / machine.mass(),
            acts: (singles.as_ref()).map(|all| all.acts(machine, &workspace, sigma_of)),
        });
        let total = total.filter(|total| total.difference.is_finite());
        if sensors.is_empty() || !loads.iter().all(|load| *load > 0.0) {
            return Some((None, total));
        }
        let factors: Vec<Vec<f64>> = sensors.iter().map(|m| m.sensor.factors(machine)).collect();
        let mut found = ComparedRow {
            row,
            time_ns,
            set: self.standing.set_at(time_ns),
            measured: (0..sensors.len())
                .map(|k| self.measured.at(k, time_ns))
                .collect(),
            computed: (sensors.iter())
                .map(|m| m.sensor.of(machine, &loads).unwrap_or(f64::NAN))
                .collect(),
            sigma: factors.iter().map(|factors| sigma_of(factors)).collect(),
            distance: f64::NAN,
            sensors: 0,
        };
        let known: Vec<usize> = (0..sensors.len())
            .filter(|&k| (found.measured[k] - found.computed[k] + found.sigma[k]).is_finite())
            .collect();
        found.sensors = known.len();
        let residual = known.iter().map(|&k| found.measured[k] - found.computed[k]);
        let residual = DVector::from_iterator(known.len(), residual);
        // cov(a, b) = (var(a + b) - var(a) - var(b)) / 2
        let mut covariance = DMatrix::from_fn(known.len(), known.len(), |i, j| {
            let (a, b) = (known[i], known[j]);
            if i == j {
                return found.sigma[a].powi(2) + sensors[a].sensor.sigma.powi(2);
            }
            let both: Vec<f64> = factors[a]
                .iter()
                .zip(&factors[b])
                .map(|(a, b)| a + b)
                .collect();
            let apart = found.sigma[a].powi(2) + found.sigma[b].powi(2);
            0.5 * (sigma_of(&both).powi(2) - apart)
        });
        // What uneven ground shifts between the diagonals contradicts nothing.
        let warp = machine.warp_sigma() * (loads.len() as f64).sqrt();
        for direction in self_equilibrated_loads(&workspace) {
            let shown = known.iter().map(|&k| {
                let pairs = factors[k].iter().zip(&direction);
                pairs.map(|(factor, z)| factor * z).sum::<f64>() * warp
            });
            let shown = DVector::from_iterator(known.len(), shown);
            covariance += &shown * shown.transpose();
        }
        if let Some(root) = covariance.cholesky() {
            found.distance = residual.dot(&root.solve(&residual));
        }
        Some((Some(found), total))
    }
}
