//! Detects a database that is shorter than its header states.

use std::path::Path;

use tipwatch_language::say;

use crate::{
    file::FileBytes,
    message::{Error, Losses, LostPart},
};

/// The last bytes of a truncated file.
///
/// SQLite reads zeros beyond the end of the file. The last message of a truncated page then appears
/// complete, with zeros at its end; only these bytes reveal it.
pub(super) struct Cut {
    last_bytes: Vec<u8>,
}

impl Cut {
    /// Compares the size in the database header with that of the file.
    pub(super) fn find(
        file: &FileBytes,
        path: &Path,
        losses: &mut Losses,
    ) -> Result<Option<Self>, Error> {
        const COMPARED_BYTES: u64 = 16;
        let mut header = [0; 32];
        if file.len() < header.len() as u64 {
            return Ok(None);
        }
        file.read_at(0, &mut header)?;
        let page_bytes = match u16::from_be_bytes([header[16], header[17]]) {
            1 => 65536,
            bytes => u64::from(bytes),
        };
        let pages = u32::from_be_bytes([header[28], header[29], header[30], header[31]]);
        let expected = page_bytes * u64::from(pages);
        if expected <= file.len() {
            return Ok(None);
        }
        let reason = say!(
            "expected a database of {expected} bytes, found {}",
            file.len()
        );
        losses.lose(LostPart::Tail, path, file.len()..expected, reason);
        let last_bytes = file.read_vec(file.len() - COMPARED_BYTES, COMPARED_BYTES)?;
        Ok(Some(Self { last_bytes }))
    }

    /// Whether a message may extend beyond the end of the file: it contains the last bytes of the
    /// file, followed by zeros only.
    pub(super) fn may_run_through(&self, data: &[u8]) -> bool {
        let zeros = data.iter().rev().take_while(|byte| **byte == 0).count();
        (data.len() - zeros..data.len()).any(|end| {
            let compared = end.min(self.last_bytes.len());
            let file_end = &self.last_bytes[self.last_bytes.len() - compared..];
            data[..end].ends_with(file_end)
        })
    }
}
