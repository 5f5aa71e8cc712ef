//! Why a message definition cannot be used.

/// Why a definition cannot be understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SchemaError {
    /// A line that is neither a field nor a constant.
    #[error(
        "definition of {type_name}, line {line}: expected a type and a field name, found {found:?}"
    )]
    Line {
        /// The type that was asked for.
        type_name: String,
        /// Counted from 1 over the whole text.
        line: usize,
        /// The line.
        found: String,
    },
    /// A field of a type that is defined nowhere.
    #[error("{type_name}.{field}: its type {part} is not defined")]
    UndefinedType {
        /// The type that has the field.
        type_name: String,
        /// The field.
        field: String,
        /// The missing type.
        part: String,
    },
    /// A path that leads to no field.
    #[error("{path}: expected a field of {type_name}, which has: {}", fields.join(", "))]
    NoSuchField {
        /// The path.
        path: String,
        /// The type in which it leads nowhere.
        type_name: String,
        /// The fields of that type.
        fields: Vec<String>,
    },
    /// A path that leads to a field of another kind.
    #[error("{path}: expected {expected}, found {found}")]
    WrongKind {
        /// The path.
        path: String,
        /// What the path asks for.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The same path twice.
    #[error("{path}: asked for twice")]
    RepeatedPath {
        /// The path.
        path: String,
    },
    /// A path that is not of the form `name.name[].name`.
    #[error(
        "{path:?} is no field path: expected names joined by dots, each with [] or [3] or nothing"
    )]
    BadPath {
        /// The text.
        path: String,
    },
    /// A field that lies before a wanted one and cannot be passed over.
    #[error(
        "{field}: a wstring before a wanted field: its width is not laid down, so nothing after it can be found"
    )]
    WideString {
        /// The field.
        field: String,
    },
    /// A message type that its set of protobuf descriptors does not define.
    #[error("expected a set of protobuf descriptors with {type_name}, found {found}")]
    Descriptor {
        /// The type that was asked for.
        type_name: String,
        /// What is there instead.
        found: String,
    },
    /// A type that contains itself, or is nested beyond reason.
    #[error("definition of {type_name}: nested too deeply or too large")]
    TooLarge {
        /// The type that was asked for.
        type_name: String,
    },
}
