//! `policy.json`: the logs of a fleet that violate the policy.

use std::fs;
use std::path::Path;

use anyhow::Result;
use serde::Serialize;

use super::merge::LogRow;
use crate::base::files::write_atomically;
use crate::policy::{Judgement, Policy, RuleOutcome};

/// A log that violates the policy, in `policy.json`.
#[derive(Debug, Clone, Serialize)]
struct Broken<'a> {
    path: &'a str,
    log_id: Option<&'a str>,
    broken: Vec<&'a RuleOutcome>,
}

/// `policy.json`.
#[derive(Debug, Serialize)]
struct PolicyResult<'a> {
    policy: &'a str,
    policy_sha256: Option<&'a str>,
    passed: bool,
    logs_judged: usize,
    logs_broken: usize,
    logs: Vec<Broken<'a>>,
}

/// The judgement of each row; `None` without a policy, and for failed logs.
pub(super) fn judge(rows: &[LogRow], policy: Option<&Policy>) -> Vec<Option<Judgement>> {
    let judged = rows.iter().map(|row| {
        let (facts, events) = row.record.analysed()?;
        Some(policy?.judge(facts, events))
    });
    judged.collect()
}

pub(super) fn write_policy(
    rows: &[LogRow],
    judgements: &[Option<Judgement>],
    policy: Option<&Policy>,
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
            broken: judgement.violated().collect(),
        })
        .collect();
    let result = PolicyResult {
        policy: &policy.name,
        policy_sha256: policy.file.as_ref().map(|file| file.sha256.as_str()),
        passed: broken.is_empty(),
        logs_judged: judged.count(),
        logs_broken: broken.len(),
        logs: broken,
    };
    write_atomically(&path, serde_json::to_string_pretty(&result)?.as_bytes())
}
