//! Files of a recorder that was killed in the middle of a write, or cut by a power failure: they are closed when a
//! recorder starts in the same folder.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::os::unix::fs::FileExt;
use std::path::Path;

use super::retention::recorded_files;
use super::segment::{ENDING, MAGIC};

/// Opcodes of MCAP records.
const HEADER: u8 = 0x01;
const CHUNK: u8 = 0x06;
const DATA_END: u8 = 0x0f;
/// Opcode and length of a record.
const HEAD_BYTES: u64 = 9;
/// Bytes of a chunk before its compression: times, uncompressed size and checksum.
const CHUNK_HEAD: usize = 28;
/// The largest record that is read: a chunk is one batch.
const MAX_RECORD: u64 = 256 << 20;

/// Closes every unfinished file in the sessions' folders of a recorder, and tells of it.
pub(super) fn repair_all(root: &Path) {
    for path in recorded_files(root) {
        match repair(&path) {
            Ok(None) => {}
            Ok(Some(removed)) => eprintln!(
                "record: {}: closed after an interrupted recording, {removed} bytes of incomplete data removed",
                path.display()
            ),
            Err(error) => eprintln!("record: {}: cannot close it: {error}", path.display()),
        }
    }
}

/// Closes a file behind its last complete record; returns the number of bytes removed, or `None` if the file needs
/// nothing or is being written.
pub(super) fn repair(path: &Path) -> io::Result<Option<u64>> {
    let mut file = File::options().read(true).write(true).open(path)?;
    let bytes = file.metadata()?.len();
    if has_end(&mut file, bytes)? || file.try_lock().is_err() {
        return Ok(None);
    }
    let good = complete_bytes(&mut file, bytes)?;
    if good == 0 {
        return Ok(None);
    }
    file.set_len(good)?;
    file.write_all_at(&ENDING, good)?;
    file.sync_all()?;
    Ok(Some(bytes - good))
}

fn has_end(file: &mut File, bytes: u64) -> io::Result<bool> {
    if bytes < (MAGIC.len() + ENDING.len()) as u64 {
        return Ok(false);
    }
    let mut end = [0; MAGIC.len()];
    file.seek(SeekFrom::Start(bytes - MAGIC.len() as u64))?;
    file.read_exact(&mut end)?;
    Ok(end == MAGIC)
}

