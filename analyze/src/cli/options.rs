//! Shared options: how to analyse logs, and when to fail.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;

use crate::analysis::DEFAULT_MIN_VALID;
use crate::base::options::{
    ApplyClockOffsets, ClosedFormInput, Estimator, HIGHEST_RATE_HZ, LONGEST_STEP_S, ModelKind,
    Options, QuasiStaticOption, ReportLanguage, positive, share,
};
use crate::events::EventKind;
use crate::output::custody::Origin;
use crate::policy::Policy;

/// How to analyse logs.
#[derive(Debug, Args)]
pub(super) struct AnalysisArgs {
    /// Model of the ground wrench.
    #[arg(long, value_enum, default_value_t = ModelKind::WholeBody)]
    pub(super) model: ModelKind,
    /// Estimator of the states.
    #[arg(long, value_enum, default_value_t = Estimator::Smoother)]
    pub(super) estimator: Estimator,
    /// Row rate; default: rows at the stamps of the fastest joint stream.
    #[arg(long, value_name = "HZ", value_parser = rate)]
    pub(super) rate: Option<f64>,
    /// Source of the platform's acceleration in the closed form; default: velocity if the log has odometry.
    #[arg(long, value_enum, value_name = "SIGNAL")]
    pub(super) closed_form_input: Option<ClosedFormInput>,
    /// Which offsets between the clocks of topics to correct.
    #[arg(long, value_enum, value_name = "WHICH", default_value_t = ApplyClockOffsets::Stated)]
    pub(super) apply_clock_offsets: ApplyClockOffsets,
    /// Whether rows of a sparse log are static: they hold the last samples, and their bands contain what motion
    /// between them can have done to the loads; default: as the machine file says, else auto.
    #[arg(long, value_enum, value_name = "WHEN")]
    pub(super) quasi_static: Option<QuasiStaticOption>,
}

impl AnalysisArgs {
    pub(super) fn options(&self) -> Options {
        Options {
            estimator: self.estimator,
            model: self.model,
            rate_hz: self.rate,
            closed_form_input: self.closed_form_input,
            apply_clock_offsets: self.apply_clock_offsets,
            quasi_static: self.quasi_static,
            ..Options::default()
        }
    }
}

/// In which language to speak.
#[derive(Debug, Clone, Copy, Default, Args)]
pub(super) struct LanguageArgs {
    /// Language of report and findings. Keys, columns and errors are English in any.
    #[arg(long, value_enum, value_name = "LANGUAGE", default_value_t)]
    lang: ReportLanguage,
}

impl LanguageArgs {
    /// Chooses the language for the whole program.
    pub(super) fn choose(self) {
        tipwatch_language::choose(self.lang.into());
    }
}

/// Whose analysis it is.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct CaseArgs {
    /// Case number or name, for report, summary and custody.json.
    #[arg(long, value_name = "TEXT")]
    pub(super) case: Option<String>,
    /// Name of the examiner, for report, summary and custody.json.
    #[arg(long, value_name = "NAME")]
    pub(super) examiner: Option<String>,
}

impl CaseArgs {
    /// The command line of this process, with case and examiner.
    pub(super) fn origin(&self) -> Origin {
        Origin {
            command_line: tipwatch_storage::recorded_arguments(),
            case: self.case.clone(),
            examiner: self.examiner.clone(),
        }
    }
}

/// When to fail.
#[derive(Debug, Args)]
pub(super) struct PolicyArgs {
    /// Exit with code 4 if there is an event of this kind, or with 8 if that cannot be decided; may be
    /// repeated.
    #[arg(long, value_name = "EVENT", value_enum)]
    fail_on: Vec<EventKind>,
    /// Exit with code 4 if the log violates a rule of this policy file; `policy.json` lists the rules.
    #[arg(long, value_name = "FILE", conflicts_with = "fail_on")]
    policy: Option<PathBuf>,
    #[command(flatten)]
    min_valid: MinValidArgs,
}

/// How much must be computable.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct MinValidArgs {
    /// Share of the log's time, 0 to 1, in which wheel loads must be computable; default: 0.5, or that of
    /// the policy. With less, or without any computable row, nothing is decided: code 8, and every rule
    /// of --fail-on and --policy fails.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    min_valid: Option<f64>,
}

impl MinValidArgs {
    /// The share; `policy` may state another default.
    pub(super) fn share(self, policy: Option<&Policy>) -> f64 {
        let stated = self
            .min_valid
            .or(policy.and_then(|policy| policy.min_valid));
        stated.unwrap_or(DEFAULT_MIN_VALID)
    }
}

impl PolicyArgs {
    /// The policy file.
    pub(super) fn file(&self) -> Option<&Path> {
        self.policy.as_deref()
    }

    /// The policy; `None` if none was given.
    pub(super) fn policy(&self) -> Result<Option<Policy>> {
        match &self.policy {
            Some(path) => Policy::read(path).map(Some),
            None if self.fail_on.is_empty() => Ok(None),
            None => Ok(Some(Policy::without(&self.fail_on))),
        }
    }

    /// The least share of the time that must be computable.
    pub(super) fn min_valid(&self, policy: Option<&Policy>) -> f64 {
        self.min_valid.share(policy)
    }
}

/// A row rate.
pub(super) fn rate(text: &str) -> Result<f64, String> {
    let value = positive(text)?;
    match value <= HIGHEST_RATE_HZ {
        true => Ok(value),
        false => Err(format!("expected at most {HIGHEST_RATE_HZ} Hz")),
    }
}

/// A control period.
pub(super) fn period(text: &str) -> Result<f64, String> {
    let value = positive(text)?;
    match (1.0 / HIGHEST_RATE_HZ..=LONGEST_STEP_S).contains(&value) {
        true => Ok(value),
        false => Err(format!(
            "expected {} to {LONGEST_STEP_S} s",
            1.0 / HIGHEST_RATE_HZ
        )),
    }
}
