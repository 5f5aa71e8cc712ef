//! Room for columns of many millions of values.

/// Below this a column is not worth a call to the system.
const LARGE_BYTES: usize = 4 << 20;

/// Makes room for as many values, exactly, if there is so much memory; without it the column grows as they
/// come. A large column gets large pages where the system has them: with pages of the common size it takes
/// longer to get the memory of a column than to decode the messages that fill it.
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
    /// The system takes whole pages of the common size only; it finds the large ones within.
    const PAGE_BYTES: usize = 64 << 10;
    if bytes < LARGE_BYTES {
        return;
    }
    let skipped = start.align_offset(PAGE_BYTES);
    let whole = bytes.saturating_sub(skipped) / PAGE_BYTES * PAGE_BYTES;
    // SAFETY: the range lies within memory that the column owns. The advice changes neither what stands
    // there nor who may use it; a system that refuses it goes on as before.
    let _ = unsafe { libc::madvise(start.add(skipped).cast(), whole, libc::MADV_HUGEPAGE) };
}

#[cfg(not(target_os = "linux"))]
fn ask_for_large_pages(_start: *mut u8, _bytes: usize) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_made_once_and_too_much_of_it_is_no_error() {
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
