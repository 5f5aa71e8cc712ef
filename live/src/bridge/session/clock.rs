//! Offset between the clock of the stamps and that of this computer.

use crate::safety_limits::{DRIFT_WINDOW_NS, MAX_DRIFT_NS, MAX_STAMP_LEAD_NS};
use crate::wire::session::StampClock;

/// Stamps that are no further from the Unix time of this computer are meant to be it (ns).
const MEANT_NS: i64 = 10_000_000_000;
/// Stamps further ahead of this computer's clock than this are worth a warning, and so are later ones (ns).
const WORTH_TELLING_NS: i64 = 20_000_000;

/// What the stamps are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Stamps {
    /// Unix time of this computer if they are at most ten seconds old and not ahead of it, else another clock.
    #[default]
    Auto,
    /// Unix time: every delay is checked against this computer's clock.
    Unix,
    /// A clock of its own (a replayed log, a simulation, a control unit): the smallest delay of the first messages
    /// counts as none, so a delay that never changes is not seen.
    Other,
}

/// Delays of samples from their stamps to their arrival, of which the smallest is kept.
#[derive(Debug, Clone, Default)]
pub(super) struct Delays {
    /// Smallest of arrival by CLOCK_MONOTONIC minus stamp (ns), with its stamp and arrival.
    least: Option<(i64, i64, i64)>,
}

impl Delays {
    pub(super) fn add(&mut self, stamp_ns: i64, host_ns: i64) {
        let delay = host_ns.saturating_sub(stamp_ns);
        if self.least.is_none_or(|(least, ..)| delay < least) {
            self.least = Some((delay, stamp_ns, host_ns));
        }
    }

    /// The clock of the session, and what is worth telling about it. `unix_ahead_ns` is Unix time minus
    /// CLOCK_MONOTONIC.
    pub(super) fn clock(&self, stamps: Stamps, unix_ahead_ns: i64) -> (StampClock, String) {
        let Some((delay, stamp_ns, host_ns)) = self.least else {
            return (StampClock::default(), "there are no stamps".into());
        };
        let by_unix_ns = delay.saturating_add(unix_ahead_ns);
        let is_unix = match stamps {
            // nothing is measured after it arrived
            Stamps::Auto => (-MAX_STAMP_LEAD_NS..=MEANT_NS).contains(&by_unix_ns),
            Stamps::Unix => true,
            Stamps::Other => false,
        };
        let ms = by_unix_ns as f64 * 1e-6;
        if !is_unix {
            let text = format!(
                "stamps are by another clock than this computer's ({:.2} s {}): the smallest delay of the first \
                 messages counts as none",
                by_unix_ns.unsigned_abs() as f64 * 1e-9,
                if by_unix_ns < 0 { "ahead" } else { "behind" }
            );
            return (StampClock { stamp_ns, host_ns }, text);
        }
        let mut text =
            format!("stamps are Unix time; the smallest delay of the first messages is {ms:.1} ms");
        if !(-WORTH_TELLING_NS..=WORTH_TELLING_NS).contains(&by_unix_ns) {
            text += ": if that is no delay, the clocks of the computers are not synchronised (chrony, PTP), and \
                     [clock] of the machine file or --stamps other must say so";
        }
        let clock = StampClock {
            stamp_ns: host_ns.saturating_add(unix_ahead_ns),
            host_ns,
        };
        (clock, text)
    }
}

/// Smallest delays of two windows that differ by no more belong to a clock that stands where it stood (ns).
const STABLE_NS: i64 = 10_000_000;

/// Finds that the clock of a sensor was set, however little, once it is stable again.
///
/// The smallest delay of a window hardly varies. One that moves by more than the monitor bears from one window to the
/// next, and then stays, is a step. If it grows, messages may as well have become late; only stamps that go back tell
/// that it was the clock.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StepWatch {
    /// The window that is being filled: its begin by the host's clock (ns), and what was seen in it.
    window: Option<(i64, Window)>,
    /// The last complete windows, the newest last.
    complete: [Option<Window>; 3],
}

/// Delay and backward steps of the stamps in a window.
#[derive(Debug, Clone, Copy, Default)]
struct Window {
    /// Smallest delay (ns).
    least_ns: i64,
    /// Largest step by which stamps went back (ns).
    back_ns: i64,
}

