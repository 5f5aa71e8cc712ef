//! The examples in Python: a producer, and a subscriber beside it.

use std::time::{Duration, Instant};

use tipwatch_live::wire::topics::{WireSample, WireVerdict};

use crate::support::{Process, World, data};

const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");

/// An example, for the machine "tiny".
fn start(world: &World, example: &str, options: &[&str]) -> Process {
    let mut command = super::independent::python();
    command.arg(format!("{EXAMPLES}/{example}"));
    let (machine, urdf) = (data("tiny.toml"), data("tiny.urdf"));
    let arguments = [machine.to_str().unwrap(), urdf.to_str().unwrap()];
    let arguments = [&arguments[..], options].concat();
    world.start_by(command, &arguments)
}

/// Faults of a producer that the processor kept waiting: they say nothing of its samples.
const LATE: [&str; 3] = ["stale", "clock_jump", "verdict_late"];

/// The rows that a monitor printed.
fn rows(json: &str) -> impl Iterator<Item = serde_json::Value> {
    let lines = json
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    lines.filter(|line| line["event"] == "row")
}

/// The levels of the rows that a monitor printed, but for those that only say that samples were late.
fn levels(json: &str) -> Vec<String> {
    let is_late = |row: &serde_json::Value| {
        let mut held = row["held_faults"].as_array().unwrap().iter().peekable();
        held.peek().is_some() && held.all(|fault| LATE.contains(&fault.as_str().unwrap()))
    };
    let rows = rows(json).filter(|row| !is_late(row));
    rows.map(|row| row["verdict"].as_str().unwrap().into())
        .collect()
}

mod needs_python_iceoryx2 {
    use super::*;

    #[test]
    #[ignore = "needs Python with the package iceoryx2; TIPWATCH_PYTHON names the interpreter"]
    fn monitor_understands_a_python_producer() {
        let world = World::new("py");
        let monitor = world.monitor(&data("tiny.toml"), &["--json"]);
        // 20 s of the machine: contradictions take a while
        let producer = start(&world, "producer.py", &["--seconds", "20", "--pace", "4"]);
        let subscriber = start(&world, "subscriber.py", &["--seconds", "5"]);
        let producer = producer.end();
        assert!(producer.status.success(), "{}", producer.err);
        let monitor = monitor.end();
        assert!(monitor.status.success(), "{}", monitor.err);
        assert!(
            monitor.out.contains("\"verdict\":\"assumed\""),
            "{}",
            monitor.err
        );
        // no sample is implausible, and none contradicts another
        for row in rows(&monitor.out) {
            for fault in row["faults"].as_array().unwrap() {
                let is_of_sensors = fault == "frozen" || fault == "contradiction";
                assert!(!is_of_sensors, "{row}: {}", monitor.err);
            }
        }
        let levels = levels(&monitor.out);
        assert!(levels.len() > 1500, "{} rows", levels.len());
        let settled = levels.iter().position(|level| level == "assumed");
        let settled = settled.unwrap();
        assert!(settled < 100, "{settled}");
        let bad = |level: &&String| ["unknown", "fault"].contains(&level.as_str());
        let found = levels[settled..].iter().find(bad);
        assert_eq!(found, None, "{}", monitor.err);
        assert!(
            monitor.err.contains("0 lost, 0 refused, 0 repeated"),
            "{}",
            monitor.err
        );
        let subscriber = subscriber.end();
        assert!(subscriber.status.success(), "{}", subscriber.err);
        let said: Vec<&str> = subscriber.out.lines().collect();
        assert!(said.contains(&"assumed"), "{said:?}");
        let last = said.last().unwrap();
        assert!(last.contains(" verdicts, 0 lost, "), "{last}");
        assert!(!last.starts_with("0 "), "{last}");
    }

    #[test]
    #[ignore = "needs Python with the package iceoryx2; TIPWATCH_PYTHON names the interpreter"]
    fn python_producer_rings_the_event() {
        let world = World::new("pyevent");
        let node = world.join();
        let listener = node.event_listener::<WireSample>().unwrap();
        let _producer = start(&world, "producer.py", &["--seconds", "60"]);
        world.wait_for_producer();
        for _ in 0..10 {
            let start = Instant::now();
            listener.wait(Duration::from_secs(5));
            assert!(start.elapsed() < Duration::from_secs(3));
        }
    }

    #[test]
    #[ignore = "needs Python with the package iceoryx2; TIPWATCH_PYTHON names the interpreter"]
    fn subscriber_calls_silence_a_fault() {
        let world = World::new("pysilent");
        let ended = start(&world, "subscriber.py", &["--seconds", "1"]).end();
        assert_eq!(ended.out.lines().next(), Some("fault no valid verdict"));
        assert!(ended.out.contains("0 verdicts"), "{}", ended.out);
        // the settings of the service are those of the program
        drop(world.join().receiver::<WireVerdict>().unwrap());
    }
}
