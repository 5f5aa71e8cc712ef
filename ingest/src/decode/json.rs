//! Reads the wanted fields of a JSON message. Other fields are skipped, never stored.

use std::fmt;

use serde::{
    Deserialize as _,
    de::{
        DeserializeSeed, Deserializer as _, IgnoredAny, MapAccess, SeqAccess, Unexpected, Visitor,
    },
};

use super::{
    error::DecodeError,
    fields::Fields,
    path_collector::{Collector, MOST_PARTS},
};
use crate::schema::{Branch, PathTree};

/// Reads one message. Fields that it lacks keep their values.
pub(crate) fn run(tree: &PathTree, json: &[u8], fields: &mut Fields) -> Result<(), DecodeError> {
    let mut deserializer = serde_json::Deserializer::from_slice(json);
    let message = MessageVisitor {
        tree,
        fields,
        is_in_array: false,
    };
    deserializer
        .deserialize_map(message)
        .and_then(|()| deserializer.end())
        .map_err(|error| DecodeError::Json {
            line: error.line(),
            column: error.column(),
            problem: match error.classify() {
                serde_json::error::Category::Eof => "the message is truncated",
                serde_json::error::Category::Data => "expected an object",
                _ => "not valid JSON",
            },
        })
}

/// Collects the paths of the numbers in a message.
pub(super) fn number_paths(json: &[u8], found: &mut Collector) {
    if let Ok(serde_json::Value::Object(message)) = serde_json::from_slice(json) {
        collect(&message, "", 0, found);
    }
}

fn collect(
    message: &serde_json::Map<String, serde_json::Value>,
    prefix: &str,
    depth: usize,
    found: &mut Collector,
) {
    use serde_json::Value::{Array, Bool, Number, Object};
    let is_name = |name: &str| name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    for (name, value) in message.iter().filter(|(name, _)| is_name(name)) {
        let path = format!("{prefix}{name}");
        if found.is_full(depth) {
            return;
        }
        match value {
            Number(_) | Bool(_) => found.number(path),
            Object(part) => collect(part, &format!("{path}."), depth + 1, found),
            Array(elements) => collect_elements(elements, &path, depth, found),
            _ => {}
        }
    }
}

fn collect_elements(
    elements: &[serde_json::Value],
    path: &str,
    depth: usize,
    found: &mut Collector,
) {
    use serde_json::Value::{Array, Bool, Number, Object};
    let count = u32::try_from(elements.len()).unwrap_or(u32::MAX);
    let first = elements.iter().find(|element| !element.is_null());
    match first {
        Some(Number(_) | Bool(_)) => found.numbers(path, Some(count)),
        Some(Object(part)) => {
            for prefix in Collector::parts(path, Some(count)) {
                collect(part, &prefix, depth + 1, found);
            }
        }
        Some(Array(_)) => {
            for (index, element) in elements.iter().take(MOST_PARTS as usize).enumerate() {
                if let Array(inner) = element
                    && !found.is_full(depth)
                {
                    collect_elements(inner, &format!("{path}[{index}]"), depth + 1, found);
                }
            }
        }
        _ => {}
    }
}

/// Reads an object into the slots of its fields, or a list that is an element of another.
struct MessageVisitor<'t, 'f> {
    tree: &'t PathTree,
    fields: &'f mut Fields,
    is_in_array: bool,
}

impl<'de> Visitor<'de> for MessageVisitor<'_, '_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(branch) = map.next_key_seed(Key(self.tree))? {
            match branch {
                Some(branch) => map.next_value_seed(Value {
                    branch,
                    fields: &mut *self.fields,
                    is_in_array: self.is_in_array,
                })?,
                None => {
                    map.next_value::<IgnoredAny>()?;
                }
            }
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, sequence: A) -> Result<(), A::Error> {
        let Some(branch) = self.tree.branch("") else {
            return Err(serde::de::Error::invalid_type(Unexpected::Seq, &self));
        };
        let list = Value {
            branch,
            fields: self.fields,
            is_in_array: self.is_in_array,
        };
        list.visit_seq(sequence)
    }
}

/// Looks up a field by name without storing the name.
struct Key<'t>(&'t PathTree);

impl<'de, 't> DeserializeSeed<'de> for Key<'t> {
    type Value = Option<&'t Branch>;

    fn deserialize<D: serde::Deserializer<'de>>(
        self,
        deserializer: D,
    ) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl<'t> Visitor<'_> for Key<'t> {
    type Value = Option<&'t Branch>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("the name of a field")
    }

    fn visit_str<E>(self, name: &str) -> Result<Self::Value, E> {
        Ok(self.0.branch(name))
    }
}

/// Reads the value of a field into its slot; a value of another kind is skipped.
struct Value<'t, 'f> {
    branch: &'t Branch,
    fields: &'f mut Fields,
    is_in_array: bool,
}

