//! The chosen model, and the others for comparison.

use std::sync::Arc;

use anyhow::{Result, anyhow};
use strum::VariantArray;
use tipwatch_language::say;
use tipwatch_mechanics::closed_form::ClosedFormInput as Input;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{BatchEvaluator, ClosedForm, Model, OutcomeColumns, Scope};

use crate::base::options::{self, Options};
use crate::base::rows::Rows;

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
    let closed_form =
        closed_form.map_err(|error| anyhow!(say!("model {}: {error}", which.name())))?;
    Ok(Arc::new(Model::ClosedForm(Box::new(closed_form))))
}

/// The models that the chosen one is compared with, as far as they can be computed.
pub(crate) struct OtherModels {
    pub(crate) models: Vec<(options::ModelKind, Result<BatchEvaluator, String>)>,
}

impl OtherModels {
    /// All models but the chosen one.
    pub(crate) fn new(
        machine: &Machine,
        posture: &[f64],
        has_odometry: bool,
        options: &Options,
    ) -> Self {
        let others = options::ModelKind::VARIANTS
            .iter()
            .copied()
            .filter(|&other| {
                // on a platform without actuators the two analytic models are identical
                other != options.model
                    && (other != options::ModelKind::VariableInertia
                        || machine.suspension().is_some())
            });
        let models = others.map(|other| {
            let model = model(machine, other, posture, has_odometry, options);
            let evaluator = model.map(|model| BatchEvaluator::new(machine, Scope::LOADS, &model));
            (other, evaluator.map_err(|error| error.to_string()))
        });
        Self {
            models: models.collect(),
        }
    }

    /// No models: the analytic ones are of four wheels that stay on the ground.
    pub(crate) fn none() -> Self {
        Self { models: Vec::new() }
    }

    /// The loads of a block by each model that can be computed.
    pub(crate) fn evaluate(&self, rows: &Rows) -> Vec<OutcomeColumns> {
        let models = self.models.iter();
        let evaluators = models.filter_map(|(_, evaluator)| evaluator.as_ref().ok());
        evaluators
            .map(|evaluator| evaluator.evaluate(&rows.states, 0..rows.len()))
            .collect()
    }
}
