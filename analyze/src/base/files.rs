//! Atomic replacement of files: a reader sees the old file or the new one, never a part.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result};
use tempfile::TempPath;
use tipwatch_storage::UNFINISHED;

/// Replaces a file by these bytes.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let (mut file, unfinished) = begin(path)?;
    let written = file.write_all(bytes);
    drop(file);
    let replaced = written.and_then(|()| Ok(unfinished.persist(path)?));
    replaced.with_context(|| cannot(path, "written"))
}

/// A new, empty file beside `path`, whose folder is created if missing.
fn begin(path: &Path) -> Result<(File, TempPath)> {
    make_folder(path.parent().unwrap_or(Path::new("")))?;
    unfinished_of(path)
}

/// Makes a folder that may be there already.
pub(crate) fn make_folder(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| cannot(folder, "created"))
}

/// A new, empty file beside the one of this name in a folder; it is removed unless it is given that name. It is best
/// written through the file returned: opened and emptied anew, some file systems write it to the disk when it is closed.
pub(crate) fn unfinished_in(folder: &Path, name: &str) -> Result<(File, TempPath)> {
    let unfinished = tempfile::Builder::new()
        .prefix(name)
        .suffix(UNFINISHED)
        // with the permissions of any other new file, not for the owner alone
        .make_in(folder, |unfinished| File::create_new(unfinished))
        .with_context(|| cannot(&folder.join(name), "written"))?;
    Ok(unfinished.into_parts())
}

/// A new, empty file beside `path`; it is removed unless it is given that name.
pub(crate) fn unfinished_of(path: &Path) -> Result<(File, TempPath)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    unfinished_in(path.parent().unwrap_or(Path::new("")), &name)
}

/// Removes unfinished files that a killed program left in a folder.
pub(crate) fn remove_unfinished(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().ends_with(UNFINISHED) {
            // best effort: an unfinished file does no harm
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn cannot(path: &Path, what: &str) -> String {
    format!("{}: cannot be {what}", path.display())
}
