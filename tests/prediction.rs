//! Lead time, false alarms and load errors of the prediction, compared with simulated ground truth, beside the plain rate.
//!
//! `tests/data/make_prediction.py LAB OUT` makes the logs; `TIPWATCH_PREDICTION_LOGS=OUT cargo test --workspace --test tests
//! prediction:: -- --ignored --nocapture` prints the tables of `book/src/concepts/prediction.md`.
//! `TIPWATCH_PREDICTION_KEYS` replaces keys of `[prediction]`, to see what they do.

mod alarms;
mod followed;
mod tables;

use std::path::{Path, PathBuf};

use tipwatch_tests::data;

use followed::Followed;

/// Logs of this repository with truth at 250 or 500 Hz, not smoothed. The settings were chosen while looking at them, too.
const OWN: [&str; 7] = [
    "tip_over",
    "swing_lift",
    "tiny_lift",
    "tiny",
    "hard_brake",
    "corner_brake",
    "swinging_drive",
];

fn logs_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let files = entries.map(|entry| entry.unwrap().path());
    let mut logs: Vec<_> = files
        .filter(|path| path.extension().is_some_and(|ending| ending == "mcap"))
        .filter(|path| path.with_extension("truth.parquet").exists())
        .collect();
    logs.sort();
    logs
}

fn followed(logs: &[PathBuf]) -> Vec<Followed> {
    logs.iter().map(|log| Followed::new(log)).collect()
}

#[test]
fn prediction_leads_the_lift_of_a_simulated_tip_over() {
    let tip_over = Followed::new(&data("tip_over.mcap"));
    let lifts = tip_over.lifts();
    assert_eq!(lifts.len(), 1, "{lifts:?}");
    let lead_s = alarms::lead_s(&tip_over, &lifts[0], &alarms::GO_ON);
    assert!(lead_s > 1.0, "{lead_s}");
}

#[test]
fn prediction_is_quiet_while_no_wheel_comes_near_to_lifting() {
    for name in ["tiny", "corner_brake"] {
        let quiet = Followed::new(&data(&format!("{name}.mcap")));
        assert!(quiet.lifts().is_empty());
        let raised = alarms::episodes(&quiet, &alarms::GO_ON);
        assert!(raised.is_empty(), "{name}: {raised:?}");
    }
}

mod needs_logs {
    use super::*;

    #[test]
    #[ignore = "needs the logs of make_prediction.py; TIPWATCH_PREDICTION_LOGS names their folder"]
    fn tables_of_lead_time_and_false_alarms() {
        let own = OWN.map(|name| data(&format!("{name}.mcap")));
        println!("{}", tables::of("own", &followed(&own)));
        let Some(folder) = std::env::var_os("TIPWATCH_PREDICTION_LOGS") else {
            panic!("expected TIPWATCH_PREDICTION_LOGS, found none");
        };
        let only = std::env::var("TIPWATCH_PREDICTION_SET").unwrap_or_default();
        for set in ["tuning", "held_out", "shared"] {
            let folder = Path::new(&folder).join(set);
            if folder.exists() && (only.is_empty() || only == set) {
                println!("{}", tables::of(set, &followed(&logs_in(&folder))));
            }
        }
    }
}
