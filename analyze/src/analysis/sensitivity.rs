//! Sensitivity of each wheel load to each signal and parameter: at its worst instant and over the log.

use std::cmp::Ordering;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{
    Model, Parameter, Quantity, Scope, SensitivitySums, State, Workspace, evaluate,
};

use super::standing_rows::StandingRows;
use super::study::{Block, StudiedLog, Study};
use crate::base::rows::Rows;

/// Most parameters in the summary.
const NAMED_PARAMETERS: usize = 10;

/// The wheel that came closest to lift-off, of the rows with derivatives where there are any, and the sensitivity of its load.
/// Beside it one row for each parameter and wheel.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "SensitivitySummary")]
pub struct SensitivityTable {
    /// Name of that wheel, in lower case.
    pub wheel: String,
    /// When its OTF was smallest, of the rows with derivatives where there are any (ns).
    pub worst_ns: i64,
    /// That OTF (N); one without derivatives can be smaller.
    pub worst_otf_n: f64,
    /// The parameters with the largest share of the variance, largest first.
    pub parameters: Vec<SensitivityRow>,
    /// Rows: all parameters of the first wheel, then of the next.
    #[serde(skip)]
    pub rows: Vec<SensitivityRow>,
    /// The wheel with the smallest OTF, of the rows with derivatives if it has any, as a share of its static load.
    #[serde(skip)]
    pub worst_wheel: usize,
    /// Smallest OTF of that wheel, as a share of its static load.
    #[serde(skip)]
    pub worst_share: f64,
}

/// Derivatives of one wheel load with respect to one signal or parameter.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "ParameterSummary")]
pub struct SensitivityRow {
    /// The signal or parameter.
    #[serde(skip)]
    pub parameter: Parameter,
    /// Name of the signal or parameter.
    #[serde(rename = "parameter")]
    pub name: String,
    /// Unit of the signal or parameter.
    pub unit: &'static str,
    /// Index of the wheel among those of the machine that names the results.
    #[serde(skip)]
    pub wheel: usize,
    /// Nominal value; for a signal, its value at the worst instant.
    pub nominal: Option<f64>,
    /// Stated standard deviation; for a signal, that of its constant error.
    pub sigma: f64,
    /// dOTF/dparameter at the wheel's worst instant (N per unit of the parameter).
    #[serde(rename = "derivative_n_per_unit")]
    pub derivative: f64,
    /// Root mean square of that derivative over the log (N per unit of the parameter); NaN if supports come and go.
    #[serde(skip)]
    pub rms: f64,
    /// Change that would bring the wheel's OTF to zero at its worst instant; `None` if the parameter has
    /// no effect.
    pub change_to_zero: Option<f64>,
    /// The parameter's share of the OTF variance at that instant; of parameters that were identified together it contains
    /// their correlations, and can be negative.
    pub variance_share: f64,
    /// The worst instant (ns): of the valid rows with derivatives, the one with the smallest OTF of the wheel. A smaller OTF in a
    /// row without derivatives counts only where the wheel has none with them.
    #[serde(skip)]
    pub worst_ns: i64,
    /// OTF at that instant (N).
    #[serde(skip)]
    pub worst_otf_n: f64,
}

impl SensitivityTable {
    /// The signals and parameters of the worst wheel by how far they move its load, the farthest first: by their share of its
    /// variance. Those whose effect cannot be computed are left out.
    #[must_use]
    pub fn ranked(&self) -> Vec<&SensitivityRow> {
        ranked(&self.rows, self.worst_wheel)
    }

    /// The share of the variance of the worst wheel's load that no parameter explains: that of the errors of the samples themselves.
    #[must_use]
    pub fn share_of_samples(&self) -> f64 {
        let explained: f64 = self.ranked().iter().map(|row| row.variance_share).sum();
        (1.0 - explained).max(0.0)
    }
}

fn ranked(rows: &[SensitivityRow], wheel: usize) -> Vec<&SensitivityRow> {
    let is_known =
        |row: &&SensitivityRow| row.derivative.is_finite() && row.variance_share.is_finite();
    let rows = rows.iter().filter(|row| row.wheel == wheel);
    let mut ranked: Vec<_> = rows.filter(is_known).collect();
    ranked.sort_by(|a, b| b.variance_share.total_cmp(&a.variance_share));
    ranked
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

/// Derivatives on each set of supports; none for models without them.
pub(super) struct SensitivityStudy(Vec<SensitivityPass>);

impl Study<'_> for SensitivityStudy {
    type Found = Vec<SensitivityPass>;

    fn begin(log: &StudiedLog<'_>) -> Self {
        let standing = log.standing.iter().filter(|_| log.scope.sensitivities);
        Self(
            standing
                .map(|it| SensitivityPass::new(it.machine))
                .collect(),
        )
    }

    fn take(&mut self, block: &Block<'_>) {
        for (place, _, rows) in block.parts.iter().filter_map(|part| part.standing.as_ref()) {
            if let Some(pass) = self.0.get_mut(*place) {
                pass.take(rows);
            }
        }
    }
}

impl From<SensitivityStudy> for Vec<SensitivityPass> {
    fn from(SensitivityStudy(passes): SensitivityStudy) -> Self {
        passes
    }
}

impl SensitivityPass {
    fn new(machine: &Machine) -> Self {
        Self {
            sums: SensitivitySums::none(machine),
            worst: vec![None; machine.wheels().len()],
        }
    }

    /// Takes the next rows.
    fn take(&mut self, rows: &Rows) {
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

    /// The table of a log, with the names of this machine; `None` if no row is valid.
    pub(crate) fn table(
        &self,
        standing: &StandingRows<'_>,
        named: &Machine,
    ) -> Option<SensitivityTable> {
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
                    name: parameter.name(named),
                    unit: parameter.unit(named),
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
        let worst_wheel = standing.named_wheel(worst.0);
        let parameters = ranked(&table, worst_wheel).into_iter().cloned();
        let parameters: Vec<_> = parameters.take(NAMED_PARAMETERS).collect();
        let first = parameters.first();
        Some(SensitivityTable {
            wheel: named.wheels()[worst_wheel].name.to_lowercase(),
            worst_ns: first.map_or(0, |first| first.worst_ns),
            worst_otf_n: first.map_or(f64::NAN, |first| first.worst_otf_n),
            parameters,
            rows: table,
            worst_wheel,
            worst_share: worst.1,
        })
    }
}