impl StepWatch {
    /// Takes a sample: when it arrived by the host's clock (ns), its delay (ns), and by how much its stamp is before the
    /// latest one (ns). Returns the change of the delay (ns) when a step has become stable.
    pub(super) fn take(&mut self, host_ns: i64, delay_ns: i64, back_ns: i64) -> Option<i64> {
        let begun = Window {
            least_ns: delay_ns,
            back_ns,
        };
        let (begin_ns, window) = self.window.get_or_insert((host_ns, begun));
        if host_ns.saturating_sub(*begin_ns) < DRIFT_WINDOW_NS {
            window.least_ns = window.least_ns.min(delay_ns);
            window.back_ns = window.back_ns.max(back_ns);
            return None;
        }
        let [_, middle, last] = self.complete;
        self.complete = [middle, last, Some(*window)];
        self.window = Some((host_ns, begun));
        let [Some(before), Some(after), Some(still)] = self.complete else {
            return None;
        };
        let moved_ns = after.least_ns.saturating_sub(before.least_ns);
        let is_step = moved_ns.unsigned_abs() > MAX_DRIFT_NS.unsigned_abs()
            && still.least_ns.abs_diff(after.least_ns) <= STABLE_NS.unsigned_abs();
        // the stamps go back in the window in which the step is, whose smallest delay is still the old one
        let back_ns = before.back_ns.max(after.back_ns);
        (is_step && (moved_ns < 0 || back_ns >= moved_ns / 2)).then_some(moved_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIX_AHEAD: i64 = 1_700_000_000_000_000_000;
    const MS: i64 = 1_000_000;

    fn clock(delay_ns: i64, stamps: Stamps) -> (StampClock, String) {
        let mut delays = Delays::default();
        for at in 0..10 {
            let host = at * 10 * MS;
            delays.add(UNIX_AHEAD + host - delay_ns - at % 3 * MS, host);
        }
        delays.clock(stamps, UNIX_AHEAD)
    }

    #[test]
    fn a_constant_delay_of_unix_stamps_is_seen_and_one_of_another_clock_is_not() {
        let (unix, text) = clock(300 * MS, Stamps::Auto);
        let stamp = UNIX_AHEAD + 1000 * MS;
        assert_eq!(unix.measured_ns(stamp, 1.0), 1000 * MS);
        assert!(text.contains("300.0 ms: if that is no delay"), "{text}");
        let (other, text) = clock(300 * MS, Stamps::Other);
        assert_eq!(other.measured_ns(stamp, 1.0), 1300 * MS);
        assert!(text.contains("another clock"), "{text}");
        // of a log recorded a day ago
        let day = 86_400_000 * MS;
        let (log, text) = clock(day, Stamps::Auto);
        assert_eq!(log.measured_ns(stamp - day, 1.0), 1000 * MS);
        assert!(text.contains("another clock"), "{text}");
    }

    #[test]
    fn stamps_that_are_ahead_of_this_computer_are_another_clock_unless_somebody_says_unix() {
        let stamp = UNIX_AHEAD + 1000 * MS;
        let (ahead, text) = clock(-2000 * MS, Stamps::Auto);
        // measured when it arrives
        assert_eq!(ahead.measured_ns(stamp + 2000 * MS, 1.0), 1000 * MS);
        assert!(text.contains("2.00 s ahead"), "{text}");
        let (said, _) = clock(-2000 * MS, Stamps::Unix);
        assert_eq!(said.measured_ns(stamp + 2000 * MS, 1.0), 3000 * MS);
        // within what the monitor bears
        let (unix, _) = clock(-40 * MS, Stamps::Auto);
        assert_eq!(unix.measured_ns(stamp, 1.0), 1000 * MS);
    }

    /// The steps that are found, with their times (s), at 100 samples a second for 20 s.
    fn steps(delay_ns: impl Fn(i64) -> i64) -> Vec<(i64, f64)> {
        let (mut watch, mut latest, mut found) = (StepWatch::default(), i64::MIN, Vec::new());
        for sample in 0..2000_i64 {
            let host = sample * 10 * MS;
            let delay = delay_ns(host) + sample * 7919 % 40 * MS / 10;
            let stamp = host - delay;
            latest = latest.max(stamp);
            if let Some(moved) = watch.take(host, delay, latest - stamp) {
                found.push((moved, host as f64 * 1e-9));
            }
        }
        found
    }

    #[test]
    fn a_clock_that_is_set_is_found_once_when_it_is_stable() {
        for step_ms in [-2000, -300, -60, 60, 300, 900] {
            let found = steps(|host| if host < 5_500 * MS { 0 } else { step_ms * MS });
            let [(moved, at_s)] = found[..] else {
                panic!("{step_ms} ms: {found:?}");
            };
            assert!(moved.abs_diff(step_ms * MS) < 5 * MS as u64, "{moved}");
            assert!((6.5..9.1).contains(&at_s), "{step_ms} ms: {at_s} s");
        }
    }

    #[test]
    fn what_is_no_step_of_a_clock_is_none() {
        // messages that become late one after the other, so that no stamp goes back
        let late = |host: i64| ((host - 5_000 * MS).max(0) / 2).min(300 * MS);
        for (why, found) in [
            ("steady", steps(|_| 0)),
            ("another speed", steps(|host| host / 100)),
            ("another speed, ahead", steps(|host| -host / 10)),
            ("later and later, then steady", steps(late)),
            (
                "moving for ever",
                steps(|host| -(host / (1_000 * MS)) * 200 * MS),
            ),
        ] {
            assert!(found.is_empty(), "{why}: {found:?}");
        }
    }
}
