//! The reserved memory of one column.

use std::{ops::Range, sync::atomic::AtomicUsize};

use super::system::HUGE_PAGE_BYTES;

/// Smaller columns are not worth a system call.
const LARGE_BYTES: usize = 4 << 20;

/// The reserved memory of one column, by its addresses. Nothing is read or written through it.
#[derive(Debug)]
pub(crate) struct Region {
    /// Index of the sensor whose samples it holds.
    pub(super) sensor: usize,
    /// Bytes that one sample takes.
    pub(super) sample_bytes: usize,
    pub(super) addresses: Range<usize>,
    /// Up to which address some thread obtains the pages.
    pub(super) obtained: AtomicUsize,
}

/// Reserves memory for exactly so many samples of `width` values, if available; otherwise the column
/// grows as values arrive. Returns the region if it is large.
pub(crate) fn reserve<T>(
    column: &mut Vec<T>,
    samples: u64,
    width: usize,
    sensor: usize,
) -> Option<Region> {
    let wanted = samples.saturating_mul(width as u64);
    let wanted = usize::try_from(wanted).unwrap_or(usize::MAX);
    let missing = wanted.saturating_sub(column.len());
    column.try_reserve_exact(missing).ok()?;
    let spare = column.spare_capacity_mut();
    let start = spare.as_ptr() as usize;
    let bytes = size_of_val(spare);
    (bytes >= LARGE_BYTES).then(|| Region {
        sensor,
        sample_bytes: width * size_of::<T>(),
        addresses: start..start + bytes,
        obtained: AtomicUsize::new(start.next_multiple_of(HUGE_PAGE_BYTES)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_reserved_once_and_excess_is_no_error() {
        let mut column = vec![1.5_f64];
        let region = reserve(&mut column, 3 << 20, 1, 0).unwrap();
        assert!(column.capacity() >= 3 << 20 && region.addresses.len() >= 23 << 20);
        let place = column.as_ptr();
        column.resize(3 << 20, 2.5);
        assert_eq!((column.as_ptr(), column[0]), (place, 1.5));
        assert!(column[1..].iter().all(|&value| value == 2.5));
        assert!(reserve(&mut column, u64::MAX, 12, 0).is_none());
        assert_eq!(column.len(), 3 << 20);
        assert!(reserve(&mut Vec::<u32>::new(), 1000, 2, 0).is_none());
    }
}
