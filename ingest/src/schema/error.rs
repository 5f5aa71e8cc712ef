//! Errors of message definitions.

/// Error: a message definition cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SchemaError {
    /// A line that is neither a field nor a constant.
    #[error(
        "definition of {type_name}, line {line}: expected a type and a field name, found {found:?}"
    )]
    Line {
        /// The requested type.
        type_name: String,
        /// Line number in the whole text, from 1.
        line: usize,
        /// The line.
        found: String,
    },
    /// A field whose type is not defined.
    #[error("{type_name}.{field}: the definition of its type {part} is missing")]
    UndefinedType {
        /// The type that has the field.
        type_name: String,
        /// The field.
        field: String,
        /// The undefined type.
        part: String,
    },
    /// A path that leads to no field.
    #[error("{path}: expected a field of {type_name}, which has: {}", fields.join(", "))]
    NoSuchField {
        /// The path.
        path: String,
        /// The type that lacks the field.
        type_name: String,
        /// The fields of that type.
        fields: Vec<String>,
    },
    /// A path that leads to a field of the wrong kind.
    #[error("{path}: expected {expected}, found {found}")]
    WrongKind {
        /// The path.
        path: String,
        /// The kind that the path requires.
        expected: String,
        /// The kind of the field.
        found: String,
    },
    /// A path requested twice.
    #[error("{path}: requested twice")]
    RepeatedPath {
        /// The path.
        path: String,
    },
    /// A path that is not of the form `name.name[].name`.
    #[error(
        "{path:?} is not a field path: expected names joined by dots, each optionally followed by [] or [3]"
    )]
    BadPath {
        /// The text.
        path: String,
    },
    /// A field before a wanted one whose encoded length is unknown.
    #[error(
        "{field}: wstring before a wanted field: its character width is not standardised, so later fields cannot be located"
    )]
    WideString {
        /// The field.
        field: String,
    },
    /// A message type that its `FileDescriptorSet` does not define.
    #[error("expected a protobuf FileDescriptorSet with {type_name}, found {found}")]
    Descriptor {
        /// The requested type.
        type_name: String,
        /// Found text.
        found: String,
    },
    /// A type that contains itself, or is nested too deeply.
    #[error("definition of {type_name}: nested too deeply or too large")]
    TooLarge {
        /// The requested type.
        type_name: String,
    },
}
