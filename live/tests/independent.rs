//! The independent client: faults, wrong sensors, acknowledgements and a restart in its short form, and its whole table of
//! wrong sensors.

use std::process::Command;

/// The interpreter.
pub(crate) fn python() -> Command {
    Command::new(std::env::var("TIPWATCH_PYTHON").unwrap_or_else(|_| "python3".into()))
}

mod needs_long {
    use crate::support::data;

    const CLIENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/independent/client.py");

    /// At most this share of the rows with a wheel in the air may be called Safe or Notice (percent).
    const MOST_PERCENT: &str = "2";
    /// The arm of `tiny_lift` moves from the first sample on: the bias of the gyro is not known before the log ends. Wrong
    /// encoders of tilt and extension change the reach alone, as a load on the tool does.
    const NOT_EXCITED: [&str; 3] = [
        "tiny_lift",
        "swing_lift: tilt and extension swapped",
        "swing_lift: extension: sign flipped",
    ];

    fn run(logs: &[&str], form: &str) {
        let ran = super::python()
            .args([CLIENT, env!("CARGO_BIN_EXE_tipwatch-live")])
            .args(logs.iter().map(|log| data(log)))
            .args([form, "--most-percent", MOST_PERCENT])
            .args(NOT_EXCITED.iter().flat_map(|it| ["--not-excited", it]))
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

    #[test]
    #[ignore = "takes a minute of processors that are free, and needs Python with the packages iceoryx2 and polars"]
    fn client_that_knows_only_the_header_is_not_fooled() {
        run(&["swing_lift.mcap", "tiny_lift.mcap"], "--short");
    }

    #[test]
    #[ignore = "takes four minutes, and needs Python with the packages iceoryx2 and polars"]
    fn client_is_fooled_by_no_wrong_sensor_that_the_motion_excites() {
        run(&["swing_lift.mcap", "side_reach.mcap"], "--sensors-only");
    }
}
