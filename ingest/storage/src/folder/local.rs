//! A folder of the local file system.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::Error;

use super::entry::{Entry, Put};

/// Ending of the names of unfinished files; they are not listed.
pub const UNFINISHED: &str = ".tipwatch-part";

/// Lists all files below a folder with keys relative to it; none if it is absent.
pub(crate) fn list(folder: &Path) -> Result<Vec<Entry>, Error> {
    let mut found = Vec::new();
    let mut open = vec![(folder.to_path_buf(), String::new())];
    while let Some((folder, prefix)) = open.pop() {
        let (entries, folders) = children(&folder)?;
        for name in folders {
            open.push((folder.join(&name), format!("{prefix}{name}/")));
        }
        found.extend(entries.into_iter().map(|entry| Entry {
            key: format!("{prefix}{}", entry.key),
            ..entry
        }));
    }
    found.sort_by(|a, b| a.key.cmp(&b.key));
    Ok(found)
}

/// The files in a folder, and the names of its folders; none if it is absent.
pub(crate) fn children(folder: &Path) -> Result<(Vec<Entry>, Vec<String>), Error> {
    let failed = |error: std::io::Error| Error::local(folder.display().to_string(), &error);
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Default::default()),
        Err(error) => return Err(failed(error)),
    };
    let (mut found, mut folders) = (Vec::new(), Vec::new());
    for entry in entries {
        let entry = entry.map_err(failed)?;
        let key = entry.file_name().to_string_lossy().into_owned();
        // a file that disappears meanwhile is not there
        let Ok(metadata) = fs::metadata(entry.path()) else {
            continue;
        };
        if metadata.is_dir() {
            // a link to a folder may lead in a circle
            if !entry.file_type().map_err(failed)?.is_symlink() {
                folders.push(key);
            }
        } else if !key.ends_with(UNFINISHED) {
            found.push(Entry {
                key,
                bytes: metadata.len(),
                e_tag: None,
            });
        }
    }
    Ok((found, folders))
}

/// Writes a file as a whole: a reader sees the old one or the new one.
pub(crate) fn put(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let unfinished = unfinished(path, bytes).map_err(|error| failed(path, &error))?;
    unfinished
        .persist(path)
        .map(drop)
        .map_err(|error| failed(path, &error.error))
}

/// Writes a file as a whole unless one is there.
pub(crate) fn put_if_absent(path: &Path, bytes: &[u8]) -> Result<Put, Error> {
    let unfinished = unfinished(path, bytes).map_err(|error| failed(path, &error))?;
    match unfinished.persist_noclobber(path) {
        Ok(_) => Ok(Put::Written),
        Err(error) if error.error.kind() == std::io::ErrorKind::AlreadyExists => {
            Ok(Put::AlreadyThere)
        }
        Err(error) => Err(failed(path, &error.error)),
    }
}

fn unfinished(path: &Path, bytes: &[u8]) -> std::io::Result<NamedTempFile> {
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder)?;
    let folder: PathBuf = match folder.as_os_str().is_empty() {
        true => ".".into(),
        false => folder.into(),
    };
    let mut file = tempfile::Builder::new()
        .prefix(".")
        .suffix(UNFINISHED)
        // with the permissions of any other new file, not for the owner alone
        .make_in(folder, |path| fs::File::create_new(path))?;
    file.write_all(bytes)?;
    Ok(NamedTempFile::from_parts(
        fs::OpenOptions::new().write(true).open(file.path())?,
        file.into_temp_path(),
    ))
}

fn failed(path: &Path, error: &std::io::Error) -> Error {
    Error::local(path.display().to_string(), error)
}
