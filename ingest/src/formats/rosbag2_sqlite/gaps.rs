//! Finds gaps in the ids of salvaged messages.

use std::ops::Range;

use super::salvage::MessageRow;

/// Most gaps listed; later ones are added to the last.
const MOST_GAPS: usize = 1000;

/// Ids that are missing between those found.
#[derive(Default)]
pub(super) struct IdGaps {
    last: Option<(i64, i64, u64)>,
    pub(super) list: Vec<IdGap>,
}

/// A run of missing ids.
pub(super) struct IdGap {
    pub(super) missing: u64,
    /// Times of the messages before and after.
    pub(super) first_time_ns: Option<i64>,
    pub(super) last_time_ns: i64,
    /// Bytes from the end of the previous message's page to the start of the next message's page.
    pub(super) pages: Range<u64>,
}

impl IdGaps {
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
                _ => self.list.push(IdGap {
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
