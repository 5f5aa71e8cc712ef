//! Errors in a sheet from which no machine can be made.

/// Numbers of a sheet that are missing, impossible, or contradict each other.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SheetError {
    /// The text is not a sheet.
    #[error("{file}: {message}")]
    Text {
        /// Name of the sheet.
        file: String,
        /// Description of the error, with line and column.
        message: String,
    },
    /// A number is wrong.
    #[error("{file}: {place}: expected {expected}, found {found}{}{likely}", if likely.is_empty() { "" } else { ". " })]
    Value {
        /// Name of the sheet.
        file: String,
        /// The key.
        place: String,
        /// Expected value or range, for a machine of this kind.
        expected: String,
        /// Value in the sheet.
        found: String,
        /// The likely correction; may be empty.
        likely: String,
    },
}