/// Finds the end of the last complete record before the end of the data (bytes); 0 if this is no MCAP file of a recorder like
/// this one. Files of other programs may still be being written.
fn complete_bytes(file: &mut File, bytes: u64) -> io::Result<u64> {
    file.seek(SeekFrom::Start(0))?;
    let mut reader = BufReader::new(file);
    let mut magic = [0; MAGIC.len()];
    if bytes < MAGIC.len() as u64 {
        return Ok(0);
    }
    reader.read_exact(&mut magic)?;
    if magic != MAGIC {
        return Ok(0);
    }
    let mut good = MAGIC.len() as u64;
    let mut content = Vec::new();
    while bytes - good >= HEAD_BYTES {
        let mut head = [0; HEAD_BYTES as usize];
        reader.read_exact(&mut head)?;
        let [opcode, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        if opcode == DATA_END || length > (bytes - good - HEAD_BYTES).min(MAX_RECORD) {
            break;
        }
        content.resize(length as usize, 0);
        reader.read_exact(&mut content)?;
        let is_first = good == MAGIC.len() as u64;
        if is_first && !(opcode == HEADER && is_of_tipwatch(&content)) {
            return Ok(0);
        }
        if opcode == 0 || opcode == CHUNK && !is_whole_chunk(&content) {
            break;
        }
        good += HEAD_BYTES + length;
    }
    Ok(good)
}

/// Whether a header names this recorder: its profile and its library are texts after their lengths (4 bytes).
fn is_of_tipwatch(content: &[u8]) -> bool {
    let text = |bytes: &[u8]| {
        let (length, rest) = bytes.split_at_checked(4)?;
        let length = u32::from_le_bytes(length.try_into().ok()?) as usize;
        let (text, rest) = rest.split_at_checked(length)?;
        Some((text.to_vec(), rest.to_vec()))
    };
    let library = text(content).and_then(|(_, rest)| text(&rest));
    library.is_some_and(|(library, _)| library.starts_with(b"tipwatch "))
}

/// Whether the checksum of an uncompressed chunk is right.
fn is_whole_chunk(content: &[u8]) -> bool {
    let Some((head, rest)) = content.split_at_checked(CHUNK_HEAD) else {
        return false;
    };
    let checksum = &head[CHUNK_HEAD - 4..];
    // an empty name of the compression (4 bytes), the length of the records (8 bytes)
    let Some((_, records)) = rest.split_at_checked(12) else {
        return false;
    };
    crc32fast::hash(records).to_le_bytes() == *checksum
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::pending::{Encoded, Kind};
    use super::super::segment::{Channels, Preamble, Segment};
    use super::super::topics;
    use super::*;

    /// A file of ten batches of three messages, as a killed recorder leaves it.
    fn recorded(path: &Path) -> Vec<u64> {
        let preamble = Preamble {
            topics: vec![topics::imu()],
            channels: Channels {
                verdicts: 0,
                commands: 0,
                gaps: 0,
                programs: 0,
            },
            attachments: [("a".into(), "text".into()), ("b".into(), "text".into())],
            metadata: BTreeMap::new(),
            begun_ns: 1,
        };
        let mut segment = Segment::begin(path.into(), &preamble).unwrap();
        let mut lengths = vec![path.metadata().unwrap().len()];
        for batch in 0..10 {
            for message in 0..3 {
                let number = 3 * batch + message + 1;
                let message = Encoded {
                    kind: Kind::Sample(0),
                    sequence: number,
                    session_ns: number.into(),
                    log_time_ns: number.into(),
                    publish_time_ns: number.into(),
                    data: vec![7; 100],
                };
                segment.add(0, &message).unwrap();
            }
            segment.flush().unwrap();
            lengths.push(path.metadata().unwrap().len());
        }
        lengths
    }

    /// The messages of a complete file; `None` if it is not complete.
    fn messages(path: &Path) -> Option<usize> {
        let bytes = std::fs::read(path).unwrap();
        let stream = mcap::MessageStream::new(&bytes).ok()?;
        let read: Result<Vec<_>, _> = stream.collect();
        read.ok().map(|messages| messages.len())
    }

    // requirement: TW-RECORD-02
    #[test]
    fn file_is_complete_after_every_batch() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        recorded(&path);
        assert_eq!(messages(&path), Some(30));
        assert_eq!(repair(&path).unwrap(), None);
    }

    // requirement: TW-RECORD-04
    #[test]
    fn file_cut_anywhere_is_complete_after_repair() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        let lengths = recorded(&path);
        let good = std::fs::read(&path).unwrap();
        let first = lengths[0];
        for cut in (first..good.len() as u64).step_by(7) {
            std::fs::write(&path, &good[..cut as usize]).unwrap();
            // a process that a test beside this one starts holds the lock of the file before for a moment
            let attempts = std::iter::repeat_with(|| repair(&path).unwrap());
            let slow =
                attempts.inspect(|_| std::thread::sleep(std::time::Duration::from_millis(1)));
            let removed = slow.take(200).flatten().next();
            assert!(removed.is_some(), "{cut}");
            let whole = lengths.iter().filter(|&&n| n - ENDING.len() as u64 <= cut);
            let whole = 3 * (whole.count() - 1);
            // a chunk may be whole whose index is cut
            let found = messages(&path).unwrap();
            assert!([whole, whole + 3].contains(&found), "{cut}: {found}");
        }
        // a power failure may leave zeros where data were
        let mut zeros = good.clone();
        let from = lengths[8] as usize;
        zeros[from..].fill(0);
        std::fs::write(&path, &zeros).unwrap();
        repair(&path).unwrap();
        assert_eq!(messages(&path), Some(24));
        // files of other programs are left alone
        let mut foreign = good.clone();
        let at = good.windows(9).position(|w| w == b"tipwatch ").unwrap();
        foreign[at] = b'T';
        foreign.truncate(foreign.len() - 20);
        for bytes in [b"no MCAP".to_vec(), foreign] {
            std::fs::write(&path, &bytes).unwrap();
            assert_eq!(repair(&path).unwrap(), None);
            assert_eq!(std::fs::read(&path).unwrap(), bytes);
        }
    }
}
