//! The independent client, in its short form: faults, a wrong sensor, acknowledgements and a restart.

use std::process::Command;

/// The interpreter.
pub(crate) fn python() -> Command {
    Command::new(std::env::var("TIPWATCH_PYTHON").unwrap_or_else(|_| "python3".into()))
}

mod needs_python_iceoryx2 {
    use crate::support::data;

    const CLIENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/independent/client.py");

    #[test]
    #[ignore = "needs Python with the packages iceoryx2 and polars; TIPWATCH_PYTHON names the interpreter"]
    fn client_that_knows_only_the_header_is_not_fooled() {
        let ran = super::python()
            .args([CLIENT, env!("CARGO_BIN_EXE_tipwatch-live")])
            .args([data("swing_lift.mcap"), data("tiny_lift.mcap")])
            .arg("--short")
            .output()
            .unwrap();
        let (out, err) = (
            String::from_utf8_lossy(&ran.stdout),
            String::from_utf8_lossy(&ran.stderr),
        );
        println!("{out}");
        assert!(ran.status.success(), "{out}{err}");
        assert!(out.contains(" 0 failures"), "{out}{err}");
    }
}
