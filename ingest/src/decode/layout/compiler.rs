//! Compiles the wanted fields of a message type into steps.

use super::block::Block;
use crate::{
    decode::binary::{Count, Element, Op, Pick},
    schema::{
        Definitions, Dialect, Elements, Field, FieldPath, FieldType, NumberType, PathStep,
        Repetition, SchemaError,
    },
};

/// Types nested deeper than this are taken as recursive.
const MAX_DEPTH: usize = 32;
/// Limit on the number of fields visited.
const MAX_STEPS: usize = 100_000;

/// The steps, and the slots that collect one value per element of an array of messages.
pub(super) fn compile(
    definitions: &Definitions,
    paths: &[FieldPath],
) -> Result<(Vec<Op>, Vec<usize>), SchemaError> {
    let mut compiler = Compiler {
        definitions,
        paths,
        collecting: Vec::new(),
        budget: MAX_STEPS,
    };
    let wants = paths.iter().enumerate().map(|(slot, path)| Want {
        slot,
        rest: &path.steps,
    });
    let wants: Vec<Want<'_>> = wants.collect();
    let mut block = Block::default();
    compiler.message(&definitions.root, &wants, Occurrence::Once, 0, &mut block)?;
    let steps = block.up_to_last_read()?;
    Ok((steps, compiler.collecting))
}

/// A path and the part of it not yet resolved.
#[derive(Clone, Copy)]
struct Want<'p> {
    slot: usize,
    rest: &'p [PathStep],
}

/// Number of occurrences of a message: once, or as the elements of an array.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Occurrence {
    Once,
    InArray,
}

struct Compiler<'c> {
    definitions: &'c Definitions,
    paths: &'c [FieldPath],
    collecting: Vec<usize>,
    budget: usize,
}

impl<'c> Compiler<'c> {
    fn dialect(&self) -> Dialect {
        self.definitions.dialect
    }

