//! Spans in which a measured number stands still bit for bit although the computed one changes: a sensor or a
//! transmission that has stopped, which the tolerance of the comparison may hide.

use tipwatch_mechanics::machine::FaultKind;
use tipwatch_mechanics::studies::measured_forces::{Compared, Standstill};

use super::compared::reported;
use crate::events::Event;

/// An event for each such span; `least` is the change of the computed number that the sensor must have noticed.
pub(super) fn events(
    rows: &[Compared],
    least: f64,
    subject: &str,
    unit: &'static str,
) -> Vec<Event> {
    let still = rows.chunk_by(|a, b| a.measured.to_bits() == b.measured.to_bits());
    still
        .filter_map(|span| event(span, least, subject, unit))
        .collect()
}

/// The event of a span in which the measured number stands still; `None` if the computed one changes by less.
fn event(span: &[Compared], least: f64, subject: &str, unit: &'static str) -> Option<Event> {
    let mut standstill = Standstill::begin(span[0]);
    span[1..].iter().for_each(|row| standstill.take(*row));
    let (worst_ns, worst) = standstill.missed(least)?;
    Some(Event {
        worst,
        worst_ns,
        unit,
        ..reported(span, FaultKind::Frozen, least, subject)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(measured: impl Fn(f64) -> f64, computed: impl Fn(f64) -> f64) -> Vec<Event> {
        let row = |step: i64| {
            let time_s = step as f64 * 0.1;
            Compared {
                time_ns: step * 100_000_000,
                measured: measured(time_s),
                computed: computed(time_s),
                limit: f64::INFINITY,
            }
        };
        let rows: Vec<Compared> = (0..100).map(row).collect();
        events(&rows, 500.0, "x", "N")
    }

    #[test]
    fn only_a_standstill_that_motion_contradicts_is_reported() {
        let rising = |t: f64| 200.0 * t;
        assert!(found(|t| 1.02 * rising(t), rising).is_empty());
        // nothing moves
        assert!(found(|_| 7.0, |_| 8.0).is_empty());
        assert!(found(|_| 7.0, |_| f64::NAN).is_empty());
        // too short, or the change is too small
        assert!(found(|t| rising(t.min(8.5)), rising).is_empty());
        assert!(found(|t| rising(t.min(7.6)), rising).is_empty());
        let still = found(|t| rising(t.min(5.0)), rising);
        let [event] = &still[..] else {
            panic!("{still:?}")
        };
        assert_eq!(event.fault.as_ref().unwrap().kind, FaultKind::Frozen);
        assert_eq!(
            (event.start_ns, event.end_ns),
            (5_000_000_000, Some(9_900_000_000))
        );
        assert!((event.worst - 980.0).abs() < 1e-9);
    }
}
