//! Paths to fields as a tree of names, for encodings in which a message tells its own structure.

use super::field_path::{Elements, FieldPath, Step};

/// What is wanted of a message.
#[derive(Debug, Clone, Default)]
pub(crate) struct PathTree {
    pub(crate) branches: Vec<Branch>,
}

/// What is wanted of one field.
#[derive(Debug, Clone, Default)]
pub(crate) struct Branch {
    pub(crate) name: String,
    /// Where the value goes, if it is a number or string.
    pub(crate) single: Option<usize>,
    /// Where all numbers or strings of an array go.
    pub(crate) all: Option<usize>,
    /// Elements of an array and where they go.
    pub(crate) elements: Vec<(usize, usize)>,
    /// Of a field that is a message.
    pub(crate) part: Option<PathTree>,
    /// Of each message of an array.
    pub(crate) parts: Option<PathTree>,
}

/// Other names of the two parts of a stamp.
const STAMP_NAMES: [(&str, &[&str]); 2] = [
    ("sec", &["secs", "seconds"]),
    ("nanosec", &["nanos", "nsec", "nsecs", "nanoseconds"]),
];

impl PathTree {
    pub(crate) fn new(paths: &[FieldPath]) -> Self {
        let mut tree = Self::default();
        for (slot, path) in paths.iter().enumerate() {
            tree.add(&path.steps, slot);
        }
        tree
    }

    fn add(&mut self, steps: &[Step], slot: usize) {
        let [step, rest @ ..] = steps else { return };
        let place = match self
            .branches
            .iter()
            .position(|known| known.name == step.name)
        {
            Some(place) => place,
            None => {
                self.branches.push(Branch {
                    name: step.name.clone(),
                    ..Branch::default()
                });
                self.branches.len() - 1
            }
        };
        let branch = &mut self.branches[place];
        match (step.elements, rest.is_empty()) {
            (Elements::None, true) => branch.single = Some(slot),
            (Elements::All, true) => branch.all = Some(slot),
            (Elements::At(index), true) => branch.elements.push((index as usize, slot)),
            (Elements::None, false) => {
                branch.part.get_or_insert_default().add(rest, slot);
            }
            (Elements::All | Elements::At(_), false) => {
                branch.parts.get_or_insert_default().add(rest, slot);
            }
        }
    }

    /// What is wanted of a field of this name, under which writers also know it.
    pub(crate) fn branch(&self, name: &str) -> Option<&Branch> {
        self.branches.iter().find(|branch| branch.is_called(name))
    }
}

impl Branch {
    /// What kind of field is wanted, for a complaint that it is of another.
    pub(crate) fn wanted_kind(&self) -> &'static str {
        match self {
            Self {
                single: Some(_), ..
            } => "a number or string",
            Self { part: Some(_), .. } => "a message",
            Self { parts: Some(_), .. } => "an array of messages",
            _ => "an array of numbers or strings",
        }
    }

    /// Whether a field of this name is meant.
    pub(crate) fn is_called(&self, name: &str) -> bool {
        let is_alias =
            |(usual, others): &(&str, &[&str])| *usual == self.name && others.contains(&name);
        self.name == name || STAMP_NAMES.iter().any(is_alias)
    }
}
