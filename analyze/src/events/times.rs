//! Times of events in words: with their bands, and no further than the rows of the log show them.

use tipwatch_language::{decimals, say, word};

use super::event::{Bound, Event};

/// Shorter durations are told as such (ns).
const SHORTEST_NS: i64 = 10_000_000;

/// Wording of the times of a log's events.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct EventTimes {
    /// Seconds count from here (ns).
    pub(crate) zero_ns: i64,
    /// Whether the rows are too far apart to show what happened between them.
    pub(crate) is_sparse: bool,
    /// Whether the log goes on after the last row.
    pub(crate) goes_on: bool,
}

impl EventTimes {
    /// The onset of an event and how long it lasted.
    pub(crate) fn told(&self, event: &Event) -> String {
        let start = self.start(event);
        say!("from {start} {}", self.lasting(event))
    }

    /// The onset of an event with its band, and whether it may have been earlier.
    pub(crate) fn start(&self, event: &Event) -> String {
        let band = event.start_sigma_s.map_or(String::new(), band);
        decimals(format!(
            "t = {:.2}{band} s{}",
            self.seconds(event.start_ns),
            earlier(event)
        ))
    }

    /// The band of an onset, and whether it may have been earlier, to follow its date.
    pub(crate) fn margin(event: &Event) -> String {
        let band = event.start_sigma_s.map(band);
        band.map_or(String::new(), |band| format!("{band} s")) + earlier(event)
    }

    /// A time of the end of an event with its band.
    pub(crate) fn end(&self, event: &Event, end_ns: i64) -> String {
        let band = event.end_sigma_s.map_or(String::new(), band);
        decimals(format!("{:.2}{band} s", self.seconds(end_ns)))
    }

    /// Describes how long an event lasted, to follow its start.
    pub(crate) fn lasting(&self, event: &Event) -> String {
        match event.end_ns {
            _ if event.is_undecided() => word!("on").to_string(),
            // nothing shows how long it lasted before and after its only row
            Some(end_ns) if self.is_sparse && end_ns == event.start_ns => {
                word!("(one row; how long is unknown)").to_string()
            }
            // an onset can lie after the last row of a short event, within its band
            Some(end_ns) if end_ns.saturating_sub(event.start_ns) < SHORTEST_NS => {
                word!("for less than 0.01 s").to_string()
            }
            Some(end_ns) => {
                let is_least = [event.start_bound, event.end_bound] != [Bound::At; 2];
                let least = if is_least { word!("at least ") } else { "" };
                let lasted_s = end_ns.saturating_sub(event.start_ns) as f64 * 1e-9;
                say!("for {least}{lasted_s:.2} s")
            }
            None if self.goes_on => word!("until the last row at least").to_string(),
            None => word!("until the end of the log").to_string(),
        }
    }

    /// Seconds of a time.
    pub(crate) fn seconds(&self, time_ns: i64) -> f64 {
        time_ns.saturating_sub(self.zero_ns) as f64 * 1e-9
    }
}

/// Whether an onset may have been earlier, in words.
fn earlier(event: &Event) -> &'static str {
    match event.start_bound {
        Bound::At | Bound::AtOrAfter => "",
        Bound::AtOrBefore => word!(" or earlier"),
    }
}

/// Two standard deviations of a time (s).
fn band(sigma_s: f64) -> String {
    decimals(format!(" ± {:.2}", (2.0 * sigma_s).max(0.01)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::EventKind;

    #[test]
    fn a_date_has_the_margin_of_its_time() {
        let mut event = Event::blank(EventKind::TipOver, 0, "left".into());
        assert_eq!(EventTimes::margin(&event), "");
        event.start_sigma_s = Some(0.18);
        assert_eq!(EventTimes::margin(&event), " ± 0.36 s");
        event.start_bound = Bound::AtOrBefore;
        assert_eq!(EventTimes::margin(&event), " ± 0.36 s or earlier");
    }

    #[test]
    fn a_time_is_told_no_further_than_the_rows_show_it() {
        let second = |s: f64| (s * 1e9) as i64;
        let mut event = Event::blank(EventKind::WheelLift, second(9.6), "rl".into());
        event.end_ns = Some(second(12.81));
        let dense = EventTimes::default();
        assert_eq!(dense.start(&event), "t = 9.60 s");
        assert_eq!(dense.lasting(&event), "for 3.21 s");
        event.start_sigma_s = Some(0.495);
        event.start_bound = Bound::AtOrBefore;
        assert_eq!(dense.start(&event), "t = 9.60 ± 0.99 s or earlier");
        assert_eq!(dense.lasting(&event), "for at least 3.21 s");
        // from another row, as beside a result that begins earlier
        let later = EventTimes {
            zero_ns: second(4.9),
            ..dense
        };
        assert_eq!(later.start(&event), "t = 4.70 ± 0.99 s or earlier");
        // one row of a sparse log does not show that nothing lasted
        event.end_ns = Some(event.start_ns);
        assert_eq!(dense.lasting(&event), "for less than 0.01 s");
        let sparse = EventTimes {
            is_sparse: true,
            ..dense
        };
        assert_eq!(sparse.lasting(&event), "(one row; how long is unknown)");
        event.end_ns = None;
        let cut = EventTimes {
            goes_on: true,
            ..dense
        };
        assert_eq!(dense.lasting(&event), "until the end of the log");
        assert_eq!(cut.lasting(&event), "until the last row at least");
    }
}
