//! The list of assumptions.

/// A value that the sheet does not state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assumption {
    /// The assumption, with its value.
    pub what: String,
    /// Reason for the assumption.
    pub why: String,
}

impl std::fmt::Display for Assumption {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "assumed: {}, because {}", self.what, self.why)
    }
}

/// Collects assumptions; each is listed once.
#[derive(Debug, Clone, Default)]
pub(crate) struct Assumptions(Vec<Assumption>);

impl Assumptions {
    pub(crate) fn add(&mut self, what: impl Into<String>, why: impl Into<String>) {
        let assumption = Assumption {
            what: what.into(),
            why: why.into(),
        };
        if !self.0.contains(&assumption) {
            self.0.push(assumption);
        }
    }

    /// The stated value, else the prior, which is listed.
    pub(crate) fn or(
        &mut self,
        stated: Option<f64>,
        prior: f64,
        what: impl FnOnce(f64) -> String,
        why: &str,
    ) -> f64 {
        stated.unwrap_or_else(|| {
            self.add(what(prior), why);
            prior
        })
    }

    pub(crate) fn into_vec(self) -> Vec<Assumption> {
        self.0
    }
}
