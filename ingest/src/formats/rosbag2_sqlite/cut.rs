//! Detects a database that is shorter than its header states.

use std::{collections::BTreeSet, ops::Range, path::Path};

use tipwatch_language::say;

use super::page::{self, PageKind, PageSize};
use crate::{
    file::FileBytes,
    message::{Error, Losses, LostPart},
};

/// The end of a truncated file.
///
/// SQLite reads zeros beyond the end of the file. A message that runs through the end then appears complete, with zeros at its end.
pub(super) struct Cut {
    /// Rows of the last page, which the end of the file cuts.
    torn: Vec<i64>,
    /// A shorter message is on one page.
    most_on_page: usize,
    /// The last bytes of the file: of a message on several pages, only these reveal that it runs through the end.
    last_bytes: Vec<u8>,
}

impl Cut {
    /// Compares the size in the database header with that of the file, and cuts the file where its last written page ends. Behind it
    /// stand pages of zeros after a loss of power.
    pub(super) fn find(
        file: FileBytes,
        path: &Path,
        losses: &mut Losses,
    ) -> Result<(FileBytes, Option<Self>), Error> {
        const COMPARED_BYTES: u64 = 16;
        /// A write that was cut has whole sectors.
        const SECTOR_BYTES: u64 = 512;
        /// Far above the other columns of a row and its header.
        const OTHER_COLUMNS_BYTES: usize = 64;
        let mut header = [0; 32];
        if file.len() < header.len() as u64 {
            return Ok((file, None));
        }
        file.read_at(0, &mut header)?;
        let Some(size) = PageSize::parse(&header) else {
            return Ok((file, None));
        };
        let pages = u32::from_be_bytes([header[28], header[29], header[30], header[31]]);
        let expected = size.bytes * u64::from(pages);
        let written = file.written()?.bytes;
        let page_end = written.next_multiple_of(size.bytes);
        // the last message on a page may end with zeros, and that of a page behind it be of zeros only
        let behind = page_end..file.len().min(expected);
        let is_followed =
            page_end + 2 * size.bytes <= behind.end && !are_ends_of_messages(&file, size, &behind)?;
        let end = match (is_followed, page_end - written < SECTOR_BYTES) {
            (true, true) => page_end,
            (true, false) => written,
            (false, _) => file.len(),
        };
        if expected <= end {
            return Ok((file, None));
        }
        let file = file.cut_at(end);
        let reason = say!("expected a database of {expected} bytes, found {}", end);
        losses.lose(LostPart::Tail, path, end..expected, reason);
        let last_page = end - end % size.bytes;
        let mut page = file.read_vec(last_page, end - last_page)?;
        let available = page.len();
        page.resize(size.bytes as usize, 0);
        let rows = page::cells(&page, last_page == 0, size);
        let is_leaf = page::kind(&page, last_page == 0) == PageKind::Leaf;
        let torn = rows.filter(|cell| is_leaf && cell.end(&page) > available);
        let compared = COMPARED_BYTES.min(end);
        let cut = Self {
            torn: torn.map(|cell| cell.row_id).collect(),
            most_on_page: size.most_local_bytes().saturating_sub(OTHER_COLUMNS_BYTES),
            last_bytes: file.read_vec(end - compared, compared)?,
        };
        Ok((file, Some(cut)))
    }

    /// Whether a message may extend beyond the end of the file: the end cuts its row, or it is on several pages and contains the last
    /// bytes of the file, followed by zeros only.
    pub(super) fn may_run_through(&self, id: Option<i64>, data: &[u8]) -> bool {
        if data.len() <= self.most_on_page {
            return id.is_none_or(|id| self.torn.contains(&id));
        }
        let zeros = data.iter().rev().take_while(|byte| **byte == 0).count();
        (data.len() - zeros..data.len()).any(|end| {
            let compared = end.min(self.last_bytes.len());
            let file_end = &self.last_bytes[self.last_bytes.len() - compared..];
            data[..end].ends_with(file_end)
        })
    }
}

/// Whether pages of zeros are the ends of messages on the pages before them: each of them continues one.
fn are_ends_of_messages(
    file: &FileBytes,
    size: PageSize,
    zeros: &Range<u64>,
) -> Result<bool, Error> {
    let count = (zeros.end - zeros.start).div_ceil(size.bytes);
    let mut seen = BTreeSet::new();
    for at in (0..zeros.start).step_by(size.bytes as usize) {
        let page = file.read_vec(at, size.bytes)?;
        if page::kind(&page, at == 0) != PageKind::Leaf {
            continue;
        }
        for cell in page::cells(&page, at == 0, size) {
            let mut next = cell.overflow;
            while let Some(number) = next.filter(|&number| number > 0) {
                let at = (u64::from(number) - 1) * size.bytes;
                // what was seen before comes of damage
                if at + size.bytes > zeros.end || !seen.insert(at) || at >= zeros.start {
                    break;
                }
                let page = file.read_vec(at, size.bytes)?;
                next = size.overflow(&page).map(|(number, _)| number);
            }
        }
    }
    Ok(seen.range(zeros.clone()).count() as u64 == count)
}
