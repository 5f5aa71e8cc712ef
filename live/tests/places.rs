//! The last places of readers are kept for the programs that watch the machine: whoever opens too many readers gets the
//! error, and they start.

use tipwatch_live::node::{EventListener, LiveNode, Receiver};
use tipwatch_live::wire::topics::{
    MAX_READERS, RESERVED_READERS, Topic, WireAcknowledge, WireSample, WireSession, WireVerdict,
};

use crate::support::killing::Reading;
use crate::support::producing::Producing;
use crate::support::{World, data};

const MACHINE: &str = "tiny_lift";
const FREE: usize = MAX_READERS - RESERVED_READERS;

/// As many readers of a service as are free; one more is refused.
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
