//! From the definition of a message type to the steps that read a few of its fields.

mod block;
mod compiler;

use crate::{
    binary::{self, DecodeError, Step as Op},
    definition::{Definitions, Dialect, SchemaError},
    field_path::FieldPath,
    fields::Fields,
};

/// The steps that read the wanted fields of one message type, and pass over the others.
///
/// ```
/// use tipwatch_ingest::{FieldPath, Fields, Layout};
///
/// let paths: Vec<FieldPath> = vec!["force.z".parse()?];
/// let definition = "Vector force\n===\nMSG: pkg/Vector\nfloat64 x\nfloat64 y\nfloat64 z\n";
/// let layout = Layout::compile(definition, "pkg/msg/Load", &paths)?;
///
/// let mut message = vec![0, 1, 0, 0];
/// for value in [1.0_f64, 2.0, 3.0] {
///     message.extend(value.to_le_bytes());
/// }
/// let mut fields = Fields::new();
/// layout.decode(&message, &mut fields)?;
/// assert_eq!(fields.number(0), 3.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Layout {
    steps: Vec<Op>,
    dialect: Dialect,
    path_count: usize,
    /// Slots that collect one value from each element of an array of messages.
    collecting: Vec<usize>,
}

impl Layout {
    /// Works out the steps for `paths`, in a definition as recorders of ROS 2 embed it; for CDR.
    pub fn compile(
        definition: &str,
        type_name: &str,
        paths: &[FieldPath],
    ) -> Result<Layout, SchemaError> {
        Self::compile_dialect(definition, type_name, Dialect::Ros2, paths)
    }

    /// As [`compile`](Self::compile), for the encoding that goes with a dialect.
    pub(crate) fn compile_dialect(
        definition: &str,
        type_name: &str,
        dialect: Dialect,
        paths: &[FieldPath],
    ) -> Result<Layout, SchemaError> {
        refuse_repeated(paths)?;
        let definitions = Definitions::parse(definition, type_name, dialect)?;
        let (steps, collecting) = compiler::compile(&definitions, paths)?;
        Ok(Layout {
            steps,
            dialect,
            path_count: paths.len(),
            collecting,
        })
    }

    /// Reads the wanted fields of one message. After an error the values are those of no message.
    pub fn decode(&self, message: &[u8], values: &mut Fields) -> Result<(), DecodeError> {
        values.prepare(self.path_count);
        for &slot in &self.collecting {
            values.slots[slot].numbers.clear();
            values.slots[slot].texts.clear();
        }
        match self.dialect {
            Dialect::Ros2 => binary::run_cdr(&self.steps, message, values),
            Dialect::Ros1 => binary::run_ros1(&self.steps, message, values),
        }
    }
}

fn refuse_repeated(paths: &[FieldPath]) -> Result<(), SchemaError> {
    for (index, path) in paths.iter().enumerate() {
        if paths[..index].contains(path) {
            return Err(SchemaError::RepeatedPath {
                path: path.to_string(),
            });
        }
    }
    Ok(())
}
