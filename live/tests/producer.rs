//! The example of a producer in Python.

use std::process::Command;

use crate::support::{World, data};

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/producer.py");

mod needs_python_iceoryx2 {
    use super::*;

    #[test]
    #[ignore = "needs Python with the package iceoryx2; TIPWATCH_PYTHON names the interpreter"]
    fn monitor_understands_a_python_producer() {
        let python = std::env::var("TIPWATCH_PYTHON").unwrap_or_else(|_| "python3".into());
        let world = World::new("py");
        let monitor = world.monitor(&data("tiny.toml"), &["--json"]);
        let mut command = Command::new(python);
        command.arg(EXAMPLE);
        let (machine, urdf) = (data("tiny.toml"), data("tiny.urdf"));
        let arguments = [machine.to_str().unwrap(), urdf.to_str().unwrap()];
        let producer = world.start_by(command, &[&arguments[..], &["--seconds", "4"]].concat());
        let producer = producer.end();
        assert!(producer.status.success(), "{}", producer.err);
        let monitor = monitor.end();
        assert!(monitor.status.success(), "{}", monitor.err);
        assert!(
            monitor.out.contains("\"verdict\":\"safe\""),
            "{}",
            monitor.err
        );
        // no sample is implausible
        assert!(!monitor.out.contains("frozen"), "{}", monitor.err);
        assert!(
            monitor.err.contains("0 lost, 0 refused, 0 repeated"),
            "{}",
            monitor.err
        );
    }
}
