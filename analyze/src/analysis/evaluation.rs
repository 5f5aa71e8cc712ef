//! Evaluates all rows with the chosen model, and with the others for comparison.

use std::sync::Arc;

use anyhow::{Result, anyhow};
use rayon::prelude::*;
use strum::VariantArray;
use tipwatch_mechanics::closed_form::ClosedFormInput as Input;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{ClosedForm, Model, OutcomeColumns, Scope, StateColumns, evaluate_rows};

use super::model_comparison::{ModelComparison, compare};
use crate::base::options::{self, Options};
use crate::base::rows::Rows;

/// Rows of a block that is evaluated in parallel.
const BLOCK_ROWS: usize = 1024;

/// The quantities to evaluate, given model and options.
#[must_use]
pub(crate) fn scope(options: &Options) -> Scope {
    match options.model {
        options::ModelKind::WholeBody => Scope {
            parts: options.columns.parts,
            ..Scope::ALL
        },
        options::ModelKind::VariableInertia | options::ModelKind::ClosedForm => Scope {
            indicators: true,
            terms: options.columns.terms,
            ..Scope::LOADS
        },
    }
}

/// Builds the chosen model.
///
/// # Errors
/// The closed form does not apply to the machine.
pub(crate) fn model(
    machine: &Machine,
    which: options::ModelKind,
    posture: &[f64],
    has_odometry: bool,
    options: &Options,
) -> Result<Arc<Model>> {
    if which == options::ModelKind::WholeBody {
        return Ok(Arc::new(Model::WholeBody));
    }
    let input = match (options.closed_form_input, has_odometry) {
        (Some(options::ClosedFormInput::Velocity), _) | (None, true) => Input::Velocity,
        (Some(options::ClosedFormInput::Accelerometer), _) | (None, false) => Input::Accelerometer,
    };
    let closed_form = if which == options::ModelKind::ClosedForm {
        ClosedForm::new(machine, posture, input)
    } else {
        ClosedForm::with_variable_inertia(machine, posture, input)
    };
    let closed_form = closed_form.map_err(|error| anyhow!("model {}: {error}", which.name()))?;
    Ok(Arc::new(Model::ClosedForm(Box::new(closed_form))))
}

/// Evaluates all rows, in parallel blocks.
pub(crate) fn evaluate_all(
    machine: &Machine,
    states: &StateColumns,
    scope: Scope,
    model: &Arc<Model>,
) -> OutcomeColumns {
    let blocks: Vec<usize> = (0..states.rows()).step_by(BLOCK_ROWS).collect();
    let evaluated: Vec<OutcomeColumns> = blocks
        .into_par_iter()
        .map(|first| {
            let rows = first..(first + BLOCK_ROWS).min(states.rows());
            evaluate_rows(machine, states, rows, scope, model)
        })
        .collect();
    let mut all = OutcomeColumns::empty(machine, scope);
    for block in evaluated {
        all.append(block);
    }
    all
}

/// Compares the other models over the same rows, as far as they can be computed.
pub(crate) fn compare_models(
    machine: &Machine,
    rows: &Rows,
    posture: &[f64],
    has_odometry: bool,
    options: &Options,
) -> Vec<Result<ModelComparison, String>> {
    let others = options::ModelKind::VARIANTS
        .iter()
        .copied()
        .filter(|&other| {
            // on a platform without actuators the two analytic models are identical
            other != options.model
                && (other != options::ModelKind::VariableInertia || machine.suspension().is_some())
        });
    others
        .map(|other| {
            let model = model(machine, other, posture, has_odometry, options)
                .map_err(|error| error.to_string())?;
            let outcomes = evaluate_all(machine, &rows.states, Scope::LOADS, &model);
            let comparison = compare(rows, other, &outcomes);
            if comparison.rows == 0 {
                return Err(format!(
                    "model {}: expected rows with attitude and motion, found none",
                    other.name()
                ));
            }
            Ok(comparison)
        })
        .collect()
}
