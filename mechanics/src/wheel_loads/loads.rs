//! Places for the loads of one solution.

/// The loads of one solution, by wheel (N).
pub(crate) struct Loads<'a, T> {
    /// All wheels held to the ground: the signed OTF.
    pub(crate) otf: &'a mut [T],
    /// Loads of the wheels.
    pub(crate) load: &'a mut [T],
    /// Smallest load that equilibrium allows.
    pub(crate) least: &'a mut [T],
    /// Largest load that equilibrium allows.
    pub(crate) largest: &'a mut [T],
}
