//! Reads the wanted fields of a protobuf message by the `FileDescriptorSet` embedded in the log.
//!
//! Only wanted fields are stored, and no length in a message is trusted for allocation.

mod descriptor;
mod wire;

use self::{
    descriptor::{Descriptors, Field, FieldKind},
    wire::{Item, Number},
};
use crate::{
    decode::{error::DecodeError, fields::Fields, path_collector::Collector},
    schema::{Branch, PathTree, SchemaError},
};

const BROKEN: DecodeError = DecodeError::Protobuf {
    problem: "a field that exceeds the message, or has an unsupported wire type",
};

/// Collects the paths of the numbers in messages of a type.
pub(super) fn number_paths(set: &[u8], type_name: &str, found: &mut Collector) {
    if let Some(descriptors) = Descriptors::parse(set) {
        collect(&descriptors, type_name, "", 0, found);
    }
}

fn collect(
    descriptors: &Descriptors,
    type_name: &str,
    prefix: &str,
    depth: usize,
    found: &mut Collector,
) {
    for field in descriptors.fields(type_name).unwrap_or_default() {
        let path = format!("{prefix}{}", field.name);
        if found.is_full(depth) {
            return;
        }
        match (field.kind(), field.is_repeated) {
            (FieldKind::Number(_), false) => found.number(path),
            (FieldKind::Number(_), true) => found.numbers(&path, None),
            (FieldKind::Message(part), false) => {
                collect(descriptors, part, &format!("{path}."), depth + 1, found);
            }
            (FieldKind::Message(part), true) => {
                for prefix in Collector::parts(&path, None) {
                    collect(descriptors, part, &prefix, depth + 1, found);
                }
            }
            (FieldKind::Text | FieldKind::Group, _) => {}
        }
    }
}

/// The slots of the wanted fields of one message type.
#[derive(Debug, Clone, Default)]
pub(crate) struct Plan {
    fields: Vec<FieldPlan>,
    /// Slots of numbers that default to zero when absent.
    zeros: Vec<usize>,
    /// Slots of the fields that occur once, see [`PathTree::singles`].
    singles: Vec<usize>,
}

#[derive(Debug, Clone)]
struct FieldPlan {
    number: u64,
    take: Take,
}

#[derive(Debug, Clone)]
enum Take {
    Number(Number, usize),
    Text(usize),
    Numbers {
        number: Number,
        all: Option<usize>,
        elements: Vec<(usize, usize)>,
    },
    Texts(usize),
    Part(Plan),
    Parts {
        /// Plan for every message.
        all: Option<Plan>,
        /// Plans for single messages, by index.
        picks: Vec<(usize, Plan)>,
    },
}

impl Plan {
    /// Works out where the fields are, in a set of descriptors.
    pub(crate) fn compile(
        set: &[u8],
        type_name: &str,
        tree: &PathTree,
    ) -> Result<Self, SchemaError> {
        let missing = |found: &str| SchemaError::Descriptor {
            type_name: type_name.to_owned(),
            found: found.to_owned(),
        };
        let descriptors =
            Descriptors::parse(set).ok_or_else(|| missing("bytes that are not such a set"))?;
        let fields = descriptors
            .fields(type_name)
            .ok_or_else(|| missing("a set without it"))?;
        let compiler = Compiler {
            descriptors: &descriptors,
        };
        compiler.message(type_name, fields, tree, &mut Vec::new())
    }

    /// Reads one message. Fields that it lacks keep their values, except for numbers whose absence
    /// means zero. A message of an array adds one value to each list.
    pub(crate) fn run(
        &self,
        message: &[u8],
        fields: &mut Fields,
        is_in_array: bool,
    ) -> Result<(), DecodeError> {
        let read = |fields: &mut Fields| {
            // of several values the last one counts
            for &slot in &self.zeros {
                fields.take_number(slot, 0.0, is_in_array);
            }
            let mut indices = vec![0; self.fields.len()];
            for item in wire::items(message) {
                let (number, item) = item.ok_or(BROKEN)?;
                let place = self.fields.iter().position(|field| field.number == number);
                if let Some(place) = place {
                    let take = &self.fields[place].take;
                    take.item(item, &mut indices[place], fields, is_in_array)
                        .ok_or(BROKEN)??;
                }
            }
            Ok(())
        };
        match is_in_array {
            true => fields.element(&self.singles, read),
            false => read(fields),
        }
    }
}

