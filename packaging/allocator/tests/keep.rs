//! Memory that was freed is kept for the next task.

#![cfg(target_os = "linux")]

use std::hint::black_box;

use tipwatch_allocator::{Allocator, keep_between_tasks};

#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

/// Buffers of a task, and their length in bytes.
const BUFFERS: usize = 2000;
const LENGTH: usize = 20_000;
const TASKS: usize = 25;

/// Pages that the system has given this process so far.
fn pages() -> u64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("Linux states it");
    let fields = stat.rsplit_once(')').expect("a name in brackets").1;
    let faults = fields.split_whitespace().nth(7);
    let faults = faults.and_then(|number| number.parse().ok());
    faults.expect("a number of faults")
}

#[test]
fn tasks_use_the_memory_of_those_before() {
    keep_between_tasks();
    let task = || {
        let before = pages();
        // what is freed in the middle may be taken back while the task goes on
        (0..4).for_each(|_| drop(black_box(vec![vec![1_u8; LENGTH]; BUFFERS])));
        pages() - before
    };
    let first = task();
    assert!(first as usize > BUFFERS * LENGTH / 4096 / 2, "{first}");
    let mut others: Vec<u64> = (1..TASKS).map(|_| task()).collect();
    others.sort_unstable();
    // a busy computer may hold up some of them for more than a second
    let usual = others[others.len() / 2];
    assert!(usual < first / 20, "{first}, then {others:?} pages");
}
