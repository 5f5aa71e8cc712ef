//! The rows at which measured and computed loads are compared.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use tipwatch_mechanics::machine::{LoadSensor, Machine};
use tipwatch_mechanics::{
    Scope, State, Workspace, combination_sigma, evaluate_one, self_equilibrated_loads,
};

use super::compared_row::ComparedRow;
use super::contradiction::{Contradiction, contradictions};
use super::statistics::{SensorStatistics, statistics};
use super::total::{self, TotalRow, sensors_of_all};
use crate::base::estimated::EstimatedRows;
use crate::load::MeasuredLoads;

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

/// Rows that are looked at, of `count`.
pub(crate) fn sampled_rows(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(count.div_ceil(MOST_ROWS).max(1))
}

/// What is compared.
pub(crate) struct Comparison<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) rows: &'a EstimatedRows,
    pub(crate) measured: &'a MeasuredLoads,
}

impl Comparison<'_> {
    /// Compares the valid rows.
    pub(crate) fn compare(&self) -> LoadComparison {
        if self.measured.is_empty() {
            return LoadComparison::default();
        }
        let mut states: Vec<(usize, State<f64>)> = Vec::new();
        for row in sampled_rows(self.rows.len()).filter(|&row| self.rows.is_valid(row)) {
            let mut state = State::zero(self.machine);
            self.rows.state(row, &mut state);
            states.push((row, state));
        }
        let sensors: Vec<&LoadSensor> = self.measured.sensors.iter().map(|m| &m.sensor).collect();
        let all = sensors_of_all(&sensors, self.machine.wheels().len());
        let compared = states
            .par_iter()
            .map(|(row, state)| self.row(*row, state, all.as_deref()));
        let (compared, totals): (Vec<Option<ComparedRow>>, Vec<Option<TotalRow>>) =
            compared.unzip();
        let lifted = compared.iter().filter(|row| row.is_none()).count();
        let rows: Vec<ComparedRow> = compared.into_iter().flatten().collect();
        let totals: Vec<TotalRow> = totals.into_iter().flatten().collect();
        let mut contradictions = contradictions(&sensors, &rows);
        contradictions.extend(total::contradictions(&totals));
        LoadComparison {
            sensors: statistics(&sensors, &rows),
            contradictions,
            rows,
            lifted,
        }
    }

    /// A row, `None` if a wheel is off the ground, where the band of its load is that of its lift-off; and its total, if the
    /// sensors in `all` carry every wheel.
    fn row(
        &self,
        row: usize,
        state: &State<f64>,
        all: Option<&[usize]>,
    ) -> (Option<ComparedRow>, Option<TotalRow>) {
        let machine = self.machine;
        let scope = Scope {
            sensitivities: true,
            ..Scope::LOADS
        };
        let mut workspace = Workspace::with_scope(machine, scope);
        let loads = evaluate_one(machine, state, &mut workspace).load.clone();
        let time_ns = self.rows.times_ns[row];
        let sensors = &self.measured.sensors;
        let total = all.map(|all| {
            let measured: f64 = all.iter().map(|&k| self.measured.at(k, time_ns)).sum();
            let of_sensors: f64 = all.iter().map(|&k| sensors[k].sensor.sigma.powi(2)).sum();
            let computed = combination_sigma(machine, state, &workspace, &vec![1.0; loads.len()]);
            TotalRow {
                time_ns,
                difference: measured - loads.iter().sum::<f64>(),
                sigma: of_sensors.sqrt().hypot(computed),
            }
        });
        let total = total.filter(|total| total.difference.is_finite());
        if !loads.iter().all(|load| *load > 0.0) {
            return (None, total);
        }
        let factors: Vec<Vec<f64>> = sensors
            .iter()
            .map(|m| m.sensor.factors(loads.len()))
            .collect();
        let sigma_of = |factors: &[f64]| combination_sigma(machine, state, &workspace, factors);
        let mut found = ComparedRow {
            row,
            time_ns,
            measured: (0..sensors.len())
                .map(|k| self.measured.at(k, time_ns))
                .collect(),
            computed: sensors.iter().map(|m| m.sensor.of(&loads)).collect(),
            sigma: factors.iter().map(|factors| sigma_of(factors)).collect(),
            distance: f64::NAN,
            sensors: 0,
        };
        let known: Vec<usize> = (0..sensors.len())
            .filter(|&k| found.measured[k].is_finite() && found.sigma[k].is_finite())
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
        (Some(found), total)
    }
}
