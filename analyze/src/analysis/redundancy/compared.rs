//! The spans of rows in which a measured number and a computed one contradict each other.

use tipwatch_mechanics::machine::{FaultKind, Policy};
use tipwatch_mechanics::studies::measured_forces::Compared;

use crate::events::{Event, EventKind, InputFault};

/// An event for each span of rows that are off long enough.
pub(super) fn events(rows: &[Compared], subject: &str, unit: &'static str) -> Vec<Event> {
    spans(rows).map(|span| event(span, subject, unit)).collect()
}

fn spans(rows: &[Compared]) -> impl Iterator<Item = &[Compared]> {
    let spans = rows.chunk_by(|a, b| a.is_off() == b.is_off());
    spans.filter(|span| span[0].is_off() && is_long(span))
}

fn is_long(span: &[Compared]) -> bool {
    Compared::is_long(span[0].time_ns, span[span.len() - 1].time_ns, span.len())
}

fn event(span: &[Compared], subject: &str, unit: &'static str) -> Event {
    let worst = span
        .iter()
        .fold(span[0], |worst, it| match it.excess() > worst.excess() {
            true => *it,
            false => worst,
        });
    Event {
        worst: worst.residual(),
        worst_ns: worst.time_ns,
        unit,
        ..reported(span, FaultKind::Contradiction, worst.limit, subject)
    }
}

/// A fault that lasts for a span of rows, without its worst moment.
pub(super) fn reported(span: &[Compared], kind: FaultKind, limit: f64, subject: &str) -> Event {
    Event {
        end_ns: Some(span[span.len() - 1].time_ns),
        fault: Some(InputFault {
            kind,
            policy: Policy::Report,
            limit: Some(limit),
            samples: span.len() as u64,
            explanation: None,
            loads_are_right: None,
            possible_since_ns: None,
        }),
        ..Event::blank(EventKind::InputFault, span[0].time_ns, subject.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(residual: impl Fn(f64) -> f64) -> Vec<Compared> {
        let row = |step: i64| Compared {
            time_ns: step * 100_000_000,
            measured: 1000.0 + residual(step as f64 * 0.1),
            computed: 1000.0,
            limit: 500.0,
        };
        (0..100).map(row).collect()
    }

    #[test]
    fn only_what_lasts_and_is_large_is_reported() {
        assert_eq!(spans(&rows(|_| 490.0)).count(), 0);
        assert_eq!(spans(&rows(|_| f64::NAN)).count(), 0);
        let short = |t: f64| if (3.0..4.5).contains(&t) { 900.0 } else { 0.0 };
        assert_eq!(spans(&rows(short)).count(), 0);
        let long = |t: f64| {
            if (3.05..6.05).contains(&t) {
                -900.0
            } else {
                0.0
            }
        };
        let events = events(&rows(long), "x", "N");
        let [event] = &events[..] else {
            panic!("{events:?}")
        };
        assert_eq!(
            (event.start_ns, event.end_ns),
            (3_100_000_000, Some(6_000_000_000))
        );
        assert_eq!(event.worst, -900.0);
    }
}