impl Take {
    fn item(
        &self,
        item: Item<'_>,
        index: &mut usize,
        fields: &mut Fields,
        is_in_array: bool,
    ) -> Option<Result<(), DecodeError>> {
        match (self, item) {
            (Self::Number(number, slot), item) => {
                fields.take_number(*slot, number.value(item)?, is_in_array);
            }
            (Self::Text(slot), Item::Bytes(text)) => fields.take_text(*slot, text, is_in_array),
            (Self::Texts(slot), Item::Bytes(text)) => fields.take_text(*slot, text, true),
            (
                Self::Numbers {
                    number,
                    all,
                    elements,
                },
                item,
            ) => {
                let mut take = |value: f64| {
                    if let Some(slot) = all {
                        fields.take_number(*slot, value, true);
                    }
                    for (_, slot) in elements.iter().filter(|(place, _)| place == index) {
                        fields.take_number(*slot, value, is_in_array);
                    }
                    *index += 1;
                };
                match item {
                    Item::Bytes(packed) => number.unpack(packed, take)?,
                    single => take(number.value(single)?),
                }
            }
            (Self::Part(plan), Item::Bytes(part)) => {
                return Some(plan.run(part, fields, is_in_array));
            }
            (Self::Parts { all, picks }, Item::Bytes(part)) => {
                let picks = picks.iter().filter(|(at, _)| at == index);
                let picks = picks.map(|(_, plan)| (plan, is_in_array));
                for (plan, is_in_array) in all.iter().map(|plan| (plan, true)).chain(picks) {
                    if let Err(error) = plan.run(part, fields, is_in_array) {
                        return Some(Err(error));
                    }
                }
                *index += 1;
            }
            _ => return None,
        }
        Some(Ok(()))
    }
}

struct Compiler<'d> {
    descriptors: &'d Descriptors,
}

impl Compiler<'_> {
    fn message(
        &self,
        type_name: &str,
        fields: &[Field],
        tree: &PathTree,
        path: &mut Vec<String>,
    ) -> Result<Plan, SchemaError> {
        let mut plan = Plan {
            singles: tree.singles(),
            ..Plan::default()
        };
        for branch in &tree.branches {
            path.push(branch.name.clone());
            let found = fields.iter().find(|field| branch.is_called(&field.name));
            let field = found.ok_or_else(|| SchemaError::NoSuchField {
                path: path.join("."),
                type_name: type_name.to_owned(),
                fields: fields.iter().map(|field| field.name.clone()).collect(),
            })?;
            let take = self.take(type_name, field, branch, path)?;
            if let Take::Number(_, slot) = take
                && !field.has_presence
            {
                plan.zeros.push(slot);
            }
            plan.fields.push(FieldPlan {
                number: field.number,
                take,
            });
            path.pop();
        }
        Ok(plan)
    }

    fn take(
        &self,
        type_name: &str,
        field: &Field,
        branch: &Branch,
        path: &mut Vec<String>,
    ) -> Result<Take, SchemaError> {
        let wrong = || SchemaError::WrongKind {
            path: path.join("."),
            expected: branch.wanted_kind().to_owned(),
            found: match field.is_repeated {
                true => format!("an array of {}", field.kind()),
                false => field.kind().to_string(),
            },
        };
        match (field.kind(), field.is_repeated) {
            (FieldKind::Number(number), false) => {
                let slot = branch.single.ok_or_else(wrong)?;
                Ok(Take::Number(number, slot))
            }
            (FieldKind::Text, false) => branch.single.map(Take::Text).ok_or_else(wrong),
            (FieldKind::Number(number), true) => {
                let has_parts = branch.parts.is_some() || !branch.picks.is_empty();
                if has_parts || branch.all.is_none() && branch.elements.is_empty() {
                    return Err(wrong());
                }
                Ok(Take::Numbers {
                    number,
                    all: branch.all,
                    elements: branch.elements.clone(),
                })
            }
            (FieldKind::Text, true) => branch.all.map(Take::Texts).ok_or_else(wrong),
            (FieldKind::Message(part), is_repeated) => {
                let undefined = || SchemaError::UndefinedType {
                    type_name: type_name.to_owned(),
                    field: field.name.clone(),
                    part: part.to_owned(),
                };
                let fields = self.descriptors.fields(part).ok_or_else(undefined)?;
                if !is_repeated {
                    let tree = branch.part.as_ref().ok_or_else(wrong)?;
                    return Ok(Take::Part(self.message(part, fields, tree, path)?));
                }
                if branch.parts.is_none() && branch.picks.is_empty() {
                    return Err(wrong());
                }
                let mut plan_of = |tree: &PathTree| self.message(part, fields, tree, path);
                let picks = branch.picks.iter();
                Ok(Take::Parts {
                    all: branch.parts.as_ref().map(&mut plan_of).transpose()?,
                    picks: picks
                        .map(|(index, tree)| Ok((*index, plan_of(tree)?)))
                        .collect::<Result<_, _>>()?,
                })
            }
            (FieldKind::Group, _) => Err(wrong()),
        }
    }
}
