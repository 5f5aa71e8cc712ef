//! Requirements by which the logs of a fleet are judged.

use anyhow::Result;
use tipwatch_analyze::analysis::DEFAULT_MIN_VALID;
use tipwatch_analyze::events::EventKind;
use tipwatch_analyze::policy::Policy;
use tipwatch_analyze::screen::Gate;

use crate::call::options::{Words, one_of};
use crate::call::place::Place;

/// The rules of a policy file, or those against some kinds of events; none without both.
///
/// # Errors
/// The file is not valid, or a kind is unknown.
pub(super) fn rules(policy: Option<&Place>, fail_on: Option<&Words>) -> Result<Option<Policy>> {
    match (policy, fail_on) {
        (Some(file), _) => Ok(Some(Policy::read(file)?)),
        (None, Some(kinds)) => without(&kinds.0),
        (None, None) => Ok(None),
    }
}

/// The rules against events of these kinds; none without a kind.
fn without(kinds: &[String]) -> Result<Option<Policy>> {
    let kinds = kinds.iter().map(|kind| one_of("fail_on", kind));
    let kinds: Vec<EventKind> = kinds.collect::<Result<_>>()?;
    Ok((!kinds.is_empty()).then(|| Policy::without(&kinds)))
}

/// Returns the requirements for a log: these rules, and the least computable share of its time, by default that of the rules.
pub(super) fn gate(policy: Option<&Policy>, min_valid: Option<f64>) -> Gate<'_> {
    Gate {
        policy,
        min_valid: min_valid
            .or_else(|| policy?.min_valid)
            .unwrap_or(DEFAULT_MIN_VALID),
    }
}
