//! Gaps in the numbering of salvaged messages.

use std::ops::Range;

use super::salvage::MessageRow;

/// Most gaps told one by one; what comes after is added to the last.
const MOST_GAPS: usize = 1000;

/// Messages whose numbers are missing among those that were found.
#[derive(Default)]
pub(super) struct Gaps {
    last: Option<(i64, i64, u64)>,
    pub(super) list: Vec<Gap>,
}

/// Numbers that are missing in a row.
pub(super) struct Gap {
    pub(super) missing: u64,
    /// Times of the messages before and after.
    pub(super) first_time_ns: Option<i64>,
    pub(super) last_time_ns: i64,
    /// From the end of the page of the message before to the beginning of that after.
    pub(super) pages: Range<u64>,
}

impl Gaps {
    pub(super) fn pass(&mut self, row: &MessageRow<'_>) {
        let (last_id, last_ns, last_end) = self
            .last
            .map_or((0, None, 0), |(id, time_ns, end)| (id, Some(time_ns), end));
        let missing = row.id.saturating_sub(last_id).saturating_sub(1);
        if let Ok(missing @ 1..) = u64::try_from(missing) {
            let pages = last_end.min(row.page.start)..row.page.start;
            let is_full = self.list.len() == MOST_GAPS;
            match self.list.last_mut() {
                Some(gap) if is_full => {
                    gap.missing = gap.missing.saturating_add(missing);
                    gap.last_time_ns = row.time_ns;
                    gap.pages.end = gap.pages.end.max(pages.end);
                }
                _ => self.list.push(Gap {
                    missing,
                    first_time_ns: last_ns,
                    last_time_ns: row.time_ns,
                    pages,
                }),
            }
        }
        self.last = Some((row.id, row.time_ns, row.page.end));
    }
}
