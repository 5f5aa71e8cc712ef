//! The rule that splits the load where equilibrium leaves it open.

/// The rule that splits the load where equilibrium leaves it open.
#[derive(Debug, Clone, PartialEq)]
pub enum Split {
    /// Assumption 8, (54) of the first paper: right minus left of the front axle is the share D of
    /// right minus left of the machine.
    FrontShare {
        /// D, 0 to 1.
        share: f64,
        /// Indices of the wheels front left, front right, rear left, rear right.
        wheels: [usize; 4],
    },
    /// The wheels stand on springs of their stiffness on a rigid frame.
    Springs,
}
