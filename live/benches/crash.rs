//! Kills each process many times at random moments: `cargo bench --workspace --bench crash -- 200`, or only one
//! of them: `-- 200 recorder`.

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
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut counts = arguments.iter().filter_map(|text| text.parse().ok());
    let count = counts.next().unwrap_or(20);
    let parts = ["monitor", "producer", "control", "screen", "recorder"];
    let asked: Vec<&str> = parts
        .into_iter()
        .filter(|part| arguments.iter().any(|text| text == part))
        .collect();
    for part in parts {
        if asked.is_empty() || asked.contains(&part) {
            kill(part, count);
        }
    }
}

fn kill(part: &str, count: usize) {
    let world = World::new("kill");
    match part {
        "monitor" => {
            kill_monitors(&world, count).print("monitor killed: start to first row of the next");
        }
        "producer" => {
            kill_producers(&world, count).print("producer killed: start to first row of the next");
        }
        "control" => {
            kill_controls(&world, count).print("control killed: start to first row of the next");
        }
        "screen" => {
            kill_screens(&world, count).print("screen killed: the monitor's next row");
        }
        _ => recorders(&world, count),
    }
    let (dead, files) = left_over(&world);
    println!("left behind: {dead} dead nodes, {files} files");
    // iceoryx2 0.10 cannot remove what was killed while it was being made, as screens are here
    assert!(dead == 0 || part == "screen");
}

fn recorders(world: &World, count: usize) {
    let folder = tempfile::tempdir().unwrap();
    let recorded = kill_recorders(world, folder.path(), count);
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
}
