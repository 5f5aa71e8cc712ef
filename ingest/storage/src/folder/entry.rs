//! What a folder holds, and what became of what was to be written.

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

/// What became of an object that was to be written unless it was there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Put {
    /// It was written.
    Written,
    /// An object of this name was there; it is unchanged.
    AlreadyThere,
}
