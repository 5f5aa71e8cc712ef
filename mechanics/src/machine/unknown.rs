//! Unknowns of a machine that measured loads can identify: its parameters and the constant errors of its sensors.

use super::parameter::Parameter;

/// A number that an identification can estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unknown {
    /// A parameter, or the constant error of a signal: its change in its unit.
    Parameter(Parameter),
    /// The relative change of all elements of a link's inertia tensor, so that it remains physically valid.
    Inertia(usize),
}
