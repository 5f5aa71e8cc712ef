//! Restarts that the clocks of several topics have together.

use super::{
    line::median_ns,
    own_clock::OwnClock,
    restarts::{CommonRestart, Pause, Restart, TOGETHER_NS},
};

/// Merges the restarts of all topics: simultaneous ones get one shift, so that the topics stay
/// aligned.
pub(super) fn merged(topics: &[OwnClock<'_>]) -> Vec<CommonRestart> {
    let mut all: Vec<(usize, Restart)> = (topics.iter().enumerate())
        .flat_map(|(topic, clock)| clock.restarts.iter().map(move |r| (topic, *r)))
        .collect();
    all.sort_by_key(|(_, restart)| restart.log_time_ns);
    let mut rest = all.as_slice();
    let mut common = Vec::new();
    while let Some((_, first)) = rest.first() {
        let end = first.log_time_ns.saturating_add(TOGETHER_NS);
        let count = rest.partition_point(|(_, restart)| restart.log_time_ns <= end);
        let (together, later) = rest.split_at(count);
        rest = later;
        let mut shifts: Vec<i64> = together.iter().map(|(_, r)| r.shift_ns).collect();
        let goes_on = |(topic, clock): (usize, &OwnClock<'_>)| {
            let log_ns = clock.times.log_ns();
            let (Some(&from), Some(&to)) = (log_ns.first(), log_ns.last()) else {
                return false;
            };
            from < first.log_time_ns && end < to && together.iter().all(|(t, _)| *t != topic)
        };
        let last_before = together.iter().filter_map(|(topic, restart)| {
            let before = restart.index.checked_sub(1)?;
            topics[*topic].times.log_ns().get(before).copied()
        });
        let apart_ns = last_before
            .max()
            .map_or(0, |last| first.log_time_ns.saturating_sub(last).max(0));
        common.push(CommonRestart {
            log_time_ns: first.log_time_ns,
            shift_ns: median_ns(&mut shifts).unwrap_or(0),
            is_whole: !topics.iter().enumerate().any(goes_on),
            pause_ns: match apart_ns < Pause::LEAST_NS {
                true => Pause::LEAST_NS,
                false => 0,
            },
        });
    }
    common
}
