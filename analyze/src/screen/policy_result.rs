//! `policy.json`: the logs of a fleet that violate the policy.

use std::fs;
use std::path::Path;

use anyhow::Result;
use serde::Serialize;

use super::merge::LogRow;
use super::record::Outcome;
use crate::base::files::write_atomically;
use crate::policy::{Judgement, Policy, RuleOutcome};

/// A log that violates the policy, in `policy.json`.
#[derive(Debug, Clone, Serialize)]
struct Broken<'a> {
    path: &'a str,
    log_id: Option<&'a str>,
    /// Reason why the log decides nothing; null if it decides.
    undecided: Option<&'a str>,
    broken: Vec<&'a RuleOutcome>,
}

/// `policy.json`.
#[derive(Debug, Serialize)]
struct PolicyResult<'a> {
    policy: &'a str,
    policy_sha256: Option<&'a str>,
    passed: bool,
    min_valid: f64,
    logs_judged: usize,
    logs_broken: usize,
    /// Of these, logs that could not be analysed.
    logs_failed: usize,
    /// Of these, logs that were analysed and decide nothing.
    logs_undecided: usize,
    logs: Vec<Broken<'a>>,
}

/// The judgement of each row; `None` without a policy.
pub(super) fn judge(
    rows: &[LogRow],
    policy: Option<&Policy>,
    min_valid: f64,
) -> Vec<Option<Judgement>> {
    let judged = rows.iter().map(|row| match &row.record.result {
        Outcome::Analysed { facts, events, .. } => Some(policy?.judge(facts, events, min_valid)),
        Outcome::Failed { reason, .. } => Some(policy?.judge_failed(reason)),
    });
    judged.collect()
}

pub(super) fn write_policy(
    rows: &[LogRow],
    judgements: &[Option<Judgement>],
    policy: Option<&Policy>,
    min_valid: f64,
    out: &Path,
) -> Result<()> {
    let path = out.join("policy.json");
    let Some(policy) = policy else {
        // a file of an earlier run does not apply to this one
        let _ = fs::remove_file(path);
        return Ok(());
    };
    let judged = rows.iter().zip(judgements);
    let judged = judged.filter_map(|(row, judgement)| Some((row, judgement.as_ref()?)));
    let broken: Vec<Broken<'_>> = judged
        .clone()
        .filter(|(_, judgement)| !judgement.passed)
        .map(|(row, judgement)| Broken {
            path: &row.record.path,
            log_id: row.record.log_id.as_deref(),
            undecided: judgement.undecided.as_deref(),
            broken: judgement.violated().collect(),
        })
        .collect();
    let of_broken = |is_failed: bool| {
        let judged = judged.clone().filter(|(_, judgement)| !judgement.passed);
        let undecided = judged.filter(|(_, judgement)| judgement.undecided.is_some());
        undecided
            .filter(|(row, _)| row.record.is_failed() == is_failed)
            .count()
    };
    let result = PolicyResult {
        min_valid,
        logs_failed: of_broken(true),
        logs_undecided: of_broken(false),
        policy: &policy.name,
        policy_sha256: policy.file.as_ref().and_then(|file| file.sha256.as_deref()),
        passed: broken.is_empty(),
        logs_judged: judged.count(),
        logs_broken: broken.len(),
        logs: broken,
    };
    write_atomically(&path, serde_json::to_string_pretty(&result)?.as_bytes())
}
