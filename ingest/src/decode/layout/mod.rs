//! Compiles the definition of a message type into steps that read the wanted fields.

mod block;
mod compiler;
mod of_topic;

pub(crate) use self::of_topic::layout_of;

use crate::{
    decode::{
        binary::{self, Op},
        error::DecodeError,
        fields::Fields,
        json,
        places::Places,
        protobuf,
    },
    schema::{Definitions, Dialect, FieldPath, PathTree, SchemaError},
};

/// The steps that read the wanted fields of one message type and skip the others.
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
    plan: Plan,
    path_count: usize,
}

/// Steps that locate the fields, by encoding.
#[derive(Debug, Clone)]
enum Plan {
    /// CDR or the encoding of ROS 1.
    Binary {
        steps: Vec<Op>,
        dialect: Dialect,
        /// Slots that collect one value per element of an array of messages.
        collecting: Vec<usize>,
    },
    Json(PathTree),
    Protobuf(protobuf::Plan),
}

impl Layout {
    /// Works out the steps for `paths`, in a definition as recorders of ROS 2 embed it; for CDR.
    pub fn compile(
        definition: &str,
        type_name: &str,
        paths: &[FieldPath],
    ) -> Result<Layout, SchemaError> {
        let definitions = Definitions::parse(definition, type_name, Dialect::Ros2)?;
        Self::of_definitions(&definitions, paths)
    }

    /// Compiles a layout as [`compile`](Self::compile) does, for the encoding that goes with the dialect of the definitions.
    pub(crate) fn of_definitions(
        definitions: &Definitions,
        paths: &[FieldPath],
    ) -> Result<Layout, SchemaError> {
        refuse_repeated(paths)?;
        let dialect = definitions.dialect;
        let (steps, collecting) = compiler::compile(definitions, paths)?;
        let plan = Plan::Binary {
            steps,
            dialect,
            collecting,
        };
        Ok(Layout::new(plan, paths))
    }

    /// Returns the layout for JSON. JSON has no definition that would have to be followed; a field that a message does not have
    /// is NaN or empty.
    pub(crate) fn json(paths: &[FieldPath]) -> Result<Layout, SchemaError> {
        refuse_repeated(paths)?;
        Ok(Layout::new(Plan::Json(PathTree::new(paths)), paths))
    }

    /// Returns the layout for protobuf, by the set of descriptors that a log carries.
    pub(crate) fn protobuf(
        descriptors: &[u8],
        type_name: &str,
        paths: &[FieldPath],
    ) -> Result<Layout, SchemaError> {
        refuse_repeated(paths)?;
        let plan = protobuf::Plan::compile(descriptors, type_name, &PathTree::new(paths))?;
        Ok(Layout::new(Plan::Protobuf(plan), paths))
    }

    fn new(plan: Plan, paths: &[FieldPath]) -> Self {
        Self {
            plan,
            path_count: paths.len(),
        }
    }

    /// Reads the wanted fields of one message. After an error the values are those of no message.
    pub fn decode(&self, message: &[u8], values: &mut Fields) -> Result<(), DecodeError> {
        let (steps, dialect, collecting) = match &self.plan {
            Plan::Binary {
                steps,
                dialect,
                collecting,
            } => (steps, *dialect, collecting),
            plan => return plan.decode_telling(message, values, self.path_count),
        };
        values.prepare(self.path_count);
        for &slot in collecting {
            values.slots[slot].numbers.clear();
            values.slots[slot].texts.clear();
        }
        match dialect {
            Dialect::Ros2 => binary::run_cdr(steps, message, values),
            Dialect::Ros1 => binary::run_ros1(steps, message, values),
        }
    }
}

impl Layout {
    /// Returns the positions of the numbers of a message that this layout decodes; `None` if they tell nothing of other messages.
    pub(crate) fn places(&self, message: &[u8]) -> Option<Places> {
        match &self.plan {
            Plan::Binary { steps, dialect, .. } => {
                Places::of(steps, *dialect, message, self.path_count)
            }
            Plan::Json(_) | Plan::Protobuf(_) => None,
        }
    }
}

impl Plan {
    /// Reads a self-describing message.
    fn decode_telling(
        &self,
        message: &[u8],
        values: &mut Fields,
        path_count: usize,
    ) -> Result<(), DecodeError> {
        values.begin(path_count);
        let result = match self {
            Plan::Json(tree) => json::run(tree, message, values),
            Plan::Protobuf(plan) => plan.run(message, values, false),
            Plan::Binary { .. } => Ok(()),
        };
        values.end();
        result
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
