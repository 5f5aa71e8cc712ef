//! The monitor's reference loads are the machine's, not those of its first row.

use tipwatch_live::monitor::Monitor;
use tipwatch_live::wire::session::Session;
use tipwatch_live::wire::topics::{EVENT_ROW, WireVerdict};
use tipwatch_mechanics::verdict::Level;

use crate::support::feed::{machine, samples};
use crate::support::seal;

/// Verdicts on the rows of `tiny_lift` by a monitor that starts this many seconds into the log.
fn verdicts_from(start_s: f64) -> Vec<WireVerdict> {
    let (file, urdf) = machine("tiny_lift");
    let (recording, samples) = samples("tiny_lift");
    let session = Session {
        id: 7,
        ..recording.session
    };
    let (machine, sensors) = session.machine(&file, &urdf).unwrap();
    let first_ns = samples[0].time_ns;
    let start_ns = first_ns + (start_s * 1e9) as i64;
    let mut monitor = Monitor::new(machine, &sensors, &session, start_ns);
    let mut rows = Vec::new();
    let later = samples
        .into_iter()
        .filter(|sample| sample.time_ns >= start_ns);
    for (sequence, mut sample) in later.enumerate() {
        let now_ns = sample.time_ns + 1_000_000;
        seal(&mut sample, &session, sequence as u64, now_ns);
        monitor.take(&sample, now_ns, &mut |verdict| {
            if verdict.event == EVENT_ROW {
                rows.push(*verdict);
            }
            now_ns
        });
    }
    rows
}

#[test]
fn monitor_started_with_a_wheel_in_the_air_says_danger() {
    let rows = verdicts_from(1.3);
    let first_ns = rows[0].time_ns;
    // rear left comes down again at 2.45 s
    let in_the_air: Vec<_> = (rows.iter())
        .filter(|row| row.row_reasons().is_empty() && row.time_ns < first_ns + 1_000_000_000)
        .collect();
    assert!(in_the_air.len() > 50, "{}", in_the_air.len());
    for row in in_the_air {
        assert_eq!(
            row.verdict().level,
            Level::Danger,
            "utilisation {}",
            row.utilisation
        );
    }
}

// requirement: TW-VERDICT-17, TW-VERDICT-23
#[test]
fn every_fault_names_its_cause() {
    for row in verdicts_from(0.0).iter().chain(&verdicts_from(2.0)) {
        let held = row.verdict().held;
        if row.verdict().level == Level::Fault {
            assert!(!held.faults.is_empty() || !held.reasons.is_empty());
        }
        assert!(row.verdict().level.announces_lift_off() || row.time_to_lift_off_s.is_nan());
    }
}
