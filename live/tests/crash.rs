//! Killed processes: a short run of `benches/crash.rs`.

use std::path::Path;

use iceoryx2::prelude::*;
use tipwatch_live::node::LiveNode;
use tipwatch_live::wire::topics::WireVerdict;

use crate::support::killing::{
    Reading, kill_controls, kill_monitors, kill_producers, kill_recorders, kill_screens, left_over,
};
use crate::support::prioritise::prioritise;
use crate::support::{World, data};

const KILLS: usize = 4;

#[test]
fn killed_monitor_can_be_replaced() {
    let _prioritised = prioritise();
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

// requirement: TW-FAULT-20
#[test]
fn killed_producer_is_reported_and_replaced() {
    let _prioritised = prioritise();
    let world = World::new("kp");
    kill_producers(&world, KILLS).print("producer: start to first row");
    assert_eq!(left_over(&world).0, 0);
}

#[test]
fn successor_of_a_killed_control_starts_closed() {
    let _prioritised = prioritise();
    let world = World::new("kc");
    kill_controls(&world, KILLS).print("control: start to first row");
    assert_eq!(left_over(&world).0, 0);
}

/// iceoryx2 cannot list a tag that was killed in the making, and so cannot remove its node.
#[test]
fn node_killed_while_it_made_a_port_is_removed() {
    let world = World::new("young");
    let monitor = world.monitor(&data("tiny_lift.toml"), &["--quiet", "--stay"]);
    Reading::new(&world.join()).wait_for("a monitor", |_| true);
    monitor.kill();
    // what such a kill leaves, in the folder of every node of the monitor
    let nodes = Path::new("/tmp/iceoryx2/nodes");
    let of_world = |path: &Path| {
        let mut files = std::fs::read_dir(path).into_iter().flatten().flatten();
        files.any(|file| {
            file.file_name()
                .to_string_lossy()
                .starts_with(&world.prefix)
        })
    };
    let folders: Vec<_> = (std::fs::read_dir(nodes).unwrap().flatten())
        .map(|entry| entry.path())
        .filter(|path| path.is_dir() && of_world(path))
        .collect();
    assert!(!folders.is_empty());
    for folder in &folders {
        std::fs::write(folder.join(format!("{}7.port_tag", world.prefix)), "").unwrap();
        let tag = folder.join(format!("{}7.port_tag", world.prefix));
        let unfinished = std::os::unix::fs::PermissionsExt::from_mode(0o600);
        std::fs::set_permissions(tag, unfinished).unwrap();
    }
    // by iceoryx2 alone they stay
    let mut config = Config::global_config().clone();
    config.global.prefix = FileName::new(world.prefix.as_bytes()).unwrap();
    let alone = NodeBuilder::new()
        .config(&config)
        .create::<ipc::Service>()
        .unwrap();
    alone.try_cleanup_dead_nodes();
    alone.try_cleanup_dead_nodes();
    assert!(
        folders.iter().all(|folder| folder.exists()),
        "iceoryx2 removes them now: node/leftovers.rs can go"
    );
    drop(alone);
    std::thread::sleep(std::time::Duration::from_millis(2200));
    assert_eq!(left_over(&world).0, 0);
    for folder in folders {
        assert!(!folder.exists(), "{}", folder.display());
    }
}

/// Whoever opens shared memory without a size waits for the size, and he who would give it one is dead.
#[test]
fn shared_memory_killed_before_it_had_a_size_delays_nobody_for_long() {
    let world = World::new("unsized");
    let monitor = world.monitor(&data("tiny_lift.toml"), &["--quiet", "--stay"]);
    Reading::new(&world.join()).wait_for("a monitor", |_| true);
    monitor.kill();
    let memory = || {
        let entries = std::fs::read_dir("/dev/shm").unwrap().flatten();
        let paths = entries.map(|entry| entry.path());
        let of_world = |path: &Path| {
            let name = path.file_name().unwrap().to_string_lossy();
            name.starts_with(&world.prefix)
        };
        paths.filter(|path| of_world(path)).collect::<Vec<_>>()
    };
    // what such a kill leaves, here of all that the monitor had
    let left = memory();
    assert!(!left.is_empty());
    for path in &left {
        std::fs::File::create(path).unwrap();
    }
    let address = world.address();
    let (joined, waits) = std::sync::mpsc::channel();
    let joins = std::thread::spawn(move || {
        let node = LiveNode::new(&address, "test").unwrap();
        let receiver = node.receiver::<WireVerdict>().unwrap();
        joined.send(receiver.writers()).unwrap();
    });
    let writers = waits.recv_timeout(std::time::Duration::from_secs(20));
    assert_eq!(writers, Ok(0), "a process that joins waits for a dead one");
    joins.join().unwrap();
    for path in left {
        let len = path.metadata().map(|metadata| metadata.len());
        assert!(len.is_err() || len.unwrap() > 0, "{}", path.display());
    }
    assert_eq!(left_over(&world).0, 0);
}

mod needs_script {
    use super::*;

    #[test]
    #[ignore = "needs `script`, which gives the screen a terminal"]
    fn killed_screen_does_not_disturb_the_monitor() {
        let _prioritised = prioritise();
        let world = World::new("kw");
        kill_screens(&world, KILLS).print("screen killed: next row");
    }
}

// requirement: TW-RECORD-02
#[test]
fn killed_recorder_loses_only_the_last_batch() {
    let _prioritised = prioritise();
    let world = World::new("kr");
    let folder = tempfile::tempdir().unwrap();
    let recorded = kill_recorders(&world, folder.path(), KILLS);
    recorded.started.print("recorder: start to first samples");
    recorded.lost.print("recorder killed: samples lost");
    assert_eq!(recorded.holes, 0);
    // what the documents claim: 20 ms, except for waits for a processor, which not every kill meets
    assert!(recorded.lost.quantile(0.5) < 20.0, "{:?}", recorded.lost);
}
