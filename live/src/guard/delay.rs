//! Delay of a sensor's samples from measurement to publication: bounded absolutely, and in its drift.
//!
//! ```text
//!     delay = published - measured,   measured = clock_host_ns + (stamp - clock_stamp_ns) / pace - drift
//! ```
//! The smallest delay of a second hardly varies, whatever single samples do. Two sound clocks drift apart slowly: the smallest
//! delay of all sensors, each against its own first second, is followed no faster than crystals drift. What moves away faster, or
//! alone among the sensors, are stamps that run at another speed than the session declares, or a delay that grows.

use crate::safety_limits::{
    DRIFT_WINDOW_NS, MAX_CLOCK_DRIFT, MAX_DELAY_NS, MAX_DRIFT_NS, MAX_HIDDEN_DELAY_NS,
    MAX_STAMP_LEAD_NS,
};

/// Fewest samples of a window whose smallest delay is that of its sensor.
const FEWEST_OF_A_WINDOW: u32 = 5;

/// Judgement of a delay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Delay {
    InTime,
    Late,
    Stale,
    /// Measured after its publication: the stamp is wrong.
    Ahead,
}

impl Delay {
    /// Judges a delay (ns) for an estimator that bridges gaps up to `max_gap_ns`.
    pub(super) fn of(delay_ns: i64, max_gap_ns: i64) -> Self {
        match delay_ns {
            ..0 if delay_ns < -MAX_STAMP_LEAD_NS => Self::Ahead,
            _ if delay_ns > max_gap_ns => Self::Stale,
            _ if delay_ns > MAX_DELAY_NS.min(max_gap_ns) => Self::Late,
            _ => Self::InTime,
        }
    }
}

/// Follows the smallest delay of a sensor, from its first sample on.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct DriftWatch {
    /// Begin of the window (publication time, ns) and the smallest delay in it (ns).
    window: Option<(i64, i64)>,
    /// Smallest delay of the first window (ns).
    first_ns: Option<i64>,
    /// Samples of the first window.
    first_count: u32,
    /// Whether the smallest delay of the last complete window is too far from that of the first.
    drifts: bool,
}

impl DriftWatch {
    /// Takes a sample's delay (ns); returns whether the delays drift.
    pub(super) fn take(&mut self, published_ns: i64, delay_ns: i64) -> bool {
        let (begin_ns, least_ns) = *self.window.get_or_insert((published_ns, delay_ns));
        if published_ns.saturating_sub(begin_ns) < DRIFT_WINDOW_NS {
            self.window = Some((begin_ns, least_ns.min(delay_ns)));
            self.first_count += u32::from(self.first_ns.is_none());
            return self.drifts;
        }
        let first_ns = *self.first_ns.get_or_insert(least_ns);
        self.drifts = least_ns.abs_diff(first_ns) > MAX_DRIFT_NS.unsigned_abs();
        self.window = Some((published_ns, delay_ns));
        self.drifts
    }

    /// Returns by how much a delay exceeds the smallest one of the first window (ns); `None` before that window is complete, and
    /// where it had too few samples to find the smallest delay of the sensor.
    pub(super) fn excess_ns(&self, delay_ns: i64) -> Option<i64> {
        let first_ns = self
            .first_ns
            .filter(|_| self.first_count >= FEWEST_OF_A_WINDOW)?;
        Some(delay_ns.saturating_sub(first_ns))
    }
}

/// Follows the clock of the stamps, which all sensors of a session share, as it drifts away from this computer's.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ClockDrift {
    /// Growth of the delays by the drift (ns); negative if the stamps run fast.
    drift_ns: i64,
    /// Begin and last publication of the window (ns), and the smallest excess of a delay in it (ns).
    window: Option<(i64, i64, i64)>,
    /// Last publication of the window before (ns).
    followed_ns: Option<i64>,
    /// Largest step by which the drift may be followed now (ns): what the clocks may have drifted since they were found to agree.
    reach_ns: f64,
    /// Largest drift of the clocks before the first sample that is seen here (ns).
    before_ns: i64,
    /// End of the first window (publication time, ns) and the smallest delay in it (ns).
    first: Option<(i64, i64)>,
}

impl ClockDrift {
    /// Creates the drift of a session whose clocks agreed this time ago (ns).
    pub(super) fn since(agreed_ns: i64) -> Self {
        Self {
            before_ns: (agreed_ns.max(0) as f64 * MAX_CLOCK_DRIFT) as i64,
            ..Self::default()
        }
    }

    /// Takes a delay (ns) as it is measured: who joins a session late finds in the first window how far its clocks have drifted, as
    /// far as the delays cannot be those of samples.
    pub(super) fn begin(&mut self, published_ns: i64, delay_ns: i64) {
        let begun = (published_ns.saturating_add(DRIFT_WINDOW_NS), delay_ns);
        let (until_ns, least_ns) = self.first.get_or_insert(begun);
        if published_ns >= *until_ns {
            return;
        }
        *least_ns = delay_ns.min(*least_ns);
        self.drift_ns = match *least_ns {
            0..=MAX_DELAY_NS => 0,
            least_ns => least_ns.clamp(-self.before_ns, self.before_ns.min(MAX_HIDDEN_DELAY_NS)),
        };
    }

