//! The URDF that guesses are based on: given, or from the log.

use std::path::Path;

use anyhow::{Context, Result};
use tipwatch_ingest::{Log, robot_descriptions};

use super::text::quoted;

/// A URDF for the guesses.
pub(super) struct Urdf {
    pub(super) text: String,
    /// Its name in messages.
    pub(super) name: String,
    /// Line of the machine file that names the URDF; `None` if it is in the log.
    pub(super) line: Option<String>,
}

pub(super) fn find_urdf(log: &Log, given: Option<&Path>, out: &Path) -> Result<Option<Urdf>> {
    let Some(path) = given else {
        let last = robot_descriptions(log)?.pop();
        return Ok(last.map(|last| Urdf {
            name: format!("topic {}", last.topic),
            text: last.text,
            line: None,
        }));
    };
    let unreadable = || format!("{}: cannot be read", path.display());
    let text = tipwatch_binding::read_text(path).with_context(unreadable)?;
    let absolute = path.canonicalize().with_context(unreadable)?;
    Ok(Some(Urdf {
        text,
        name: path.display().to_string(),
        line: Some(format!("urdf = {}", quoted(&beside(&absolute, out)))),
    }))
}

/// A file as a machine file at `out` names it: relative to its folder if it is in it, else from the root.
pub(super) fn beside(path: &Path, out: &Path) -> String {
    let absolute = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok();
    let within = folder.and_then(|folder| absolute.strip_prefix(folder).ok().map(Path::to_owned));
    within.unwrap_or(absolute).display().to_string()
}
