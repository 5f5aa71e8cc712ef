//! Kills each process many times at random moments: `cargo bench -p tipwatch-live --bench crash -- 200`.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    dead_code,
    reason = "a program for people, on the helpers of the tests"
)]

#[path = "../tests/support/mod.rs"]
mod support;

use support::World;
use support::killing::{
    Times, kill_controls, kill_monitors, kill_producers, kill_recorders, kill_screens, left_over,
};

fn main() {
    let mut counts = std::env::args().filter_map(|argument| argument.parse().ok());
    let count = counts.next_back().unwrap_or(20);
    let clean = |world: &World| {
        let (dead, files) = left_over(world);
        println!("left behind: {dead} dead nodes, {files} files");
        assert_eq!(dead, 0);
    };

    let world = World::new("bm");
    kill_monitors(&world, count).print("monitor killed: start to first row of the next");
    clean(&world);

    let world = World::new("bp");
    kill_producers(&world, count).print("producer killed: start to first row of the next");
    clean(&world);

    let world = World::new("bc");
    kill_controls(&world, count).print("control killed: start to first row of the next");
    clean(&world);

    let world = World::new("bw");
    if let Some(times) = kill_screens(&world, count) {
        times.print("screen killed: the monitor's next row");
    }
    clean(&world);

    let world = World::new("br");
    let folder = tempfile::tempdir().unwrap();
    let recorded = kill_recorders(&world, folder.path(), count);
    recorded
        .started
        .print("recorder killed: start to first samples of the next");
    let lost: &Times = &recorded.lost;
    lost.print("recorder killed: samples lost");
    let beyond = lost.0.iter().filter(|lost| **lost > 20.0).count();
    println!(
        "of {count}: {beyond} lost more than 20 ms; holes in files: {}",
        recorded.holes
    );
    clean(&world);
}