impl Value<'_, '_> {
    fn number(self, value: f64) {
        if let Some(slot) = self.branch.single {
            self.fields.take_number(slot, value, self.is_in_array);
        }
    }
}

impl<'de> DeserializeSeed<'de> for Value<'_, '_> {
    type Value = ();

    fn deserialize<D: serde::Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Value<'_, '_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("any value")
    }

    fn visit_f64<E>(self, value: f64) -> Result<(), E> {
        self.number(value);
        Ok(())
    }

    fn visit_u64<E>(self, value: u64) -> Result<(), E> {
        self.number(value as f64);
        Ok(())
    }

    fn visit_i64<E>(self, value: i64) -> Result<(), E> {
        self.number(value as f64);
        Ok(())
    }

    fn visit_bool<E>(self, value: bool) -> Result<(), E> {
        self.number(f64::from(u8::from(value)));
        Ok(())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        // Writers often encode NaN as null.
        self.number(f64::NAN);
        Ok(())
    }

    fn visit_str<E>(self, text: &str) -> Result<(), E> {
        let Some(slot) = self.branch.single else {
            return Ok(());
        };
        // Some writers quote large integers, and values that JSON numbers cannot express.
        if let Ok(number) = text.parse() {
            self.fields.take_number(slot, number, self.is_in_array);
        }
        self.fields
            .take_text(slot, text.as_bytes(), self.is_in_array);
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<(), A::Error> {
        let mut index = 0;
        loop {
            let element = Element {
                branch: self.branch,
                fields: &mut *self.fields,
                index,
                is_in_array: self.is_in_array,
            };
            if sequence.next_element_seed(element)?.is_none() {
                return Ok(());
            }
            index += 1;
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<(), A::Error> {
        let nothing = PathTree::default();
        let message = MessageVisitor {
            tree: self.branch.part.as_ref().unwrap_or(&nothing),
            fields: self.fields,
            is_in_array: self.is_in_array,
        };
        message.visit_map(map)
    }
}

/// Reads an element of an array that is an object or a list; missing parts are missing among those of all elements.
impl<'de> DeserializeSeed<'de> for MessageVisitor<'_, '_> {
    type Value = ();

    fn deserialize<D: serde::Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        let Self {
            tree,
            fields,
            is_in_array,
        } = self;
        let read = |fields: &mut Fields| {
            deserializer.deserialize_any(MessageVisitor {
                tree,
                fields,
                is_in_array,
            })
        };
        match is_in_array {
            true => fields.element(&tree.singles(), read),
            false => read(fields),
        }
    }
}

/// One element of an array, with the fields wanted of all elements and those of this one alone.
struct Element<'t, 'f> {
    branch: &'t Branch,
    fields: &'f mut Fields,
    index: usize,
    is_in_array: bool,
}

impl Element<'_, '_> {
    /// The slot of an element that is a number or string, and whether it holds those of all elements.
    fn slot(&self) -> Option<(usize, bool)> {
        let mut places = self.branch.elements.iter();
        let own = places.find(|(index, _)| *index == self.index);
        match self.branch.all {
            Some(slot) => Some((slot, true)),
            None => own.map(|(_, slot)| (*slot, self.is_in_array)),
        }
    }
}

impl<'de> DeserializeSeed<'de> for Element<'_, '_> {
    type Value = ();

    fn deserialize<D: serde::Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        let slot = self.slot();
        let mut picks = self.branch.picks.iter();
        let pick = picks.find(|(at, _)| *at == self.index);
        let pick = pick.map(|(_, tree)| (tree, self.is_in_array));
        let all = self.branch.parts.as_ref().map(|tree| (tree, true));
        let fields = self.fields;
        match (slot, pick, all) {
            (None, None, None) => deserializer.deserialize_ignored_any(IgnoredAny).map(|_| ()),
            (Some(slot), None, None) => read_single(slot, fields, deserializer),
            (None, None, Some((tree, is_in_array))) => MessageVisitor {
                tree,
                fields,
                is_in_array,
            }
            .deserialize(deserializer),
            // read several times
            _ => {
                let element = serde_json::Value::deserialize(deserializer)?;
                for (tree, is_in_array) in pick.into_iter().chain(all) {
                    let fields = &mut *fields;
                    let part = MessageVisitor {
                        tree,
                        fields,
                        is_in_array,
                    };
                    let _ = part.deserialize(&element);
                }
                if let Some(slot) = slot {
                    let _ = read_single(slot, fields, &element);
                }
                Ok(())
            }
        }
    }
}

/// Reads a number or string of an array like a single field.
fn read_single<'de, D: serde::Deserializer<'de>>(
    (slot, is_in_array): (usize, bool),
    fields: &mut Fields,
    deserializer: D,
) -> Result<(), D::Error> {
    let branch = Branch {
        single: Some(slot),
        ..Branch::default()
    };
    deserializer.deserialize_any(Value {
        branch: &branch,
        fields,
        is_in_array,
    })
}
