//! A private copy of a database on which SQLite may apply the journal beside the original. The
//! original is evidence and is never opened for writing.

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
};

use rusqlite::{Connection, OpenFlags};
use tempfile::TempDir;
use tipwatch_language::say;

use crate::{
    file::LogFile,
    message::{Losses, LostPart},
};

/// File name suffixes of journals, and their first bytes.
const JOURNALS: [(&str, &[&[u8]]); 2] = [
    (
        "-wal",
        &[&[0x37, 0x7f, 0x06, 0x82], &[0x37, 0x7f, 0x06, 0x83]],
    ),
    (
        "-journal",
        &[&[0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7]],
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
pub(super) fn with_journal(database: &LogFile, losses: &mut Losses) -> Option<PrivateCopy> {
    let path = database.path();
    let Some((journal, ending)) = journal_of(database, losses) else {
        if needs_write_ahead_log(database) {
            losses.note(say!(
                "{}: it was recorded with a write-ahead log, and no file of this name with -wal is beside it; if it was \
                 copied while the recorder wrote it, its last messages are missing",
                path.display()
            ));
        }
        return None;
    };
    match copy_and_merge(database.data(), journal.data(), ending) {
        Ok(copy) => {
            losses.note(say!(
                "{}: a journal beside it was never merged ({ending}); it was applied to \
                 a private copy",
                path.display()
            ));
            Some(copy)
        }
        Err(error) => {
            let bytes = std::fs::metadata(journal.data()).map_or(0, |metadata| metadata.len());
            let reason = say!("a journal cannot be applied: {error}");
            losses.lose(LostPart::File, journal.path(), 0..bytes, reason);
            None
        }
    }
}

/// The journal beside a database, decompressed, and the ending of its name.
fn journal_of(database: &LogFile, losses: &mut Losses) -> Option<(LogFile, &'static str)> {
    JOURNALS.iter().find_map(|&(ending, magics)| {
        let is_journal = |file: &LogFile| {
            let begins = |magic: &&[u8]| begins_with(file.data(), magic);
            magics.iter().any(begins)
        };
        let [plain, bare, packed] = journals_beside(database, ending);
        let mut plain = [plain, bare].into_iter().map(|path| LogFile::plain(&path));
        let found = plain.find(is_journal).or_else(|| {
            let packed = packed.is_file().then(|| LogFile::plain(&packed))?;
            packed.unpacked(losses).ok().filter(is_journal)
        });
        Some((found?, ending))
    })
}

/// The names that a journal can have: that of the database and the ending; of a compressed database `a.db3.zst` also `a.db3-wal` and
/// `a.db3-wal.zst`.
fn journals_beside(database: &LogFile, ending: &str) -> [PathBuf; 3] {
    let path = database.path();
    let is_packed = database.data() != path;
    let packing = path.extension().filter(|_| is_packed);
    let bare = match packing {
        Some(_) => beside(&path.with_extension(""), ending),
        None => beside(path, ending),
    };
    let mut packed = bare.clone().into_os_string();
    packed.push(".");
    packed.push(packing.unwrap_or(OsStr::new("zst")));
    [beside(path, ending), bare, packed.into()]
}

fn begins_with(path: &Path, magic: &[u8]) -> bool {
    let mut first_bytes = vec![0; magic.len()];
    let file = std::fs::File::open(path);
    file.is_ok_and(|mut file| std::io::Read::read_exact(&mut file, &mut first_bytes).is_ok())
        && first_bytes == magic
}

/// Whether messages may lie in a file -wal that is not there. A recorder that ends in order merges and deletes the
/// file, but the header keeps the mode: nothing tells the two apart.
fn needs_write_ahead_log(database: &LogFile) -> bool {
    let mut header = [0; MODE_AT + 2];
    let is_read = std::fs::File::open(database.data())
        .and_then(|mut file| std::io::Read::read_exact(&mut file, &mut header))
        .is_ok();
    let is_there = |path: PathBuf| path.exists();
    // what is beside a file of a bucket is not looked for
    let is_local = database.path().exists();
    is_local
        && is_read
        && header[MODE_AT..] == WRITE_AHEAD
        && !journals_beside(database, "-wal").into_iter().any(is_there)
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
