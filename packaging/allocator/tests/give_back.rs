//! Memory that was freed is given back to the system.

#![cfg(target_os = "linux")]

use std::hint::black_box;

use tipwatch_allocator::{Allocator, give_back};

#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

/// Buffers of each thread, and their length in bytes: small enough that the allocator keeps their memory.
const BUFFERS: usize = 2000;
const LENGTH: usize = 20_000;

/// Memory of this process that is not that of files (kB).
fn used_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux states it");
    let line = status.lines().find(|line| line.starts_with("RssAnon:"));
    let number = line.and_then(|line| line.split_whitespace().nth(1));
    let number = number.and_then(|number| number.parse().ok());
    number.expect("a number of kB")
}

#[test]
fn memory_that_all_threads_have_freed_is_given_back() {
    let before = used_kb();
    let fill = || black_box(vec![vec![1_u8; LENGTH]; BUFFERS]);
    let of_threads = rayon::broadcast(|_| fill().len());
    drop(fill());
    let all = (of_threads.len() as u64 + 1) * (BUFFERS * LENGTH) as u64 / 1000;
    let kept = used_kb().saturating_sub(before);
    // otherwise this test shows nothing
    assert!(kept > all / 2, "{kept} of {all} kB are kept");
    give_back();
    let still = used_kb().saturating_sub(before);
    assert!(still < all / 20, "{still} of {all} kB are still kept");
}
