//! A short run of what `benches/crash.rs` does for long.

use crate::support::World;
use crate::support::favour::favour;
use crate::support::killing::{
    kill_controls, kill_monitors, kill_producers, kill_recorders, kill_screens, left_over,
};

const KILLS: usize = 4;

#[test]
fn a_killed_monitor_is_followed_by_the_next() {
    let _favoured = favour();
    let world = World::new("km");
    let first = kill_monitors(&world, 1);
    let (_, files) = left_over(&world);
    let times = kill_monitors(&world, KILLS);
    times.print("monitor: start to first row");
    let (dead, files_after) = left_over(&world);
    assert_eq!(dead, 0);
    assert!(files_after <= files, "{files_after} files, {files} before");
    drop(first);
}

#[test]
fn a_killed_producer_is_told_and_followed_by_the_next() {
    let _favoured = favour();
    let world = World::new("kp");
    kill_producers(&world, KILLS).print("producer: start to first row");
    assert_eq!(left_over(&world).0, 0);
}

#[test]
fn a_killed_control_is_followed_by_one_that_begins_closed() {
    let _favoured = favour();
    let world = World::new("kc");
    kill_controls(&world, KILLS).print("control: start to first row");
    assert_eq!(left_over(&world).0, 0);
}

#[test]
fn a_killed_screen_disturbs_nobody() {
    let _favoured = favour();
    let world = World::new("kw");
    if let Some(times) = kill_screens(&world, KILLS) {
        times.print("screen killed: next row");
    }
}

#[test]
fn a_killed_recorder_leaves_all_but_the_last_moment() {
    let _favoured = favour();
    let world = World::new("kr");
    let folder = tempfile::tempdir().unwrap();
    let recorded = kill_recorders(&world, folder.path(), KILLS);
    recorded.started.print("recorder: start to first samples");
    recorded.lost.print("recorder killed: samples lost");
    assert_eq!(recorded.holes, 0);
    // 20 ms by itself; the rest is the wait for a processor of a busy computer, which not every kill meets
    assert!(recorded.lost.quantile(0.25) < 60.0, "{:?}", recorded.lost);
}
