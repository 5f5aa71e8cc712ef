//! Reference loads of the wheels, and the posture that defines them.

use tipwatch_language::word;

/// Reference loads by wheel (N): those of the reference posture at rest on level ground. NaN until
/// [`Machine::set_reference_loads`](crate::Machine::set_reference_loads) has computed them.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// The posture.
    pub posture: ReferencePosture,
    /// Loads at rest on level ground.
    pub static_load: Vec<f64>,
    /// Optimal loads from the machine file, else the static ones.
    pub optimal_load: Vec<f64>,
}

/// The posture whose static loads are the reference. It is a property of the machine, so that no result
/// depends on when a recording or a monitor begins.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferencePosture {
    /// Joint positions (rad or m) in the order of [`Machine::joints`](crate::Machine::joints).
    pub positions: Vec<f64>,
    /// Whether the machine file states the posture in `limits.reference_posture`. Otherwise every joint is at zero, or at the
    /// limit next to zero.
    pub is_stated: bool,
}

impl ReferencePosture {
    /// Source of the posture, for messages.
    #[must_use]
    pub fn source(&self) -> &'static str {
        if self.is_stated {
            word!("the reference posture of the machine file")
        } else {
            word!(
                "all joints at zero, within their limits (the machine file states no reference posture)"
            )
        }
    }
}
