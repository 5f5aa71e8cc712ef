//! When the smoother estimates the state.

use crate::estimation::rows::{RowClock, regular_index, regular_row, regular_stamp};

/// A gap in the joint states longer than this separates recordings, or its stamps are wrong (ns).
const LONGEST_GRID_NS: i64 = 3_600_000_000_000;

/// Row times. A gap in the joint states gets a single row in its middle, so that tables and curves show it.
/// At a regular rate this applies only to gaps longer than [`LONGEST_GRID_NS`].
pub(super) fn row_times(
    joint_stamps_ns: impl Iterator<Item = i64>,
    clock: RowClock,
    max_gap_ns: i64,
) -> Vec<i64> {
    let mut joint_stamps_ns = joint_stamps_ns.peekable();
    let Some(&first) = joint_stamps_ns.peek() else {
        return Vec::new();
    };
    let usual_count = joint_stamps_ns.size_hint().1.unwrap_or(0);
    let mut times = Vec::with_capacity(usual_count);
    let (mut before, mut next) = (first, 0);
    for stamp in joint_stamps_ns {
        let gap_ns = stamp.saturating_sub(before);
        let longest_ns = match clock {
            RowClock::JointStates => max_gap_ns,
            RowClock::Rate(_) => LONGEST_GRID_NS.max(max_gap_ns),
        };
        if gap_ns > longest_ns {
            times.push(before.midpoint(stamp));
        }
        match clock {
            RowClock::JointStates => times.push(stamp),
            RowClock::Rate(hz) => {
                let is_before = |k: u64| regular_stamp(first, k, hz) < stamp;
                if gap_ns > longest_ns {
                    next = regular_index(first, stamp, hz);
                    next += (next..).take_while(|&k| is_before(k)).count() as u64;
                }
                while let Some(time_ns) = regular_row(first, next, hz, stamp) {
                    times.push(time_ns);
                    next += 1;
                }
            }
        }
        before = stamp;
    }
    times
}
