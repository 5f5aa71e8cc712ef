//! Memory for columns of many millions of values.

/// Smaller columns are not worth a system call.
const LARGE_BYTES: usize = 4 << 20;

/// Reserves memory for exactly `values` values, if available; otherwise the column grows as values
/// arrive. A large column gets huge pages where the system has them: with normal pages, allocating
/// the column takes longer than decoding the messages that fill it.
pub(crate) fn reserve<T>(column: &mut Vec<T>, values: u64) {
    let wanted = usize::try_from(values).unwrap_or(usize::MAX);
    let missing = wanted.saturating_sub(column.len());
    if column.try_reserve_exact(missing).is_ok() {
        let spare = column.spare_capacity_mut();
        ask_for_large_pages(spare.as_mut_ptr().cast(), size_of_val(spare));
    }
}

#[cfg(target_os = "linux")]
#[allow(unsafe_code, reason = "the advice is a system call")]
fn ask_for_large_pages(start: *mut u8, bytes: usize) {
    /// The advice takes whole normal pages; the system finds the huge pages inside.
    const PAGE_BYTES: usize = 64 << 10;
    if bytes < LARGE_BYTES {
        return;
    }
    let skipped = start.align_offset(PAGE_BYTES);
    let whole = bytes.saturating_sub(skipped) / PAGE_BYTES * PAGE_BYTES;
    // SAFETY: the range lies within memory that the column owns. The advice changes neither content
    // nor access; a system that refuses it is unaffected.
    let _ = unsafe { libc::madvise(start.add(skipped).cast(), whole, libc::MADV_HUGEPAGE) };
}

#[cfg(not(target_os = "linux"))]
fn ask_for_large_pages(_start: *mut u8, _bytes: usize) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_reserved_once_and_excess_is_no_error() {
        let mut column = vec![1.5_f64];
        reserve(&mut column, 3 << 20);
        assert!(column.capacity() >= 3 << 20);
        let place = column.as_ptr();
        column.resize(3 << 20, 2.5);
        assert_eq!((column.as_ptr(), column[0]), (place, 1.5));
        assert!(column[1..].iter().all(|&value| value == 2.5));
        reserve(&mut column, u64::MAX);
        assert_eq!(column.len(), 3 << 20);
    }
}
