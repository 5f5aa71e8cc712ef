//! Message definitions: what fields a type has, and paths to single fields.

pub(crate) mod builtin;
mod definition;
mod error;
mod field_path;
mod given;
mod idl;
mod path_tree;
mod types;

pub use self::{builtin::known_definition, error::SchemaError, field_path::FieldPath, types::CDR};
pub(crate) use self::{
    definition::{Definitions, IDL, significant_lines},
    field_path::{Elements, PathStep},
    given::GivenDefinitions,
    path_tree::{Branch, PathTree},
    types::{Dialect, Field, FieldType, NumberType, Repetition, normal_type_name},
};
