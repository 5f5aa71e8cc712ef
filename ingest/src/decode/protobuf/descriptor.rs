//! Parses a `FileDescriptorSet`, itself a protobuf message.

use std::{collections::HashMap, fmt};

use super::wire::{self, Item, Number};

/// Deeper nesting is taken as damage.
const MAX_DEPTH: usize = 32;

/// The message types of a set, by full name without a leading dot.
#[derive(Default)]
pub(super) struct Descriptors {
    messages: HashMap<String, Vec<Field>>,
}

/// A field of a message.
#[derive(Debug, Clone, Default)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) number: u64,
    pub(super) is_repeated: bool,
    /// Whether the absence of the field differs from zero.
    pub(super) has_presence: bool,
    kind: u64,
    type_name: String,
}

/// The kind of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FieldKind<'d> {
    Number(Number),
    /// A string or bytes.
    Text,
    Message(&'d str),
    /// A proto2 group.
    Group,
}

impl fmt::Display for FieldKind<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(_) => formatter.write_str("number"),
            Self::Text => formatter.write_str("string"),
            Self::Message(name) => write!(formatter, "message {name}"),
            Self::Group => formatter.write_str("group"),
        }
    }
}

impl Field {
    pub(super) fn kind(&self) -> FieldKind<'_> {
        FieldKind::Number(match self.kind {
            1 => Number::F64,
            2 => Number::F32,
            3 => Number::I64,
            4 => Number::U64,
            // An enumeration is encoded as an integer.
            5 | 14 => Number::I32,
            6 => Number::Fixed64,
            7 => Number::Fixed32,
            8 => Number::Bool,
            13 => Number::U32,
            15 => Number::SignedFixed32,
            16 => Number::SignedFixed64,
            17 | 18 => Number::ZigZag,
            9 | 12 => return FieldKind::Text,
            11 => return FieldKind::Message(self.type_name.trim_start_matches('.')),
            _ => return FieldKind::Group,
        })
    }
}

impl Descriptors {
    /// `None` if the bytes are not a descriptor set.
    pub(super) fn parse(set: &[u8]) -> Option<Self> {
        const FILE: u64 = 1;
        let mut descriptors = Self::default();
        for item in wire::items(set) {
            if let (FILE, Item::Bytes(file)) = item? {
                descriptors.file(file)?;
            }
        }
        Some(descriptors)
    }

    pub(super) fn fields(&self, message: &str) -> Option<&[Field]> {
        self.messages.get(message).map(Vec::as_slice)
    }

    fn file(&mut self, file: &[u8]) -> Option<()> {
        const PACKAGE: u64 = 2;
        const MESSAGE: u64 = 4;
        const SYNTAX: u64 = 12;
        let mut package = "";
        let mut is_proto3 = false;
        for item in wire::items(file) {
            match item? {
                (PACKAGE, Item::Bytes(name)) => package = std::str::from_utf8(name).ok()?,
                (SYNTAX, Item::Bytes(syntax)) => is_proto3 = syntax == b"proto3",
                _ => {}
            }
        }
        for item in wire::items(file) {
            if let (MESSAGE, Item::Bytes(message)) = item? {
                self.message(message, package, is_proto3, 0)?;
            }
        }
        Some(())
    }

    fn message(
        &mut self,
        message: &[u8],
        scope: &str,
        is_proto3: bool,
        depth: usize,
    ) -> Option<()> {
        const NAME: u64 = 1;
        const FIELD: u64 = 2;
        const NESTED: u64 = 3;
        if depth > MAX_DEPTH {
            return None;
        }
        let mut name = "";
        let mut fields = Vec::new();
        for item in wire::items(message) {
            match item? {
                (NAME, Item::Bytes(bytes)) => name = std::str::from_utf8(bytes).ok()?,
                (FIELD, Item::Bytes(bytes)) => fields.push(field(bytes, is_proto3)?),
                _ => {}
            }
        }
        let full_name = match scope {
            "" => name.to_owned(),
            scope => format!("{scope}.{name}"),
        };
        for item in wire::items(message) {
            if let (NESTED, Item::Bytes(nested)) = item? {
                self.message(nested, &full_name, is_proto3, depth + 1)?;
            }
        }
        self.messages.insert(full_name, fields);
        Some(())
    }
}

fn field(bytes: &[u8], is_proto3: bool) -> Option<Field> {
    const NAME: u64 = 1;
    const NUMBER: u64 = 3;
    const LABEL: u64 = 4;
    const KIND: u64 = 5;
    const TYPE_NAME: u64 = 6;
    const ONE_OF: u64 = 9;
    const REPEATED: u64 = 3;
    let mut field = Field {
        has_presence: !is_proto3,
        ..Field::default()
    };
    for item in wire::items(bytes) {
        match item? {
            (NAME, Item::Bytes(name)) => field.name = std::str::from_utf8(name).ok()?.to_owned(),
            (TYPE_NAME, Item::Bytes(name)) => {
                field.type_name = std::str::from_utf8(name).ok()?.to_owned();
            }
            (NUMBER, Item::Varint(number)) => field.number = number,
            (LABEL, Item::Varint(label)) => field.is_repeated = label == REPEATED,
            (KIND, Item::Varint(kind)) => field.kind = kind,
            // An optional field is encoded as a oneof with a single member.
            (ONE_OF, Item::Varint(_)) => field.has_presence = true,
            _ => {}
        }
    }
    Some(field)
}
