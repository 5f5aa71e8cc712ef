//! A private copy of a database on which SQLite may apply the journal beside the original. The
//! original is evidence and is never opened for writing.

use std::path::{Path, PathBuf};

use rusqlite::{Connection, OpenFlags};
use tempfile::TempDir;
use tipwatch_language::say;

use crate::message::{Losses, LostPart};

/// File name suffixes of journals, and their first bytes.
const JOURNALS: [(&str, &[u8]); 3] = [
    ("-wal", &[0x37, 0x7f, 0x06, 0x82]),
    ("-wal", &[0x37, 0x7f, 0x06, 0x83]),
    (
        "-journal",
        &[0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7],
    ),
];

/// Place of the versions for writing and reading in a database's header, and their values in write-ahead mode.
const MODE_AT: usize = 18;
const WRITE_AHEAD: [u8; 2] = [2, 2];

/// The copy, deleted with the value.
pub(super) struct PrivateCopy {
    pub(super) path: PathBuf,
    _folder: TempDir,
}

/// Copies a database and its journal, and merges the two; `None` without a journal. A journal that
/// cannot be merged is reported as a loss.
pub(super) fn with_journal(path: &Path, losses: &mut Losses) -> Option<PrivateCopy> {
    let Some((journal, ending)) = journal_of(path) else {
        if needs_write_ahead_log(path) {
            losses.note(say!(
                "{}: it was recorded with a write-ahead log, and no file of this name with -wal is beside it; if it was \
                 copied while the recorder wrote it, its last messages are missing",
                path.display()
            ));
        }
        return None;
    };
    match copy_and_merge(path, &journal, ending) {
        Ok(copy) => {
            losses.note(say!(
                "{}: a journal beside it was never merged ({ending}); it was applied to \
                 a private copy",
                path.display()
            ));
            Some(copy)
        }
        Err(error) => {
            let bytes = std::fs::metadata(&journal).map_or(0, |metadata| metadata.len());
            let reason = say!("a journal cannot be applied: {error}");
            losses.lose(LostPart::File, &journal, 0..bytes, reason);
            None
        }
    }
}

fn journal_of(path: &Path) -> Option<(PathBuf, &'static str)> {
    JOURNALS.iter().find_map(|(ending, magic)| {
        let journal = beside(path, ending);
        let mut first_bytes = vec![0; magic.len()];
        let mut file = std::fs::File::open(&journal).ok()?;
        std::io::Read::read_exact(&mut file, &mut first_bytes).ok()?;
        (first_bytes == *magic).then_some((journal, *ending))
    })
}

/// Whether messages may lie in a file -wal that is not there. A recorder that ends in order merges and deletes the
/// file, but the header keeps the mode: nothing tells the two apart.
fn needs_write_ahead_log(path: &Path) -> bool {
    let mut header = [0; MODE_AT + 2];
    let is_read = std::fs::File::open(path)
        .and_then(|mut file| std::io::Read::read_exact(&mut file, &mut header))
        .is_ok();
    is_read && header[MODE_AT..] == WRITE_AHEAD && !beside(path, "-wal").exists()
}

fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

fn copy_and_merge(
    path: &Path,
    journal: &Path,
    ending: &str,
) -> Result<PrivateCopy, Box<dyn std::error::Error>> {
    let folder = tempfile::Builder::new().prefix("tipwatch-").tempdir()?;
    let copy = folder.path().join("log.db3");
    copy_content(path, &copy)?;
    copy_content(journal, &beside(&copy, ending))?;
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(&copy, flags)?;
    // A first query makes SQLite roll back a rollback journal; switching the mode merges a
    // write-ahead log.
    let _: i64 = connection.query_row("PRAGMA schema_version", [], |row| row.get(0))?;
    let _: String = connection.query_row("PRAGMA journal_mode=DELETE", [], |row| row.get(0))?;
    Ok(PrivateCopy {
        path: copy,
        _folder: folder,
    })
}

/// Copies without the permissions of the original, which may forbid writing.
fn copy_content(from: &Path, to: &Path) -> std::io::Result<()> {
    let mut source = std::fs::File::open(from)?;
    let mut target = std::fs::File::create_new(to)?;
    std::io::copy(&mut source, &mut target)?;
    Ok(())
}
