//! A temporary file without a name, read and written in pieces from several threads. The system removes it as soon as
//! it is closed.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The file.
#[derive(Debug)]
pub struct ScratchFile(File);

impl ScratchFile {
    /// An empty file.
    ///
    /// # Errors
    /// No file can be made.
    pub fn new() -> io::Result<Self> {
        let folder = folder();
        let in_folder = |error: io::Error| {
            let message = format!(
                "{}: no temporary file can be written (TMPDIR names another folder): {error}",
                folder.display()
            );
            io::Error::new(error.kind(), message)
        };
        tempfile::tempfile_in(&folder).map(Self).map_err(in_folder)
    }

    /// Writes bytes behind those that were appended before.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    /// Writes bytes at a place, wherever others write at the same time.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_at(&self, bytes: &[u8], from: u64) -> io::Result<()> {
        write_at(&self.0, bytes, from)
    }

    /// Fills `bytes` from a place on.
    ///
    /// # Errors
    /// The file cannot be read, or ends before.
    pub fn read_at(&self, bytes: &mut [u8], from: u64) -> io::Result<()> {
        read_at(&self.0, bytes, from)
    }
}

#[cfg(unix)]
fn read_at(file: &File, bytes: &mut [u8], from: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, from)
}

#[cfg(unix)]
fn write_at(file: &File, bytes: &[u8], from: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, from)
}

#[cfg(windows)]
fn read_at(file: &File, bytes: &mut [u8], from: u64) -> io::Result<()> {
    let mut done = 0;
    while done < bytes.len() {
        let next =
            std::os::windows::fs::FileExt::seek_read(file, &mut bytes[done..], from + done as u64)?;
        if next == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        done += next;
    }
    Ok(())
}

#[cfg(windows)]
fn write_at(file: &File, bytes: &[u8], from: u64) -> io::Result<()> {
    let mut done = 0;
    while done < bytes.len() {
        let next =
            std::os::windows::fs::FileExt::seek_write(file, &bytes[done..], from + done as u64)?;
        if next == 0 {
            return Err(io::ErrorKind::WriteZero.into());
        }
        done += next;
    }
    Ok(())
}

/// The folder that TMPDIR names, else one for large files: on many systems `/tmp` is in memory.
fn folder() -> PathBuf {
    let on_disk = Path::new("/var/tmp");
    match std::env::var_os("TMPDIR") {
        None if on_disk.is_dir() => on_disk.into(),
        _ => std::env::temp_dir(),
    }
}
