//! The system calls.

use super::page_size::PageSize;

/// The size of a huge page.
pub(super) const HUGE_PAGE_BYTES: usize = 2 << 20;

/// Obtains one huge page's worth of memory from this address on, which is a multiple of that size;
/// `false` if the system cannot do so on request. Its content stays as it is.
#[cfg(target_os = "linux")]
#[allow(unsafe_code, reason = "the advice is a system call")]
pub(super) fn obtain(start: usize, size: PageSize) -> bool {
    let advice = match size {
        PageSize::Huge => libc::MADV_HUGEPAGE,
        PageSize::Normal => libc::MADV_NOHUGEPAGE,
    };
    let start = std::ptr::with_exposed_provenance_mut(start);
    // SAFETY: the advice changes neither content nor access of the memory at these addresses,
    // whoever owns it by now: it chooses the size of pages that are not there yet, and obtains them
    // as a write that leaves every byte as it is. Where no memory is, it is an error.
    let (_, obtained) = unsafe {
        (
            // a system without huge pages refuses this one, and gives normal ones
            libc::madvise(start, HUGE_PAGE_BYTES, advice),
            libc::madvise(start, HUGE_PAGE_BYTES, libc::MADV_POPULATE_WRITE),
        )
    };
    obtained == 0
}

#[cfg(not(target_os = "linux"))]
pub(super) fn obtain(_start: usize, _size: PageSize) -> bool {
    false
}

/// Processor time of this thread (ns); zero if unknown. Other programs do not count.
#[cfg(target_os = "linux")]
#[allow(unsafe_code, reason = "the clock is a system call")]
pub(super) fn thread_time_ns() -> u64 {
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: the call writes only the borrowed value.
    let code = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    let ns = time
        .tv_sec
        .saturating_mul(1_000_000_000)
        .saturating_add(time.tv_nsec);
    u64::try_from(ns).unwrap_or(0) * u64::from(code == 0)
}

#[cfg(not(target_os = "linux"))]
pub(super) fn thread_time_ns() -> u64 {
    0
}
