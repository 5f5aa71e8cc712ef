//! Where the clock of the stamps stands by that of this computer.

use crate::wire::session::StampClock;

/// Stamps that are no further from the Unix time of this computer are meant to be it (ns).
const MEANT_NS: i64 = 10_000_000_000;
/// Stamps further ahead of this computer's clock than this are worth a warning, and so are later ones (ns).
const WORTH_TELLING_NS: i64 = 20_000_000;

/// What the stamps are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Stamps {
    /// Unix time of this computer if they are within ten seconds of it, else another clock.
    #[default]
    Auto,
    /// Unix time: every delay is checked against this computer's clock.
    Unix,
    /// A clock of its own (a replayed log, a simulation, a control unit): the smallest delay of the first messages
    /// counts as none, so a delay that never changes is not seen.
    Other,
}

/// When samples were measured and when they arrived.
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
            Stamps::Auto => by_unix_ns.unsigned_abs() <= MEANT_NS.unsigned_abs(),
            Stamps::Unix => true,
            Stamps::Other => false,
        };
        let ms = by_unix_ns as f64 * 1e-6;
        if !is_unix {
            let text = format!(
                "stamps are by another clock than this computer's ({:.1} s apart): the smallest delay of the first \
                 messages counts as none",
                by_unix_ns.unsigned_abs() as f64 * 1e-9
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
}
