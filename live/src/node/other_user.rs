//! Recognition of shared memory that belongs to another user: iceoryx2 reports it as an internal error.

use std::fs::{self, Metadata};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use iceoryx2::prelude::*;

use super::leftovers::{SHARED_MEMORY, files};

/// A user who may use everybody's files.
const ROOT: u32 = 0;

/// Adds to an error that files of this configuration belong to another user.
pub(super) fn explained(error: anyhow::Error, config: &Config) -> anyhow::Error {
    let root = config.global.root_path().to_string();
    let prefix = config.global.prefix.to_string();
    match seen(Path::new(&root), Path::new(SHARED_MEMORY), &prefix) {
        Some(text) => error.context(text),
        None => error,
    }
}

fn seen(root: &Path, shared_memory: &Path, prefix: &str) -> Option<String> {
    // this process's own entry has its effective user
    let own = fs::metadata("/proc/self").ok()?.uid();
    told(own, root, shared_memory, prefix)
}

/// The folder of all programs, or memory of this prefix, that user `own` cannot use because it is another user's.
fn told(own: u32, root: &Path, shared_memory: &Path, prefix: &str) -> Option<String> {
    if own == ROOT {
        return None;
    }
    let closed = |path: &Path, open: u32| {
        let file = path.metadata().ok()?;
        is_closed(&file, own, open).then(|| {
            format!(
                "{} belongs to {}, and this program runs as {}",
                path.display(),
                user(file.uid()),
                user(own)
            )
        })
    };
    let folders = [
        root.to_path_buf(),
        root.join("nodes"),
        root.join("services"),
    ];
    if let Some(text) = folders.iter().find_map(|folder| closed(folder, 0o003)) {
        return Some(format!(
            "{text}: run all programs of a computer as one user"
        ));
    }
    let memory = files(shared_memory, prefix);
    let text = memory.iter().find_map(|file| closed(file, 0o006))?;
    Some(format!(
        "{text}: run all programs of a machine as one user, or with another --prefix"
    ))
}

/// Whether a file of another user lacks one of the permissions `open` for others.
fn is_closed(file: &Metadata, own: u32, open: u32) -> bool {
    file.uid() != own && file.mode() & open != open
}

/// A user by name and number.
fn user(id: u32) -> String {
    let known = fs::read_to_string("/etc/passwd").unwrap_or_default();
    let name = known.lines().find_map(|line| {
        let mut fields = line.split(':');
        let (name, number) = (fields.next()?, fields.nth(1)?);
        (number.parse() == Ok(id)).then(|| name.to_owned())
    });
    match name {
        Some(name) => format!("user {name} ({id})"),
        None => format!("user {id}"),
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use tempfile::TempDir;

    use super::*;

    fn allow(path: &Path, mode: u32) {
        fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    }

    #[test]
    fn what_another_user_keeps_closed_is_named() {
        let (root, memory) = (TempDir::new().unwrap(), TempDir::new().unwrap());
        let owner = root.path().metadata().unwrap().uid();
        let other = owner + 1000;
        let told = |by: u32, prefix: &str| told(by, root.path(), memory.path(), prefix);
        allow(root.path(), 0o750);
        let text = told(other, "iox_").unwrap();
        assert!(
            text.starts_with(&root.path().display().to_string()),
            "{text}"
        );
        assert!(text.contains(&format!("({owner})")) || text.contains(&format!("user {owner}")));
        assert!(text.contains(&other.to_string()), "{text}");
        // its owner, and who may use everything
        for user in [owner, ROOT] {
            assert_eq!(told(user, "iox_"), None);
        }
        allow(root.path(), 0o777);
        assert_eq!(told(other, "iox_"), None);
        let file = memory.path().join("iox_1.data");
        fs::write(&file, "x").unwrap();
        allow(&file, 0o600);
        assert!(told(other, "iox_").unwrap().contains("--prefix"));
        assert_eq!(told(other, "own_"), None);
    }
}
