//! The policy file: defines which findings pass and which fail.
//!
//! ```toml
//! name = "acceptance drive"
//!
//! [[rule]]                     # events: accepted number of a kind
//! event = "wheel_lift"         # wheel_light, wheel_lift, edge_tipping, tip_over, input_gap, input_fault
//! at_most = 0                  # the default
//! min_certainty = 0.9          # less certain events do not count; unknown certainty counts
//! min_duration_s = 0.2         # shorter events do not count
//! subjects = ["fl", "fr"]      # only these wheels, edges or signals
//! ignore_split_dependent = true
//!
//! [[rule]]                     # numbers of the whole log: see `QUANTITIES`
//! name = "every wheel keeps 10 % of its static load"
//! quantity = "worst_margin"
//! at_least = 0.1
//! ```
//!
//! A number that cannot be computed violates its rule, unless the rule has `unknown = "pass"`. A log that
//! decides nothing violates every rule that its events do not already break. Two keys above the rules:
//!
//! ```toml
//! min_valid = 0.8              # least share of a log's time that must be computable
//! failed_logs = "pass"         # logs that cannot be analysed do not violate the policy
//! ```

use std::path::Path;

use anyhow::{Context, Result, bail};
use serde::Deserialize;
use tipwatch_binding::read_text;

use super::facts::{QUANTITIES, Quantity};
use crate::base::file_hash::FileHash;
use crate::base::file_hash::hash_of;
use crate::events::EventKind;

/// Rules that a log must satisfy.
#[derive(Debug, Clone, Default)]
pub struct Policy {
    /// Its name.
    pub name: String,
    /// Its file; `None` for a policy made from `--fail-on`.
    pub file: Option<FileHash>,
    /// Least share of a log's time that must be computable; `None` if the file does not state one.
    pub min_valid: Option<f64>,
    /// Whether logs that cannot be analysed are accepted.
    pub accepts_failed_logs: bool,
    pub(super) rules: Vec<Rule>,
}

/// A policy file as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PolicySpec {
    name: Option<String>,
    min_valid: Option<f64>,
    failed_logs: Option<WhenUnknown>,
    #[serde(default, rename = "rule")]
    rules: Vec<RuleSpec>,
}

/// A `[[rule]]` as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RuleSpec {
    name: Option<String>,
    event: Option<String>,
    quantity: Option<String>,
    at_most: Option<f64>,
    at_least: Option<f64>,
    min_certainty: Option<f64>,
    min_duration_s: Option<f64>,
    subjects: Option<Vec<String>>,
    ignore_split_dependent: Option<bool>,
    unknown: Option<WhenUnknown>,
}

/// The outcome for what cannot be computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum WhenUnknown {
    #[default]
    Fail,
    Pass,
}

/// A rule as checked.
#[derive(Debug, Clone)]
pub(super) struct Rule {
    pub(super) name: String,
    pub(super) check: Check,
}

#[derive(Debug, Clone)]
pub(super) enum Check {
    Events {
        which: Events,
        at_most: u64,
    },
    Number {
        quantity: Quantity,
        at_least: Option<f64>,
        at_most: Option<f64>,
        unknown: WhenUnknown,
    },
}

/// The events that a rule counts.
#[derive(Debug, Clone)]
pub(super) struct Events {
    pub(super) kind: EventKind,
    pub(super) min_certainty: f64,
    pub(super) min_duration_s: f64,
    /// In lower case; empty for all.
    pub(super) subjects: Vec<String>,
    pub(super) ignore_split_dependent: bool,
}

impl Policy {
    /// Reads a policy file.
    ///
    /// # Errors
    /// The file cannot be read, or is not a valid policy.
    pub fn read(path: &Path) -> Result<Self> {
        let text =
            read_text(path).with_context(|| format!("{}: cannot be read", path.display()))?;
        Self::from_text(&text, &path.display().to_string())
    }

    /// A policy from its text; `file` is named in errors.
    ///
    /// # Errors
    /// The text is not a valid policy.
    pub fn from_text(text: &str, file: &str) -> Result<Self> {
        let spec: PolicySpec =
            toml::from_str(text).with_context(|| format!("{file}: not a valid policy file"))?;
        if spec.rules.is_empty() {
            bail!("{file}: expected at least one [[rule]], found none");
        }
        if let Some(share) = spec.min_valid
            && !(0.0..=1.0).contains(&share)
        {
            bail!("{file}: min_valid: expected a share, 0 to 1, found {share}");
        }
        let rules = spec.rules.into_iter().enumerate().map(|(i, rule)| {
            let place = format!("{file}: rule {}", i + 1);
            rule.check().with_context(|| place)
        });
        Ok(Self {
            rules: rules.collect::<Result<_>>()?,
            name: spec.name.unwrap_or_else(|| file.into()),
            file: Some(hash_of(file.into(), text.as_bytes())),
            min_valid: spec.min_valid,
            accepts_failed_logs: spec.failed_logs == Some(WhenUnknown::Pass),
        })
    }

