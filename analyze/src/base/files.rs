//! Atomic replacement of files: a reader sees the old file or the new one, never a part.

use std::fs;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result};

/// Writes a file beside its place and moves it there: whoever looks sees the old file or the new one,
/// whenever the program ends.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    make_whole(path, |temporary| {
        fs::write(temporary, bytes).with_context(|| cannot(path, "written"))
    })
}

/// The same for a file that `make` writes.
pub(crate) fn make_whole(path: &Path, make: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder).with_context(|| cannot(folder, "created"))?;
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    // unique also among the machines that share a folder
    let now_ns = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_nanos());
    name.push(format!(".{}.{now_ns}{TEMPORARY}", std::process::id()));
    let temporary = folder.join(name);
    let made = make(&temporary)
        .and_then(|()| fs::rename(&temporary, path).with_context(|| cannot(path, "written")));
    if made.is_err() {
        // what is left of it is of no use; that it was not made is what counts
        let _ = fs::remove_file(&temporary);
    }
    made
}

/// Ending of the names of files that are not whole yet.
const TEMPORARY: &str = ".tipwatch-part";

/// Removes what a killed program left half written in a folder.
pub(crate) fn remove_unfinished(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().ends_with(TEMPORARY) {
            // one that cannot be removed is no worse than before
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn cannot(path: &Path, what: &str) -> String {
    format!("{}: cannot be {what}", path.display())
}
