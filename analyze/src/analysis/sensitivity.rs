//! Sensitivity of each wheel load to each signal and parameter: at its worst instant and over the log.

use std::cmp::Ordering;
use std::sync::Arc;

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{
    Model, Parameter, Quantity, Scope, SensitivitySums, State, Workspace, evaluate,
};

use super::standing_rows::StandingRows;
use crate::base::rows::Rows;

/// One row for each parameter and wheel.
#[derive(Debug, Clone)]
pub struct SensitivityTable {
    /// Rows: all parameters of the first wheel, then of the next.
    pub rows: Vec<SensitivityRow>,
    /// The wheel with the smallest OTF, of the rows with derivatives if it has any, as a share of its static load.
    pub worst_wheel: usize,
    /// Smallest OTF of that wheel, as a share of its static load.
    pub worst_share: f64,
}

/// Derivatives of one wheel load with respect to one signal or parameter.
#[derive(Debug, Clone)]
pub struct SensitivityRow {
    /// The signal or parameter.
    pub parameter: Parameter,
    /// Index of the wheel among those of the machine that names the results.
    pub wheel: usize,
    /// Nominal value; for a signal, its value at the worst instant.
    pub nominal: Option<f64>,
    /// Stated standard deviation; for a signal, that of its constant error.
    pub sigma: f64,
    /// dOTF/dparameter at the wheel's worst instant (N per unit of the parameter).
    pub derivative: f64,
    /// Root mean square of that derivative over the log (N per unit of the parameter); NaN if supports come and go.
    pub rms: f64,
    /// Change that would bring the wheel's OTF to zero at its worst instant; `None` if the parameter has
    /// no effect.
    pub change_to_zero: Option<f64>,
    /// The parameter's share of the OTF variance at that instant; of parameters that were identified together it contains
    /// their correlations, and can be negative.
    pub variance_share: f64,
    /// The worst instant (ns): of the valid rows with derivatives, the one with the smallest OTF of the wheel. A smaller OTF in a
    /// row without derivatives counts only where the wheel has none with them.
    pub worst_ns: i64,
    /// OTF at that instant (N).
    pub worst_otf_n: f64,
}

impl SensitivityTable {
    /// The signals and parameters of the worst wheel by how far they move its load, the farthest first: by their share of its
    /// variance. Those whose effect cannot be computed are left out.
    #[must_use]
    pub fn ranked(&self) -> Vec<&SensitivityRow> {
        let rows = self.rows.iter();
        let known = rows.filter(|row| {
            row.wheel == self.worst_wheel
                && row.derivative.is_finite()
                && row.variance_share.is_finite()
        });
        let mut ranked: Vec<_> = known.collect();
        ranked.sort_by(|a, b| b.variance_share.total_cmp(&a.variance_share));
        ranked
    }

    /// The share of the variance of the worst wheel's load that no parameter explains: that of the errors of the samples themselves.
    #[must_use]
    pub fn share_of_samples(&self) -> f64 {
        let explained: f64 = self.ranked().iter().map(|row| row.variance_share).sum();
        (1.0 - explained).max(0.0)
    }
}

impl SensitivityRow {
    /// Returns the magnitude of the change of OTF at the worst instant for two standard deviations of this parameter alone (N).
    #[must_use]
    pub fn two_sigma_change_n(&self) -> f64 {
        (2.0 * self.sigma * self.derivative).abs()
    }
}

/// Sums of the derivatives over the rows, and the worst row of each wheel.
#[derive(Debug)]
pub(crate) struct SensitivityPass {
    sums: SensitivitySums,
    /// By wheel, the row with the smallest OTF among the valid ones with derivatives, else among all valid ones; whether the row
    /// is without derivatives.
    worst: Vec<Option<(usize, bool, f64)>>,
}

impl SensitivityPass {
    pub(crate) fn new(machine: &Machine) -> Self {
        Self {
            sums: SensitivitySums::none(machine),
            worst: vec![None; machine.wheels().len()],
        }
    }

    /// Takes the next rows.
    pub(crate) fn take(&mut self, rows: &Rows) {
        self.sums.add(&rows.outcomes.sensitivity);
        for (wheel, worst) in self.worst.iter_mut().enumerate() {
            let otf = rows.outcomes.column(Quantity::Otf(wheel));
            let sigma = rows.outcomes.known_column(Quantity::OtfSigma(wheel));
            for row in (0..rows.len()).filter(|&row| rows.is_valid(row)) {
                // on the way to another set of wheels on the ground the loads have no derivatives
                let lacks = !sigma.is_some_and(|sigma| sigma[row].is_finite());
                let is_less = |(_, lacked, least): (usize, bool, f64)| {
                    (lacks, otf[row]).partial_cmp(&(lacked, least)) == Some(Ordering::Less)
                };
                if worst.is_none_or(is_less) {
                    *worst = Some((rows.first + row, lacks, otf[row]));
                }
            }
        }
    }

    /// The table of a log; `None` if no row is valid.
    pub(crate) fn table(&self, standing: &StandingRows<'_>) -> Option<SensitivityTable> {
        let (machine, rows) = (standing.machine, standing.rows());
        let parameters = Parameter::all(machine);
        let mut workspace = Workspace::with_model(machine, Scope::ALL, Arc::new(Model::WholeBody));
        let mut state = State::zero(machine);
        let mut table = Vec::with_capacity(parameters.len() * machine.wheels().len());
        let mut worst = (0, f64::INFINITY);
        for wheel in 0..machine.wheels().len() {
            let (row, _, otf_n) = self.worst[wheel]?;
            let left = otf_n / machine.reference().static_load[wheel];
            if left < worst.1 {
                worst = (wheel, left);
            }
            rows.state(row, &mut state);
            let outcome = evaluate(machine, &state, &mut workspace);
            let (worst_otf_n, variance) =
                (outcome.otf[wheel], outcome.uncertainty.otf[wheel].powi(2));
            let derivatives = workspace.sensitivity().otf(wheel);
            let root_mean_squares = self.sums.root_mean_squares(wheel);
            let together = machine.identified().map_or(Vec::new(), |identified| {
                identified.variance_parts(machine, &parameters, &derivatives)
            });
            for (place, ((&parameter, derivative), rms)) in
                (parameters.iter().zip(derivatives).zip(root_mean_squares)).enumerate()
            {
                let alone = |sigma: f64| (derivative * sigma).powi(2);
                let together = together.get(place).copied().flatten();
                let sigma = state.sigma(machine, parameter);
                let change = -worst_otf_n / derivative;
                table.push(SensitivityRow {
                    parameter,
                    wheel: standing.named_wheel(wheel),
                    nominal: parameter
                        .nominal(machine)
                        .or_else(|| state.value(parameter)),
                    sigma,
                    derivative,
                    rms,
                    change_to_zero: Some(change).filter(|change| change.is_finite()),
                    variance_share: together.unwrap_or(alone(sigma)) / variance,
                    worst_ns: rows.times_ns[row],
                    worst_otf_n,
                });
            }
        }
        Some(SensitivityTable {
            rows: table,
            worst_wheel: standing.named_wheel(worst.0),
            worst_share: worst.1,
        })
    }
}