    fn message(
        &mut self,
        type_name: &str,
        wants: &[Want<'_>],
        occurrence: Occurrence,
        depth: usize,
        block: &mut Block,
    ) -> Result<(), SchemaError> {
        if depth > MAX_DEPTH {
            return Err(self.too_large());
        }
        // Copied out of `self`, so that the fields stay borrowed while steps are added.
        let definitions = self.definitions;
        let fields = definitions.fields(type_name);
        self.check_names(type_name, fields, wants)?;
        if fields.is_empty() && self.dialect() == Dialect::Ros2 {
            // ROS 2 encodes a message without fields as one byte.
            block.skip(NumberType::U8, 1, Dialect::Ros2);
        }
        for field in fields {
            self.budget = self.budget.checked_sub(1).ok_or_else(|| self.too_large())?;
            let of_field =
                |want: &&Want<'_>| want.rest.first().is_some_and(|s| s.name == field.name);
            let field_wants: Vec<Want<'_>> = wants.iter().filter(of_field).copied().collect();
            self.field(type_name, field, &field_wants, occurrence, depth, block)?;
        }
        Ok(())
    }

    fn field(
        &mut self,
        type_name: &str,
        field: &Field,
        wants: &[Want<'_>],
        occurrence: Occurrence,
        depth: usize,
        block: &mut Block,
    ) -> Result<(), SchemaError> {
        match &field.field_type {
            FieldType::Number(number) => self.number(field, *number, wants, occurrence, block),
            FieldType::Text => self.text(field, wants, occurrence, block),
            FieldType::WideText => {
                if let Some(want) = wants.first() {
                    return Err(self.wrong_kind(want, field));
                }
                let name = format!("{type_name}.{}", field.name);
                block.barrier.get_or_insert((block.steps.len(), name));
                Ok(())
            }
            FieldType::Message(part) => self.part(field, part, wants, occurrence, depth, block),
        }
    }

    fn number(
        &mut self,
        field: &Field,
        number: NumberType,
        wants: &[Want<'_>],
        occurrence: Occurrence,
        block: &mut Block,
    ) -> Result<(), SchemaError> {
        if wants.is_empty() {
            match field.repetition {
                Repetition::Once => block.skip(number, 1, self.dialect()),
                Repetition::Fixed(count) => block.skip(number, count, self.dialect()),
                Repetition::Sequence => block.steps.push(Op::SkipSequence { number }),
            }
            return Ok(());
        }
        if field.repetition == Repetition::Once {
            let want = self.only_plain(field, wants)?;
            match occurrence {
                Occurrence::Once => block.read_number(number, want.slot),
                Occurrence::InArray => {
                    self.collecting.push(want.slot);
                    block.read(Op::CollectNumber {
                        number,
                        slot: want.slot,
                    });
                }
            }
            return Ok(());
        }
        let mut whole = None;
        let mut elements = Vec::new();
        for want in wants {
            match (selected(want), occurrence) {
                (Some(Elements::All), Occurrence::Once) => whole = Some(want.slot),
                (Some(Elements::At(index)), Occurrence::Once) => elements.push(Element {
                    index: index as usize,
                    slot: want.slot,
                }),
                _ => return Err(self.wrong_kind(want, field)),
            }
        }
        block.read(Op::NumberArray {
            number,
            count: count_of(field),
            whole,
            elements,
        });
        Ok(())
    }

    fn text(
        &mut self,
        field: &Field,
        wants: &[Want<'_>],
        occurrence: Occurrence,
        block: &mut Block,
    ) -> Result<(), SchemaError> {
        if wants.is_empty() {
            block.steps.push(Op::SkipTexts {
                count: count_of(field),
            });
            return Ok(());
        }
        if field.repetition == Repetition::Once {
            let want = self.only_plain(field, wants)?;
            match occurrence {
                Occurrence::Once => block.read(Op::Text { slot: want.slot }),
                Occurrence::InArray => {
                    self.collecting.push(want.slot);
                    block.read(Op::CollectText { slot: want.slot });
                }
            }
            return Ok(());
        }
        match wants {
            [want] if occurrence == Occurrence::Once && selected(want) == Some(Elements::All) => {
                block.read(Op::Texts {
                    count: count_of(field),
                    slot: want.slot,
                });
                Ok(())
            }
            _ => Err(self.wrong_kind(&wants[0], field)),
        }
    }

    /// A field that is a nested message.
    fn part(
        &mut self,
        field: &Field,
        part: &str,
        wants: &[Want<'_>],
        occurrence: Occurrence,
        depth: usize,
        block: &mut Block,
    ) -> Result<(), SchemaError> {
        let is_array = field.repetition != Repetition::Once;
        let (mut inner_wants, mut picked) = (Vec::new(), Vec::new());
        for want in wants {
            let [step, rest @ ..] = want.rest else {
                return Err(self.wrong_kind(want, field));
            };
            let inner = Want {
                slot: want.slot,
                rest,
            };
            match step.elements {
                _ if rest.is_empty() => return Err(self.wrong_kind(want, field)),
                Elements::None if !is_array => inner_wants.push(inner),
                Elements::All if is_array => inner_wants.push(inner),
                Elements::At(index) if is_array => picked.push((index as usize, inner)),
                _ => return Err(self.wrong_kind(want, field)),
            }
        }
        if !is_array {
            return self.message(part, &inner_wants, occurrence, depth + 1, block);
        }
        // what is collected from every message is not read into a slot of its own
        let is_mixed = !inner_wants.is_empty() && !picked.is_empty();
        let mut all = picked.iter().map(|(_, want)| want).chain(&inner_wants);
        if (occurrence == Occurrence::InArray || is_mixed)
            && let Some(want) = all.next()
        {
            return Err(self.wrong_kind(want, field));
        }
        let mut body = Block::default();
        self.message(
            part,
            &inner_wants,
            Occurrence::InArray,
            depth + 1,
            &mut body,
        )?;
        if let Some((_, name)) = body.barrier {
            block.barrier.get_or_insert((block.steps.len(), name));
        }
        if body.steps.is_empty() {
            // In ROS 1 messages without fields take no bytes; only their count is encoded.
            if field.repetition == Repetition::Sequence {
                block.skip(NumberType::U32, 1, self.dialect());
            }
            return Ok(());
        }
        let count = count_of(field);
        if !picked.is_empty() {
            let picks = self.picks(part, &picked, depth)?;
            let slots = picked.iter().map(|(_, want)| want.slot).collect();
            block.read(Op::RepeatExcept {
                count,
                body: body.steps,
                picks,
                slots,
            });
            return Ok(());
        }
        let step = Op::Repeat {
            count,
            body: body.steps,
        };
        if inner_wants.is_empty() {
            block.steps.push(step);
        } else {
            block.read(step);
        }
        Ok(())
    }

    /// The steps for the messages in an array of which something is wanted.
    fn picks(
        &mut self,
        part: &str,
        picked: &[(usize, Want<'_>)],
        depth: usize,
    ) -> Result<Vec<Pick>, SchemaError> {
        let mut indices: Vec<usize> = picked.iter().map(|(index, _)| *index).collect();
        indices.sort_unstable();
        indices.dedup();
        let mut picks = Vec::with_capacity(indices.len());
        for index in indices {
            let of_index = picked.iter().filter(|(at, _)| *at == index);
            let wants: Vec<Want<'_>> = of_index.map(|(_, want)| *want).collect();
            let mut body = Block::default();
            self.message(part, &wants, Occurrence::Once, depth + 1, &mut body)?;
            picks.push(Pick {
                index,
                body: body.steps,
            });
        }
        Ok(picks)
    }

    /// The only path to a field that is not an array.
    fn only_plain<'w>(
        &self,
        field: &Field,
        wants: &'w [Want<'w>],
    ) -> Result<&'w Want<'w>, SchemaError> {
        for want in wants {
            if selected(want) != Some(Elements::None) {
                return Err(self.wrong_kind(want, field));
            }
        }
        // Duplicate paths were rejected before, so there is exactly one.
        Ok(&wants[0])
    }

    fn check_names(
        &self,
        type_name: &str,
        fields: &[Field],
        wants: &[Want<'_>],
    ) -> Result<(), SchemaError> {
        for want in wants {
            let name = want.rest.first().map_or("", |step| &step.name);
            if !fields.iter().any(|field| field.name == name) {
                return Err(SchemaError::NoSuchField {
                    path: self.path_text(want),
                    type_name: type_name.to_owned(),
                    fields: fields.iter().map(|field| field.name.clone()).collect(),
                });
            }
        }
        Ok(())
    }

    fn wrong_kind(&self, want: &Want<'_>, field: &Field) -> SchemaError {
        let first = want.rest.first().map(|step| step.elements);
        let expected = match (first, want.rest.len()) {
            (Some(Elements::None), 1) => "a number or string",
            (Some(Elements::All), 1) => "an array of numbers or strings",
            (_, 1) => "an array of numbers",
            (Some(Elements::None), _) => "a message",
            _ => "an array of messages, with one value of each",
        };
        let element = match &field.field_type {
            FieldType::Number(_) => "number".to_owned(),
            FieldType::Text => "string".to_owned(),
            FieldType::WideText => "wstring".to_owned(),
            FieldType::Message(part) => format!("message {part}"),
        };
        let found = match field.repetition {
            Repetition::Once => element,
            Repetition::Fixed(count) => format!("an array of {count} of {element}"),
            Repetition::Sequence => format!("an array of {element}"),
        };
        SchemaError::WrongKind {
            path: self.path_text(want),
            expected: expected.to_owned(),
            found,
        }
    }

    fn path_text(&self, want: &Want<'_>) -> String {
        self.paths
            .get(want.slot)
            .map(ToString::to_string)
            .unwrap_or_default()
    }

    fn too_large(&self) -> SchemaError {
        SchemaError::TooLarge {
            type_name: self.definitions.root.clone(),
        }
    }
}

/// Returns the elements of its last field that a path selects; `None` where further steps follow.
fn selected(want: &Want<'_>) -> Option<Elements> {
    match want.rest {
        [step] => Some(step.elements),
        _ => None,
    }
}

fn count_of(field: &Field) -> Count {
    match field.repetition {
        Repetition::Once => Count::Fixed(1),
        Repetition::Fixed(count) => Count::Fixed(count as usize),
        Repetition::Sequence => Count::InMessage,
    }
}
