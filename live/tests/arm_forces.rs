//! Measured forces of the arm's cylinders, by which nothing is computed: they are compared with what masses and motion require.

use std::path::{Path, PathBuf};

use tipwatch_live::wire::topics::{Kind, WireSample, WireVerdict};
use tipwatch_mechanics::machine::Proofs;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::{Basis, InputFault};

use crate::payloads::{PRESSURES, rows_of, with_payload};

/// The stream of the tilt cylinder's force, behind the two pressures of the lift cylinder, and its bit in the verdict.
const TILT: u32 = 2;
const TILT_BIT: u32 = 0b10;

/// The machine of `lift_payload` with its payload, the pressures of its lift cylinder and the force of its tilt cylinder, as which
/// `tilt` changes it.
pub(crate) fn with_forces(folder: &Path, tilt: &str) -> PathBuf {
    let path = with_payload(folder, PRESSURES, "320.0");
    let text = std::fs::read_to_string(&path).unwrap();
    let force = format!(
        "name = \"tilt\"\nforce = {{ topic = \"/actuators\", joint = \"tilt_rod\"{tilt} }}\n"
    );
    std::fs::write(&path, text.replacen("name = \"tilt\"\n", &force, 1)).unwrap();
    path
}

/// The verdicts on the rows, with the samples of the tilt cylinder's force changed from this time on (s); `None` is lost before it was
/// numbered.
fn rows(from_s: f64, mut change: impl FnMut(f64) -> Option<f64>) -> Vec<(f64, WireVerdict)> {
    let folder = tempfile::tempdir().unwrap();
    let machine = with_forces(folder.path(), "");
    let change = |since_s: f64, mut wire: WireSample| {
        let is_of_tilt = wire.kind == Kind::Force as u32 && wire.stream == TILT;
        if is_of_tilt && since_s >= from_s {
            wire.values[0] = change(wire.values[0])?;
        }
        Some(wire)
    };
    rows_of("lift_payload.mcap", &machine, Proofs::ALL, change)
}

fn is_doubted(verdict: &WireVerdict) -> bool {
    verdict.row_reasons().has(Reason::Contradiction)
}

/// A wrong force leaves the loads as they are.
fn assert_loads_of(rows: &[(f64, WireVerdict)], good: &[(f64, WireVerdict)]) {
    assert_eq!(rows.len(), good.len());
    for ((_, row), (_, good)) in rows.iter().zip(good) {
        assert_eq!(row.load.map(f64::to_bits), good.load.map(f64::to_bits));
    }
}

#[test]
fn good_forces_cast_no_doubt() {
    let good = rows(0.0, Some);
    assert!(good.len() > 600, "{}", good.len());
    for (since_s, row) in &good {
        assert_eq!([row.doubted_forces, row.frozen_forces], [0; 2], "{since_s}");
        assert!(!is_doubted(row), "{since_s}");
    }
}

// requirement: TW-VERDICT-26
#[test]
fn a_wrong_force_is_doubted_after_two_seconds_and_changes_no_load() {
    let good = rows(0.0, Some);
    let wrong: [fn(f64) -> f64; 3] = [|force| 2.0 * force, |force| -force, |force| force + 40e3];
    for wrong in wrong {
        let found = rows(0.0, |force| Some(wrong(force)));
        let (first_s, _) = found
            .iter()
            .find(|(_, row)| row.doubted_forces != 0)
            .unwrap();
        // a second of settling, a second until the uncertainty of the masses is known, and two of rows that are off
        assert!((2.5..4.5).contains(first_s), "{first_s}");
        for (since_s, row) in &found {
            let is_off = since_s >= first_s;
            assert_eq!(
                row.doubted_forces,
                TILT_BIT * u32::from(is_off),
                "{since_s}"
            );
            assert_eq!(row.frozen_forces, 0);
            if row.row_reasons().leave_valid() {
                assert_eq!(is_doubted(row), is_off, "{since_s}");
            }
            if is_off {
                assert_eq!(row.verdict().basis, Basis::Doubted);
                assert!(!row.verdict().level.sees_no_danger());
            }
        }
        assert_loads_of(&found, &good);
    }
}

/// A force that falls silent, or whose samples are no numbers.
// requirement: TW-FAULT-02
#[test]
fn a_force_that_is_missing_is_a_fault_and_changes_no_load() {
    let good = rows(0.0, Some);
    for missing in [None, Some(f64::NAN)] {
        let found = rows(3.0, |_| missing);
        let is_stale = |row: &WireVerdict| row.verdict().held.faults.has(InputFault::Stale);
        for (since_s, row) in &found {
            if *since_s < 3.0 {
                assert!(!is_stale(row), "{since_s}");
            }
            assert!(!is_doubted(row), "{since_s}");
        }
        assert!(is_stale(&found.last().unwrap().1));
        assert_loads_of(&found, &good);
    }
}

/// A force that stops, and one that no cylinder has, are told and used no more.
// requirement: TW-FAULT-10
#[test]
fn a_force_that_stops_or_is_impossible_is_a_caution() {
    let good = rows(0.0, Some);
    let mut first = None;
    let stuck = rows(2.0, |force| Some(*first.get_or_insert(force)));
    let impossible = rows(2.0, |_| Some(1e9));
    for (found, fault) in [
        (stuck, InputFault::Frozen),
        (impossible, InputFault::OutOfRange),
    ] {
        let is_told = |row: &WireVerdict| row.verdict().held.cautions.has(fault);
        assert!(
            !found
                .iter()
                .any(|(since_s, row)| *since_s < 2.0 && is_told(row))
        );
        assert!(is_told(&found.last().unwrap().1), "{fault:?}");
        assert!(!found.iter().any(|(_, row)| is_doubted(row)), "{fault:?}");
        assert_loads_of(&found, &good);
    }
}
