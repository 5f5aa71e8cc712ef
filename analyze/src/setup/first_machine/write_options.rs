//! Choices that a first machine file makes on request, instead of leaving them to a person.

/// Requests to the writer of a first machine file.
#[derive(Debug, Clone, Copy, Default)]
pub struct WriteOptions {
    /// Impossible inertias of the URDF are accepted.
    pub accepts_inertias: bool,
    /// Joints that no message measures are held still.
    pub freezes_passive: bool,
}
