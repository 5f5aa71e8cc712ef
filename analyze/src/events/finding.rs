//! A finding: a headline and its evidence.

use std::fmt;

/// A finding.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The event: which wheel, when, for how long, how certain.
    pub headline: String,
    /// The numbers behind it, one statement each.
    pub evidence: Vec<String>,
}

impl fmt::Display for Finding {
    /// The headline, then each piece of evidence on a line of its own.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.headline)?;
        (self.evidence.iter()).try_for_each(|evidence| write!(f, "\n    {evidence}"))
    }
}
