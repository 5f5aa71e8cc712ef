//! Definitions of message types in folders, as the packages of ROS have them: `PACKAGE/msg/NAME.msg`.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use super::{
    definition::{part_types, significant_lines},
    types::{Dialect, normal_type_name},
};

/// Levels of subfolders in which packages are looked for: a workspace has them in groups.
const MOST_NESTED: usize = 8;
/// Far above any definition.
const MOST_BYTES: u64 = 1 << 20;
/// Far above the parts of any type.
const MOST_PARTS: usize = 1000;

/// Definitions in folders that a person named.
#[derive(Debug, Default)]
pub(crate) struct GivenDefinitions {
    /// The files by type, such as `sensor_msgs/Imu`.
    files: BTreeMap<String, PathBuf>,
}

impl GivenDefinitions {
    /// Finds the definitions in folders and the folders in them.
    ///
    /// # Errors
    /// A folder or file cannot be read, or has no definitions; what was expected.
    pub(crate) fn find(folders: &[PathBuf]) -> Result<Self, (PathBuf, String)> {
        let mut found = Self::default();
        for folder in folders {
            let failed = |error: io::Error| (folder.clone(), error.to_string());
            // the name of a package may be that of the folder itself
            let real = folder.canonicalize().map_err(failed)?;
            let before = found.files.len();
            found.add(&real, MOST_NESTED)?;
            if found.files.len() == before {
                let problem = "expected files PACKAGE/msg/NAME.msg in it, found none";
                return Err((folder.clone(), problem.to_owned()));
            }
        }
        Ok(found)
    }

    fn add(&mut self, folder: &Path, levels: usize) -> Result<(), (PathBuf, String)> {
        let failed = |error: io::Error| (folder.to_path_buf(), error.to_string());
        let entries = fs::read_dir(folder).map_err(failed)?;
        let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        paths.sort();
        for path in paths {
            if path.is_dir() && levels > 0 {
                self.add(&path, levels - 1)?;
            } else if let Some(type_name) = type_of(&path) {
                let known = self.files.entry(type_name).or_insert_with(|| path.clone());
                if *known != path && !is_same(known, &path) {
                    let problem = format!("differs from {}: expected one of them", known.display());
                    return Err((path, problem));
                }
            }
        }
        Ok(())
    }

    /// The definition of a type with those of its parts behind it, as a recorder would embed it; `None` if there is
    /// none. A part without a file is left out.
    pub(crate) fn definition(&self, type_name: &str, dialect: Dialect) -> Option<String> {
        let root = normal_type_name(type_name);
        let mut text = self.fields(&root)?;
        let mut waiting = part_types(&text, &root, dialect);
        let mut done = vec![root];
        while let Some(part) = waiting.pop() {
            if done.contains(&part) || done.len() > MOST_PARTS {
                continue;
            }
            if let Some(fields) = self.fields(&part) {
                waiting.extend(part_types(&fields, &part, dialect));
                text += &format!("\n{}\nMSG: {part}\n{fields}", "=".repeat(80));
            }
            done.push(part);
        }
        Some(text)
    }

    fn fields(&self, type_name: &str) -> Option<String> {
        text_of(self.files.get(type_name)?)
    }
}

fn text_of(path: &Path) -> Option<String> {
    let length = fs::metadata(path).ok()?.len();
    let bytes = (length <= MOST_BYTES)
        .then(|| fs::read(path).ok())
        .flatten()?;
    Some(String::from_utf8_lossy(&bytes).into_owned())
}

/// The type that a file `PACKAGE/msg/NAME.msg` defines.
fn type_of(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?.strip_suffix(".msg")?;
    let folder = path.parent()?;
    let package = folder.parent()?.file_name()?.to_str()?;
    (folder.file_name()? == "msg").then(|| format!("{package}/{name}"))
}

/// Whether two files have the same fields: built and installed packages hold copies.
fn is_same(left: &Path, right: &Path) -> bool {
    let (left, right) = (text_of(left), text_of(right));
    match (&left, &right) {
        (Some(left), Some(right)) => significant_lines(left).eq(significant_lines(right)),
        _ => false,
    }
}
