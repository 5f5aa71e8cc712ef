//! Date and time of rows and events, in Coordinated Universal Time (UTC).

use jiff::Timestamp;
use tipwatch_language::{decimals, word};

use super::Analysis;

/// Stamps outside these years count from a zero of their own (ns).
pub(crate) const YEARS_NS: std::ops::Range<i64> =
    631_152_000_000_000_000..4_102_444_800_000_000_000;

/// Whose clock tells the date.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Source {
    Stamps,
    Recorder,
}

/// Converts times of rows to dates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Calendar {
    /// Shift from a time of a row to the date (ns), and the clock that tells it; `None` if no clock tells the date.
    known: Option<(i64, Source)>,
}

impl Calendar {
    pub(crate) fn of(analysis: &Analysis) -> Self {
        let first_ns = analysis.rows.times_ns.first().copied().unwrap_or(0);
        if YEARS_NS.contains(&first_ns) {
            return Self {
                known: Some((0, Source::Stamps)),
            };
        }
        let offsets = analysis.inputs.iter().filter_map(|input| {
            // only a topic whose own stamps are those of the rows
            let offset = input.timing.header_minus_log?;
            Some((-offset.median_s * 1e9) as i64)
        });
        let recorded = |offset: &i64| YEARS_NS.contains(&first_ns.saturating_add(*offset));
        Self {
            known: offsets
                .into_iter()
                .find(recorded)
                .map(|ns| (ns, Source::Recorder)),
        }
    }

    /// Date and time to the hundredth of a second; `None` if no clock tells it.
    pub(crate) fn utc(self, time_ns: i64) -> Option<String> {
        // to the nearest hundredth: the format cuts
        let nearest = self.utc_ns(time_ns)?.saturating_add(5_000_000);
        let time = Timestamp::from_nanosecond(i128::from(nearest)).ok()?;
        Some(decimals(
            time.strftime("%Y-%m-%d %H:%M:%S%.2f UTC").to_string(),
        ))
    }

    /// The instant on the calendar; `None` if no clock tells it.
    pub(crate) fn instant(self, time_ns: i64) -> Option<Timestamp> {
        Timestamp::from_nanosecond(i128::from(self.utc_ns(time_ns)?)).ok()
    }

    /// Time since 1970 (ns, UTC); `None` if no clock tells the date.
    pub(crate) fn utc_ns(self, time_ns: i64) -> Option<i64> {
        let (offset_ns, _) = self.known?;
        Some(time_ns.saturating_add(offset_ns))
    }

    /// By which clock, and what that means.
    pub(crate) fn source(self) -> &'static str {
        match self.known {
            Some((_, Source::Stamps)) => {
                word!(
                    "by the clock that stamped the signals; nothing in the log shows how well it was set"
                )
            }
            Some((_, Source::Recorder)) => {
                word!(
                    "by the recorder's clock, because the signals are stamped from a zero of their own; nothing in the log shows how well it was set"
                )
            }
            None => {
                word!("the date is unknown: the stamps of the log count from a zero of their own")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_rounded_to_the_hundredth() {
        let calendar = Calendar {
            known: Some((0, Source::Stamps)),
        };
        let text = calendar.utc(1_780_000_000_995_000_000);
        assert_eq!(text.as_deref(), Some("2026-05-28 20:26:41.00 UTC"));
    }

    #[test]
    fn relative_time_has_no_date() {
        let calendar = Calendar { known: None };
        assert_eq!(calendar.utc(47_000_000_000), None);
        assert!(calendar.source().contains("unknown"));
    }
}
