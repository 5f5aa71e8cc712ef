//! Field paths as a tree of names, for self-describing encodings.

use super::field_path::{Elements, FieldPath, PathStep};

/// The wanted fields of a message.
#[derive(Debug, Clone, Default)]
pub(crate) struct PathTree {
    pub(crate) branches: Vec<Branch>,
}

/// Wanted content of one field.
#[derive(Debug, Clone, Default)]
pub(crate) struct Branch {
    pub(crate) name: String,
    /// The slot of a single number or string.
    pub(crate) single: Option<usize>,
    /// The slot of all numbers or strings of an array.
    pub(crate) all: Option<usize>,
    /// Single elements of an array and their slots.
    pub(crate) elements: Vec<(usize, usize)>,
    /// The wanted fields of a nested message.
    pub(crate) part: Option<PathTree>,
    /// The wanted fields of each message in an array.
    pub(crate) parts: Option<PathTree>,
    /// The wanted fields of single messages in an array, by their index.
    pub(crate) picks: Vec<(usize, PathTree)>,
}

/// Alternative names of the two fields of a stamp.
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

    fn add(&mut self, steps: &[PathStep], slot: usize) {
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
            (Elements::All, false) => {
                branch.parts.get_or_insert_default().add(rest, slot);
            }
            (Elements::At(index), false) => {
                let index = index as usize;
                let known = branch.picks.iter().position(|(at, _)| *at == index);
                let place = known.unwrap_or_else(|| {
                    branch.picks.push((index, PathTree::default()));
                    branch.picks.len() - 1
                });
                branch.picks[place].1.add(rest, slot);
            }
        }
    }

    /// The slots of what a message has once: single numbers and strings, those of nested messages, and single elements of arrays.
    pub(crate) fn singles(&self) -> Vec<usize> {
        let mut slots = Vec::new();
        self.add_singles(&mut slots);
        slots
    }

    fn add_singles(&self, slots: &mut Vec<usize>) {
        for branch in &self.branches {
            slots.extend(branch.single);
            slots.extend(branch.elements.iter().map(|(_, slot)| slot));
            let picks = branch.picks.iter().map(|(_, tree)| tree);
            for tree in branch.part.iter().chain(picks) {
                tree.add_singles(slots);
            }
        }
    }

    /// Returns the wanted content of a field with this name or one of its alternatives.
    pub(crate) fn branch(&self, name: &str) -> Option<&Branch> {
        self.branches.iter().find(|branch| branch.is_called(name))
    }
}

impl Branch {
    /// The expected kind of field, for error messages.
    pub(crate) fn wanted_kind(&self) -> &'static str {
        match self {
            Self {
                single: Some(_), ..
            } => "a number or string",
            Self { part: Some(_), .. } => "a message",
            Self { parts: Some(_), .. } => "an array of messages",
            Self { picks, .. } if !picks.is_empty() => "an array of messages",
            _ => "an array of numbers or strings",
        }
    }

    /// Whether this branch accepts the name.
    pub(crate) fn is_called(&self, name: &str) -> bool {
        let is_alias =
            |(usual, others): &(&str, &[&str])| *usual == self.name && others.contains(&name);
        self.name == name || STAMP_NAMES.iter().any(is_alias)
    }
}
