//! Refuses an analysis whose rows would not fit into memory, before the first of them is computed.

use std::borrow::Cow;

use anyhow::{Result, bail};
use tipwatch_mechanics::estimation::sorted_stamps;
use tipwatch_mechanics::state::Sensor;
use tipwatch_mechanics::{OutcomeColumns, Scope, State};

use crate::base::memory;
use crate::base::options::{Estimator, Options};
use crate::load::LoadedLog;

/// Memory for each number of each row of a table that is kept whole, documents included; measured 24 bytes (bytes).
const BYTES_PER_NUMBER: u64 = 32;
/// Memory for each row of any table: its time, its reasons and the activity of the machine (bytes).
const BYTES_PER_ROW: u64 = 64;
/// Longest time without joint states that rows at a regular rate bridge (s).
const LONGEST_BRIDGED_S: f64 = 3600.0;

/// Checks that the rows of a log fit into three quarters of the free memory. `is_kept` tells whether the whole table is kept.
///
/// # Errors
/// The rows do not fit.
pub(super) fn check(
    loaded: &LoadedLog,
    options: &Options,
    scope: Scope,
    is_kept: bool,
    log: &std::path::Path,
) -> Result<()> {
    let machine = &loaded.machine;
    let states = State::<f64>::size(machine);
    let numbers = match options.estimator {
        _ if is_kept => states + OutcomeColumns::empty(machine, scope).quantities.len(),
        Estimator::Causal => states,
        Estimator::Smoother => 0,
    };
    let bytes_per_row = BYTES_PER_ROW + numbers as u64 * BYTES_PER_NUMBER;
    check_rows(
        &stamps(loaded),
        options.rate_hz,
        machine.estimator().max_gap,
        bytes_per_row,
        memory::limit_bytes(),
    )
    .map_err(|error| error.context(log.display().to_string()))
}

/// The sorted stamps of the joint states that define the rows.
fn stamps(loaded: &LoadedLog) -> Cow<'_, [i64]> {
    let rows = (loaded.signals.iter()).find(|signal| signal.sensor == Sensor::Joints(0));
    rows.map_or(Cow::default(), |signal| {
        sorted_stamps(&signal.recording.stamps_ns)
    })
}

fn check_rows(
    stamps: &[i64],
    rate_hz: Option<f64>,
    max_gap_s: f64,
    bytes_per_row: u64,
    memory_bytes: u64,
) -> Result<()> {
    let most = memory_bytes / bytes_per_row;
    let longest_s = LONGEST_BRIDGED_S.max(max_gap_s);
    let pairs = stamps.windows(2);
    let bridged = pairs.map(|pair| pair[1].saturating_sub(pair[0]) as f64 * 1e-9);
    let bridged_s: f64 = bridged.filter(|gap_s| *gap_s <= longest_s).sum();
    let rows = match rate_hz {
        Some(hz) => bridged_s * hz,
        None => stamps.len() as f64,
    };
    if rows <= most as f64 {
        return Ok(());
    }
    let source = match rate_hz {
        Some(hz) => format!("{bridged_s:.1} s of joint states at --rate {hz}; choose a lower rate"),
        None => format!(
            "one for each joint state of {bridged_s:.1} s; choose a --rate below that of the joint states"
        ),
    };
    bail!(
        "expected at most {most} rows, for which three quarters of the free memory suffice, found {rows:.0}: {source}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_do_not_fit_are_refused_with_numbers() {
        let stamps: Vec<i64> = (0..1001).map(|i| i * 10_000_000).collect();
        let checked = |rate, memory| check_rows(&stamps, rate, 0.25, 3200, memory);
        assert!(checked(None, 3200 * 1001).is_ok());
        let few = checked(None, 3200 * 1000).unwrap_err().to_string();
        assert!(
            few.contains("at most 1000 rows") && few.contains("found 1001"),
            "{few}"
        );
        assert!(checked(Some(10.0), 3200 * 1000).is_ok());
        let fast = checked(Some(1e9), 16 << 30).unwrap_err().to_string();
        assert!(
            fast.contains("10.0 s of joint states at --rate 1000000000"),
            "{fast}"
        );
    }

    #[test]
    fn a_stamp_years_away_adds_no_rows() {
        let stamps = [0, 10_000_000, i64::MAX];
        assert!(check_rows(&stamps, Some(100.0), 0.25, 3200, 1 << 20).is_ok());
    }
}
