//! The last places of readers are kept for the programs that watch the machine: whoever opens too many readers gets the
//! error, and they start.

use std::time::{Duration, Instant};

use tipwatch_live::node::{EventListener, LiveNode, Receiver, Sender};
use tipwatch_live::wire::topics::{
    MAX_READERS, RESERVED_READERS, Topic, WireAcknowledge, WireProgress, WireSample, WireSession,
    WireVerdict,
};

use crate::support::killing::Reading;
use crate::support::producing::Producing;
use crate::support::{World, data};

const MACHINE: &str = "tiny_lift";
const FREE: usize = MAX_READERS - RESERVED_READERS;

/// Takes all free places of readers of a service; asserts that one more reader is refused.
fn fill<T: Topic>(node: &LiveNode) -> Vec<Receiver<T>> {
    let taken: Vec<_> = (0..FREE).map(|_| node.receiver().unwrap()).collect();
    for _ in 0..RESERVED_READERS {
        let Err(error) = node.receiver::<T>() else {
            panic!("a place of {} that is kept", T::SUFFIX);
        };
        let text = format!("{error:#}");
        assert!(
            text.contains(T::SUFFIX) && text.contains("places"),
            "{text}"
        );
    }
    taken
}

fn fill_events(node: &LiveNode) -> Vec<EventListener> {
    let listener = || node.event_listener::<WireSample>();
    let taken: Vec<_> = (0..FREE).map(|_| listener().unwrap()).collect();
    assert!(listener().is_err());
    taken
}

// requirement: TW-VERDICT-30
#[test]
fn too_many_readers_are_refused_and_a_monitor_starts_again() {
    let world = World::new("places");
    let node = world.join();
    let _sessions = fill::<WireSession>(&node);
    let _samples = fill::<WireSample>(&node);
    let _acknowledgements = fill::<WireAcknowledge>(&node);
    let _events = fill_events(&node);
    let mut verdicts = fill::<WireVerdict>(&node);
    let reading = Reading(verdicts.pop().unwrap());
    // the producer reads verdicts, too
    drop(verdicts.pop());
    let machine = data(&format!("{MACHINE}.toml"));
    let producing = Producing::start(&world.address(), MACHINE);
    let mut before = 0;
    for _ in 0..3 {
        let monitor = world.monitor(&machine, &["--quiet", "--stay", "--wake", "event"]);
        let found = reading.wait_for("a verdict of a session", |verdict| {
            verdict.source != before && verdict.session != 0
        });
        before = found.source;
        // it leaves its places behind
        monitor.kill();
    }
    producing.end();
}

/// Readers that keep no place free: as many as iceoryx2 allows.
fn take_all<T: Topic>(world: &World) -> Vec<Receiver<T>> {
    let node = LiveNode::new(&world.address(), "tipwatch-record").unwrap();
    (0..MAX_READERS).map(|_| node.receiver().unwrap()).collect()
}

/// Whoever reads without the library of Tipwatch can hold the last places, too: then it is told who, and a place that becomes
/// free in some seconds is taken.
// requirement: TW-VERDICT-30
#[test]
fn monitor_and_acknowledgement_wait_for_a_place_and_name_who_holds_them() {
    let world = World::new("taken");
    let mut taken = take_all::<WireVerdict>(&world);
    let own = format!("process {}: {MAX_READERS}", std::process::id());
    let refused = world.start(&["acknowledge"]).end();
    assert_eq!(refused.status.code(), Some(1));
    assert!(refused.err.contains(&own), "{}", refused.err);
    let waiting = world.start(&["acknowledge"]);
    std::thread::sleep(Duration::from_secs(1));
    taken.pop();
    let waited = waiting.end();
    // it had its place, and there is no monitor
    assert!(
        waited.err.contains("is a monitor running?"),
        "{}",
        waited.err
    );
    let _samples = take_all::<WireSample>(&world);
    let machine = data(&format!("{MACHINE}.toml"));
    let monitor = world.monitor(&machine, &["--quiet", "--stay"]).end();
    assert_eq!(monitor.status.code(), Some(1));
    assert!(monitor.err.contains(&own), "{}", monitor.err);
}

/// Writers, notifiers and programs that have a service open are limited, too.
// requirement: TW-VERDICT-30
#[test]
fn too_many_writers_are_refused_and_those_of_others_keep_no_monitor_from_its_start() {
    let world = World::new("writers");
    let node = world.join();
    let refused =
        |error: anyhow::Error| assert!(format!("{error:#}").contains("places"), "{error:#}");
    let mut writers: Vec<Sender<WireProgress>> = Vec::new();
    while writers.len() < FREE {
        writers.push(node.sender(1, 1).unwrap());
    }
    refused(node.sender::<WireProgress>(1, 1).unwrap_err());
    let _acknowledging: Vec<Sender<WireAcknowledge>> =
        (0..FREE).map(|_| node.sender(1, 1).unwrap()).collect();
    refused(node.sender::<WireAcknowledge>(1, 1).unwrap_err());
    // as if they were not of Tipwatch: they leave no place
    let foreign = LiveNode::new(&world.address(), "tipwatch-record").unwrap();
    while writers.len() < MAX_READERS {
        writers.push(foreign.sender(1, 1).unwrap());
    }
    let notifiers: Vec<_> = (0..MAX_READERS)
        .map(|_| foreign.event_notifier::<WireSample>().unwrap())
        .collect();
    let machine = data(&format!("{MACHINE}.toml"));
    let monitor = world.monitor(&machine, &["--quiet", "--stay", "--wake", "event"]);
    let reading = Reading(node.receiver().unwrap());
    let producing = Producing::start(&world.address(), MACHINE);
    reading.wait_for("a verdict of a session", |verdict| verdict.session != 0);
    producing.end();
    monitor.kill();
    drop((writers, notifiers));
}

#[test]
fn the_monitor_of_a_machine_is_found_among_several() {
    let world = World::new("several");
    let path = |name: &str| data(&format!("{name}.toml")).to_str().unwrap().to_owned();
    let start = |name: &str| {
        let state = world.state_folder.join(name);
        let state = state.to_str().unwrap();
        let machine = path(name);
        world.start(&[
            "monitor",
            "--machine",
            &machine,
            "--state",
            state,
            "--service",
            name,
            "--stay",
        ])
    };
    let (one, other) = (start("tiny"), start("crane"));
    let ask = |name: &str| {
        world
            .start(&["acknowledge", "--machine", &path(name)])
            .end()
    };
    let began = Instant::now();
    while !(ask("tiny").status.success() && ask("crane").status.success()) {
        assert!(
            began.elapsed() < Duration::from_secs(20),
            "{}",
            ask("tiny").err
        );
    }
    one.kill();
    let gone = ask("tiny");
    assert!(!gone.status.success());
    assert!(
        gone.err
            .contains("expected a running monitor of this machine file"),
        "{}",
        gone.err
    );
    assert!(gone.err.contains("crane"), "{}", gone.err);
    let found = ask("crane");
    assert!(
        found.status.success() && found.err.contains("the monitor has no alarm"),
        "{}",
        found.err
    );
    // nor is the name of the services stated twice
    let twice = world
        .start(&[
            "acknowledge",
            "--machine",
            &path("crane"),
            "--service",
            "crane",
        ])
        .end();
    assert_eq!(twice.status.code(), Some(2), "{}", twice.err);
    other.kill();
}
