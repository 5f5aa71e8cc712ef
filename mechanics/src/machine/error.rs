//! Errors of a machine description: what was expected, what was found, and where.

use super::impossible_inertia::{ImpossibleInertia, told};

/// An invalid machine description.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MachineError {
    /// The text is not valid TOML, or a key is unknown, missing or of the wrong type.
    #[error("{file}: {message}")]
    MachineFile {
        /// Name of the machine file.
        file: String,
        /// The parser's message with line and column.
        message: String,
    },
    /// The text is not valid XML, or an element lacks what URDF requires.
    #[error("{file}, line {line}: expected {expected}, found {found}")]
    Urdf {
        /// Name of the URDF.
        file: String,
        /// Line of the element, counted from 1.
        line: u32,
        /// The content that URDF requires there.
        expected: String,
        /// The content of the URDF there.
        found: String,
    },
    /// Several errors of one file, all that were found.
    #[error("{file}: {} errors:{}", errors.len(), listed(errors))]
    Several {
        /// Name of the file.
        file: String,
        /// The errors in file order.
        errors: Vec<MachineError>,
    },
    /// Inertias of the URDF that no body has.
    #[error("{file}: {}", told(inertias))]
    Inertias {
        /// Name of the URDF.
        file: String,
        /// The impossible inertias, with the replacement of each.
        inertias: Vec<ImpossibleInertia>,
    },
    /// A name in the machine file that is not in the URDF.
    #[error(
        "{file}: {key} = \"{name}\": expected a {kind} of {urdf}, found no {kind} with that name{suggestion}"
    )]
    UnknownName {
        /// Name of the machine file.
        file: String,
        /// Key path in the machine file.
        key: String,
        /// The unknown name.
        name: String,
        /// "link" or "joint".
        kind: &'static str,
        /// Name of the URDF.
        urdf: String,
        /// The closest existing name as "; did you mean ...?", or empty.
        suggestion: String,
    },
    /// An invalid value.
    #[error("{file}: {place}: expected {expected}, found {found}")]
    Value {
        /// Name of the file.
        file: String,
        /// Key path, link or joint.
        place: String,
        /// The accepted values, in words.
        expected: String,
        /// The invalid value.
        found: String,
    },
    /// A value that no machine has: another unit, a mix-up or something missing.
    #[error("{file}: {place}: expected {expected}, found {found}. {remedy}")]
    Implausible {
        /// Name of the file.
        file: String,
        /// Key path or link.
        place: String,
        /// The plausible values, in words.
        expected: String,
        /// The implausible value.
        found: String,
        /// The likely correction.
        remedy: String,
    },
    /// A closed chain that cannot close.
    #[error("{file}: linkage \"{linkage}\" cannot close: expected {expected}, found {found}")]
    LinkageCannotClose {
        /// Name of the machine file.
        file: String,
        /// Name of the linkage.
        linkage: String,
        /// The condition of closure.
        expected: String,
        /// The values that the geometry gives.
        found: String,
    },
    /// Movable joints without a source of their position.
    #[error(
        "joint {joints} of {urdf}: expected a position in the log's joint states, a linkage that moves it, or a mimic rule; \
         found none (the log has: {logged}). Describe the cylinder that moves it ([[linkage]]), or hold it still with a constant: \
         position = 0.0 in [signals.joints.NAME]; `inspect --write-machine` guesses both (with --freeze-passive)"
    )]
    UnmeasuredJoints {
        /// The joints, comma-separated.
        joints: String,
        /// Name of the URDF.
        urdf: String,
        /// Joint names in the log.
        logged: String,
    },
}

/// Errors listed; more of them have the same cause.
const MOST_LISTED: usize = 50;

fn listed(errors: &[MachineError]) -> String {
    let lines = errors.iter().take(MOST_LISTED);
    let mut text: String = lines.map(|error| format!("\n- {error}")).collect();
    if errors.len() > MOST_LISTED {
        text += &format!("\n- and {} more", errors.len() - MOST_LISTED);
    }
    text
}

impl MachineError {
    /// All errors of a file as one; `None` without any.
    pub(super) fn all(file: &str, mut errors: Vec<Self>) -> Option<Self> {
        match errors.len() {
            0 | 1 => errors.pop(),
            _ => Some(Self::Several {
                file: file.into(),
                errors,
            }),
        }
    }

    pub(super) fn value(
        file: &str,
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> Self {
        Self::Value {
            file: file.into(),
            place: place.into(),
            expected: expected.into(),
            found: found.to_string(),
        }
    }
}