    /// A policy that accepts no event of these kinds.
    #[must_use]
    pub fn without(kinds: &[EventKind]) -> Self {
        let rule = |&kind: &EventKind| Rule {
            name: format!("no {}", kind.name()),
            check: Check::Events {
                which: Events::all_of(kind),
                at_most: 0,
            },
        };
        Self {
            name: "--fail-on".into(),
            file: None,
            min_valid: None,
            accepts_failed_logs: false,
            rules: kinds.iter().map(rule).collect(),
        }
    }
}

impl Events {
    pub(super) fn all_of(kind: EventKind) -> Self {
        Self {
            kind,
            min_certainty: 0.0,
            min_duration_s: 0.0,
            subjects: Vec::new(),
            ignore_split_dependent: false,
        }
    }
}

impl RuleSpec {
    fn check(self) -> Result<Rule> {
        let numbers = [
            ("at_most", self.at_most),
            ("at_least", self.at_least),
            ("min_certainty", self.min_certainty),
            ("min_duration_s", self.min_duration_s),
        ];
        for (key, value) in numbers {
            if value.is_some_and(|value| !value.is_finite()) {
                bail!("{key}: expected a finite number, found {value:?}");
            }
        }
        let check = match (&self.event, &self.quantity) {
            (Some(event), None) => self.check_events(event)?,
            (None, Some(quantity)) => self.check_number(quantity)?,
            (Some(_), Some(_)) => bail!("expected either event or quantity, found both"),
            (None, None) => bail!("expected event = \"...\" or quantity = \"...\", found neither"),
        };
        Ok(Rule {
            name: self.name.unwrap_or_else(|| check.description()),
            check,
        })
    }

    fn check_events(&self, event: &str) -> Result<Check> {
        self.refuse(&[
            ("at_least", self.at_least.is_some()),
            ("unknown", self.unknown.is_some()),
        ])?;
        let kind = named(
            "event",
            EventKind::ALL.map(|kind| (kind.name(), kind)),
            event,
        )?;
        let at_most = self.at_most.unwrap_or(0.0);
        if at_most < 0.0 || at_most.fract() != 0.0 {
            bail!("at_most: expected a number of events, found {at_most}");
        }
        let min_certainty = self.min_certainty.unwrap_or(0.0);
        if !(0.0..=1.0).contains(&min_certainty) {
            bail!("min_certainty: expected a probability, 0 to 1, found {min_certainty}");
        }
        let subjects = self.subjects.iter().flatten();
        let which = Events {
            min_certainty,
            min_duration_s: self.min_duration_s.unwrap_or(0.0),
            subjects: subjects.map(|subject| subject.to_lowercase()).collect(),
            ignore_split_dependent: self.ignore_split_dependent.unwrap_or(false),
            ..Events::all_of(kind)
        };
        Ok(Check::Events {
            which,
            at_most: at_most as u64,
        })
    }

    fn check_number(&self, quantity: &str) -> Result<Check> {
        self.refuse(&[
            ("min_certainty", self.min_certainty.is_some()),
            ("min_duration_s", self.min_duration_s.is_some()),
            ("subjects", self.subjects.is_some()),
            (
                "ignore_split_dependent",
                self.ignore_split_dependent.is_some(),
            ),
        ])?;
        let quantity = named("quantity", QUANTITIES.map(|of| (of.0, of)), quantity)?;
        match (self.at_least, self.at_most) {
            (None, None) => bail!("expected at_least or at_most, found neither"),
            (Some(least), Some(most)) if least > most => {
                bail!("expected at_least <= at_most, found {least} and {most}")
            }
            (at_least, at_most) => Ok(Check::Number {
                quantity,
                at_least,
                at_most,
                unknown: self.unknown.unwrap_or_default(),
            }),
        }
    }

    /// Rejects keys that do not apply, which would otherwise be silently ignored.
    fn refuse(&self, keys: &[(&str, bool)]) -> Result<()> {
        let kind = if self.event.is_some() {
            "event"
        } else {
            "quantity"
        };
        match keys.iter().find(|(_, given)| *given) {
            Some((key, _)) => bail!("{key} does not apply to a rule with {kind}"),
            None => Ok(()),
        }
    }
}

/// The value of this name.
fn named<T, const N: usize>(key: &str, all: [(&str, T); N], name: &str) -> Result<T> {
    let names = all.each_ref().map(|(known, _)| *known).join(", ");
    let found = all.into_iter().find(|(known, _)| *known == name);
    let found = found.map(|(_, value)| value);
    found.with_context(|| format!("{key}: expected one of {names}, found \"{name}\""))
}

impl Check {
    /// The rule as text, if the file gives it no name: a key, in English.
    fn description(&self) -> String {
        match self {
            Self::Events { which, at_most: 0 } => format!("no {}", which.kind.name()),
            Self::Events { which, at_most } => {
                format!("at most {at_most} times {}", which.kind.name())
            }
            Self::Number {
                quantity: (quantity, _),
                at_least,
                at_most,
                ..
            } => {
                let least = at_least.map(|least| format!("at least {least}"));
                let most = at_most.map(|most| format!("at most {most}"));
                let bounds: Vec<String> = least.into_iter().chain(most).collect();
                format!("{quantity} {}", bounds.join(" and "))
            }
        }
    }
}
