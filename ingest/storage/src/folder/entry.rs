//! Objects of a folder, and results of writing them.

/// An object of a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its name within the folder, separated by `/`.
    pub key: String,
    /// Its length (bytes).
    pub bytes: u64,
    /// The tag of its version; `None` for a local file.
    pub e_tag: Option<String>,
}

/// Result of writing an object unless it exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Put {
    /// The object was written.
    Written,
    /// An object of this name was there; it is unchanged.
    AlreadyThere,
}
