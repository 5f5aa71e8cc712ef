//! Merges samples whose parts come on separate topics, such as accelerations in one bus message and
//! angular velocities in another.

use super::sensor_recording::SensorRecording;

/// Longest step between samples of a part that is interpolated (ns).
const LONGEST_STEP_NS: i64 = 250_000_000;
/// Index of the attitude, which is optional.
const ATTITUDE: usize = 6;

/// Merges a part into the samples of a recording by linear interpolation. Samples at whose time the
/// part is unknown are omitted, unless the part is the attitude.
///
/// A merged sample is available once the later of the two interpolated samples has arrived; that is
/// its log time.
pub(crate) fn join(first: SensorRecording, part: SensorRecording) -> SensorRecording {
    let mut by_stamp: Vec<usize> = (0..part.stamps_ns.len()).collect();
    by_stamp.sort_by_key(|&i| part.stamps_ns[i]);
    let is_of_part = values_of(&part);
    let mut joined = SensorRecording {
        stamps_ns: Vec::new(),
        log_times_ns: Vec::new(),
        values: Vec::new(),
        order: Vec::new(),
        undecodable: first.undecodable + part.undecodable,
        unstamped: first.unstamped + part.unstamped,
        without_value: first.without_value + part.without_value,
        ..first
    };
    for (i, &stamp_ns) in first.stamps_ns.iter().enumerate() {
        let values = &first.values[i * first.width..(i + 1) * first.width];
        let (mut log_time_ns, mut order) = (first.log_times_ns[i], first.order[i]);
        let around = around(&part, &by_stamp, stamp_ns);
        if let Some([_, after]) = around {
            log_time_ns = log_time_ns.max(part.log_times_ns[after]);
            order = order.max(part.order[after]);
        }
        let of_part =
            |place: usize| around.map_or(f64::NAN, |[a, b]| between(&part, a, b, place, stamp_ns));
        let value = |place: usize| match is_of_part[place] {
            true => of_part(place),
            false => values[place],
        };
        let is_known = |place: usize| !is_of_part[place] || value(place).is_finite();
        if (0..first.width.min(ATTITUDE)).all(is_known) {
            joined.stamps_ns.push(stamp_ns);
            joined.log_times_ns.push(log_time_ns);
            joined.order.push(order);
            joined.values.extend((0..first.width).map(value));
        }
    }
    joined
}

/// Which values belong to the part: the others are NaN in all its samples.
fn values_of(part: &SensorRecording) -> Vec<bool> {
    let is_there = |i: usize| {
        let samples = part.values.chunks_exact(part.width);
        samples.into_iter().any(|sample| !sample[i].is_nan())
    };
    let there: Vec<bool> = (0..part.width).map(is_there).collect();
    let group = |place: usize| match place < ATTITUDE {
        true => place - place % 3..place - place % 3 + 3,
        false => ATTITUDE..part.width,
    };
    (0..part.width)
        .map(|place| there[group(place)].contains(&true))
        .collect()
}

/// The samples of the part before and after a time, or the one at that time twice.
fn around(part: &SensorRecording, by_stamp: &[usize], stamp_ns: i64) -> Option<[usize; 2]> {
    let next = by_stamp.partition_point(|&i| part.stamps_ns[i] < stamp_ns);
    let &after = by_stamp.get(next)?;
    if part.stamps_ns[after] == stamp_ns {
        return Some([after, after]);
    }
    let before = by_stamp[next.checked_sub(1)?];
    let step = part.stamps_ns[after] - part.stamps_ns[before];
    (step <= LONGEST_STEP_NS).then_some([before, after])
}

/// A value interpolated between two samples of the part.
fn between(part: &SensorRecording, a: usize, b: usize, place: usize, stamp_ns: i64) -> f64 {
    let (of_a, of_b) = (
        &part.values[a * part.width..],
        &part.values[b * part.width..],
    );
    if a == b {
        return of_a[place];
    }
    // a quaternion and its negative are the same attitude
    let is_opposite = place >= ATTITUDE
        && (ATTITUDE..part.width)
            .map(|i| of_a[i] * of_b[i])
            .sum::<f64>()
            < 0.0;
    let end = if is_opposite {
        -of_b[place]
    } else {
        of_b[place]
    };
    let (start_ns, end_ns) = (part.stamps_ns[a], part.stamps_ns[b]);
    let share = (stamp_ns - start_ns) as f64 / (end_ns - start_ns) as f64;
    of_a[place] + share * (end - of_a[place])
}