    /// The delay (ns) without what the clocks have drifted.
    pub(super) fn without(&self, delay_ns: i64) -> i64 {
        delay_ns.saturating_sub(self.drift_ns)
    }

    /// Takes by how much a sample's delay without drift exceeds the smallest of its sensor's first window (ns).
    pub(super) fn take(&mut self, published_ns: i64, excess_ns: i64) {
        let begun = (published_ns, published_ns, excess_ns);
        let (begin_ns, last_ns, least_ns) = *self.window.get_or_insert(begun);
        if published_ns.saturating_sub(begin_ns) < DRIFT_WINDOW_NS {
            let last_ns = last_ns.max(published_ns);
            self.window = Some((begin_ns, last_ns, least_ns.min(excess_ns)));
            return;
        }
        let since_ns =
            last_ns.saturating_sub(self.followed_ns.replace(last_ns).unwrap_or(begin_ns));
        self.reach_ns += since_ns.max(0) as f64 * MAX_CLOCK_DRIFT;
        let reach_ns = self.reach_ns as i64;
        let step_ns = least_ns.clamp(-reach_ns, reach_ns);
        self.reach_ns = match step_ns == least_ns {
            true => 0.0,
            false => 0.0_f64.max(self.reach_ns - step_ns.unsigned_abs() as f64),
        };
        let before_ns = self.drift_ns;
        self.drift_ns = before_ns.saturating_add(step_ns).min(MAX_HIDDEN_DELAY_NS);
        let excess_ns = excess_ns.saturating_sub(self.drift_ns - before_ns);
        self.window = Some((published_ns, published_ns, excess_ns));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// Returns the time (s) after which stamps that run at this speed are found, at 100 samples a second whose delays vary.
    fn found_after_s(speed: f64) -> Option<f64> {
        let mut watch = DriftWatch::default();
        let found = (0..6000_i64).find(|sample| {
            let published_ns = sample * 10 * MS;
            let stamp_ns = (published_ns as f64 * speed) as i64;
            let jitter_ns = (sample * 7919 % 40) * MS;
            watch.take(published_ns, published_ns - stamp_ns + jitter_ns)
        });
        found.map(|sample| sample as f64 * 0.01)
    }

    // requirement: TW-FAULT-06
    #[test]
    fn stamps_at_another_speed_are_found_by_their_drift() {
        assert_eq!(found_after_s(1.0), None);
        for (speed, within_s) in [(0.5, 2.1), (2.0, 2.1), (0.99, 7.1), (1.01, 7.1)] {
            let found = found_after_s(speed);
            assert!(found.is_some_and(|s| s <= within_s), "{speed}: {found:?}");
        }
    }

    /// Simulates two sensors that publish ten times a second for `seconds`, with these delays (ns) as functions of time (s).
    /// Returns the time (s) at which the first of them is found to drift or not to be in time, and its largest delay without
    /// drift (ns).
    fn followed(seconds: i64, delays_ns: [&dyn Fn(f64) -> f64; 2]) -> (Option<f64>, i64) {
        let (mut clock, mut watches) = (ClockDrift::default(), [DriftWatch::default(); 2]);
        let (mut found, mut largest_ns) = (None, 0);
        for sample in 0..seconds * 10 {
            let (published_ns, s) = (sample * 100 * MS, sample as f64 * 0.1);
            for (index, watch) in watches.iter_mut().enumerate() {
                let jitter_ns = (sample * 7919 % 40) * MS / 10;
                let delay_ns = clock.without(delays_ns[index](s) as i64 + jitter_ns);
                let drifts = watch.take(published_ns, delay_ns);
                if let Some(excess_ns) = watch.excess_ns(delay_ns) {
                    clock.take(published_ns, excess_ns);
                }
                if index == 0 {
                    let is_wrong = drifts || Delay::of(delay_ns, 250 * MS) != Delay::InTime;
                    found = found.or(is_wrong.then_some(s));
                    largest_ns = largest_ns.max(delay_ns);
                }
            }
        }
        (found, largest_ns)
    }

    // requirement: TW-FAULT-05, TW-FAULT-06
    #[test]
    fn sound_clocks_drift_for_a_shift_and_are_followed() {
        const SHIFT_S: i64 = 8 * 3600;
        for ppm in [-50.0, -20.0, -1.7, 1.7, 20.0, 50.0, 100.0] {
            let drifts = |s: f64| 5e6 - s * 1e3 * ppm;
            let (found, largest_ns) = followed(SHIFT_S, [&drifts, &drifts]);
            assert_eq!(found, None, "{ppm} ppm");
            assert!(largest_ns < 20 * MS, "{ppm} ppm: {largest_ns} ns");
        }
        // and through a pause in which nothing is published
        let (mut clock, pause_ns) = (ClockDrift::default(), 3_600_000 * MS);
        for second in 0..4 {
            clock.take(second * 1000 * MS, 0);
        }
        for second in 4..8 {
            let excess_ns = clock.without(-70 * MS);
            clock.take(pause_ns + second * 1000 * MS, excess_ns);
        }
        assert_eq!(clock.without(-70 * MS), 0);
    }

    /// A drift that no crystal has is found; so is one sensor alone whose delays grow, however slowly, and all of them once they
    /// have grown by what may stay unseen.
    // requirement: TW-FAULT-02, TW-FAULT-06
    #[test]
    fn delays_that_grow_are_not_taken_for_a_clock_beyond_the_stated_bound() {
        let still = |_: f64| 5e6;
        let by = |ppm: f64| move |s: f64| 5e6 + s * 1e3 * ppm;
        for ppm in [1000.0, -1000.0] {
            let found = followed(100, [&by(ppm), &by(ppm)]).0;
            assert!(
                found.is_some_and(|s| (50.0..65.0).contains(&s)),
                "{found:?}"
            );
        }
        let alone = followed(1000, [&by(100.0), &still]).0;
        assert!(
            alone.is_some_and(|s| (400.0..520.0).contains(&s)),
            "{alone:?}"
        );
        // 1.5 s are followed, and 0.1 s are borne
        let all = followed(18_000, [&by(100.0), &by(100.0)]).0;
        assert!(
            all.is_some_and(|s| (15_000.0..16_000.0).contains(&s)),
            "{all:?}"
        );
        // a step is found at once, and not followed away
        for step in [-60e6, 110e6] {
            let stepped = |s: f64| 5e6 + if s < 60.0 { 0.0 } else { step };
            let found = followed(120, [&stepped, &stepped]).0;
            assert!(
                found.is_some_and(|s| (60.0..62.0).contains(&s)),
                "{found:?}"
            );
        }
    }

    /// Who joins hours later knows nothing of how far the clocks have drifted.
    // requirement: TW-FAULT-05, TW-FAULT-06
    #[test]
    fn drift_before_the_first_sample_is_found_in_the_first_window() {
        const HOUR_NS: i64 = 3_600_000 * MS;
        for (ppm, age_ns) in [(20, 3 * HOUR_NS), (-50, 3 * HOUR_NS), (100, HOUR_NS)] {
            let drifted_ns = -ppm * age_ns / 1_000_000;
            let mut clock = ClockDrift::since(age_ns);
            for sample in 0..500 {
                // the first ones may have waited
                let waited_ns = if sample < 3 { 30 * MS } else { 0 };
                let published_ns = sample * 10 * MS;
                let measured_ns = drifted_ns + 5 * MS + waited_ns;
                clock.begin(published_ns, measured_ns);
                let delay_ns = clock.without(measured_ns);
                assert_eq!(Delay::of(delay_ns, 250 * MS), Delay::InTime, "{ppm} ppm");
            }
        }
        // no more than clocks drift in that time, and nothing where delays are those of samples
        let mut young = ClockDrift::since(60_000 * MS);
        young.begin(0, -70 * MS);
        assert_eq!(young.without(-70 * MS), -64 * MS);
        let mut sound = ClockDrift::since(10 * HOUR_NS);
        sound.begin(0, 80 * MS);
        assert_eq!(sound.without(80 * MS), 80 * MS);
    }

    /// One sample a second says nothing of the smallest delay.
    #[test]
    fn sensor_of_few_samples_moves_no_clock() {
        let mut slow = DriftWatch::default();
        for second in 0..10 {
            let _ = slow.take(second * 1000 * MS, if second == 0 { 40 * MS } else { 0 });
        }
        assert_eq!(slow.excess_ns(0), None);
    }

    #[test]
    fn windows_take_the_smallest_delay_up_to_their_end() {
        const END: i64 = DRIFT_WINDOW_NS;
        let far_ns = 2 * MAX_DRIFT_NS;
        for (delay_ns, drifts) in [
            (MAX_DRIFT_NS, false),
            (MAX_DRIFT_NS + 1, true),
            (-MAX_DRIFT_NS, false),
            (-MAX_DRIFT_NS - 1, true),
        ] {
            let mut watch = DriftWatch::default();
            assert!(!watch.take(0, 0));
            // in the first window, however large
            assert!(!watch.take(END / 2, far_ns) && !watch.take(END - 1, far_ns));
            // the first of the second one
            assert!(!watch.take(END, delay_ns));
            assert!(!watch.take(2 * END - 1, far_ns));
            assert_eq!(watch.take(2 * END, 0), drifts, "{delay_ns}");
            // until the next one is complete
            assert_eq!(watch.take(2 * END + 1, 0), drifts);
            assert!(!watch.take(3 * END, 0));
        }
    }
}
