//! The folder of a session: a name that no other session has.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Creates the folder of a session in `root`. It is always a new one: sessions of one second and one identity, and two
/// recorders of one session, get a number each.
pub(super) fn create(root: &Path, begun_ns: i64, session: u64) -> io::Result<PathBuf> {
    std::fs::create_dir_all(root)?;
    let name = folder_name(begun_ns, session);
    let mut folder = root.join(&name);
    for number in 2.. {
        match std::fs::create_dir(&folder) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                folder = root.join(format!("{name}-{number}"));
            }
            created => return created.map(|()| folder),
        }
    }
    Err(ErrorKind::AlreadyExists.into())
}

/// Time of day and session.
fn folder_name(begun_ns: i64, session: u64) -> String {
    let time = jiff::Timestamp::from_nanosecond(begun_ns.into()).unwrap_or_default();
    format!("{}-{session:016x}", time.strftime("%Y%m%dT%H%M%SZ"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_session_gets_a_folder_of_its_own() {
        let root = tempfile::tempdir().unwrap();
        let root = root.path().join("new");
        // identities that only differ in their lower half, and the same one again
        let folders = [1, 2, 1, 1].map(|session| create(&root, 7, session).unwrap());
        for (at, folder) in folders.iter().enumerate() {
            assert!(folder.is_dir());
            assert!(!folders[..at].contains(folder), "{folders:?}");
        }
    }
}
