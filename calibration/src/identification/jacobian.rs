//! Derivatives of the predictions with respect to the unknowns.
//!
//! Those of wheel loads in a log come from the adjoint of the mechanics, [`Sensitivity`]. Actuator forces, and a
//! machine at rest whose attitude follows from its own geometry, have no adjoint: central differences of the same
//! equations.

use std::sync::Arc;

use nalgebra::DMatrix;
use rayon::prelude::*;
use tipwatch_mechanics::machine::{Machine, Parameter, SupportId, Unknown};
use tipwatch_mechanics::{Scope, Sensitivity, Workspace, evaluate_one};

use crate::identification::data::{Instant, Measured, Situation};
use crate::identification::model::{Changed, places};

/// Step of a central difference, in prior standard deviations.
const STEP: f64 = 1e-3;

/// Conversions of derivatives with respect to parameters into those with respect to unknowns, for each set of supports.
#[derive(Debug)]
pub(crate) struct Columns {
    on_sets: Vec<(Vec<SupportId>, ColumnsOnSet)>,
}

impl Columns {
    pub(crate) fn new(changed: &Changed, unknowns: &[Unknown]) -> Self {
        let of = |machine: &Machine| {
            let columns = ColumnsOnSet::new(machine, unknowns);
            (machine.stands_on().to_vec(), columns)
        };
        Self {
            on_sets: changed.machines().map(of).collect(),
        }
    }

    fn at(&self, instant: &Instant) -> Option<&ColumnsOnSet> {
        let mut sets = self.on_sets.iter();
        let (_, columns) = sets.find(|(set, _)| **set == *instant.supports)?;
        Some(columns)
    }
}

/// Conversion for the parameters of the machine on one set of supports.
#[derive(Debug)]
struct ColumnsOnSet {
    /// For each unknown: the parameters that it changes, by index among all, and the factors.
    of: Vec<Vec<(usize, f64)>>,
}

impl ColumnsOnSet {
    fn new(machine: &Machine, unknowns: &[Unknown]) -> Self {
        let parameters = Parameter::all(machine);
        let place = |wanted| parameters.iter().position(|&parameter| parameter == wanted);
        let of = unknowns.iter().map(|unknown| {
            let changes = unknown.changes(machine, 1.0).into_iter();
            let places = changes.filter_map(|(parameter, by)| Some((place(parameter)?, by)));
            places.collect()
        });
        Self { of: of.collect() }
    }

    fn row(&self, by: &[f64], sigmas: &[f64]) -> Vec<f64> {
        let columns = self.of.iter().zip(sigmas);
        columns
            .map(|(of, sigma)| {
                of.iter()
                    .map(|&(place, factor)| by[place] * factor)
                    .sum::<f64>()
                    * sigma
            })
            .collect()
    }
}

/// Whether every reading of an instant has an adjoint.
pub(crate) fn has_adjoint(instant: &Instant) -> bool {
    matches!(instant.situation, Situation::Logged(_))
        && instant
            .readings
            .iter()
            .all(|reading| reading.what.is_load())
}

/// Derivatives of an instant with an adjoint, by prior standard deviation of each unknown.
pub(crate) fn by_adjoint(
    changed: &Changed,
    columns: &Columns,
    sigmas: &[f64],
    instant: &Instant,
) -> DMatrix<f64> {
    let mut derivatives = DMatrix::zeros(instant.readings.len(), sigmas.len());
    let (Situation::Logged(state), Some(machine), Some(columns)) =
        (&instant.situation, changed.at(instant), columns.at(instant))
    else {
        return derivatives;
    };
    let scope = Scope {
        sensitivities: true,
        ..Scope::LOADS
    };
    let mut workspace = Workspace::with_scope(machine, scope);
    evaluate_one(machine, &changed.corrected(state), &mut workspace);
    let sensitivity: &Sensitivity<f64> = workspace.sensitivity();
    for (row, reading) in instant.readings.iter().enumerate() {
        let Measured::Load { supports } = &reading.what else {
            continue;
        };
        for wheel in places(machine, supports) {
            let by = columns.row(&sensitivity.load(wheel), sigmas);
            for (column, by) in by.into_iter().enumerate() {
                derivatives[(row, column)] += by;
            }
        }
    }
    derivatives
}

/// Derivatives of instants without an adjoint, in their order.
pub(crate) fn by_differences(
    (machine, sets): (&Machine, &[Arc<[SupportId]>]),
    unknowns: &[Unknown],
    sigmas: &[f64],
    changes: &[f64],
    instants: &[&Instant],
) -> Vec<DMatrix<f64>> {
    let empty = |instant: &&Instant| DMatrix::zeros(instant.readings.len(), unknowns.len());
    let mut found: Vec<DMatrix<f64>> = instants.iter().map(empty).collect();
    if instants.is_empty() {
        return found;
    }
    let columns: Vec<Vec<Vec<f64>>> = (0..unknowns.len())
        .into_par_iter()
        .map(|unknown| {
            let [below, above] = [-1.0, 1.0].map(|side| {
                let mut moved = changes.to_vec();
                moved[unknown] += side * STEP * sigmas[unknown];
                let changed = Changed::new(machine, sets, unknowns, &moved);
                let predict = |instant: &&Instant| changed.predict(instant, [0.0; 2]);
                instants.iter().map(predict).collect::<Vec<_>>()
            });
            let pairs = below.into_iter().zip(above);
            let slope = |(a, b): (Vec<f64>, Vec<f64>)| {
                let pairs = a.into_iter().zip(b);
                pairs.map(|(a, b)| (b - a) / (2.0 * STEP)).collect()
            };
            pairs.map(slope).collect()
        })
        .collect();
    for (unknown, of_instants) in columns.into_iter().enumerate() {
        for (matrix, values) in found.iter_mut().zip(of_instants) {
            for (row, value) in values.into_iter().enumerate() {
                matrix[(row, unknown)] = value;
            }
        }
    }
    found
}
