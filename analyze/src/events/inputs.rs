//! Events of the inputs: missing and implausible signals.

use rayon::prelude::*;
use tipwatch_mechanics::estimation::plausibility::{FaultSpan, Finding};
use tipwatch_mechanics::machine::FaultKind;

use super::episodes::MERGED_NS;
use super::event::{Event, EventKind, InputFault};
use crate::base::table::Table;
use crate::load::{LoadedLog, Signal};

/// Gaps between the first and the last row that are longer than the estimator bridges.
pub(crate) fn gaps(loaded: &LoadedLog, rows: &Table) -> Vec<Event> {
    let max_gap_ns = loaded.machine.longest_known_gap_ns();
    let (first, last) = ends(rows);
    let of_signal = |signal: &Signal| {
        let recorded = signal.recording.stamps_ns.iter().copied();
        let within = recorded.filter(|stamp| (first..=last).contains(stamp));
        let mut stamps: Vec<i64> = [first].into_iter().chain(within).chain([last]).collect();
        // most are sorted already
        stamps.sort_unstable();
        let gaps = (stamps.windows(2)).filter(|pair| pair[1] - pair[0] > max_gap_ns);
        let gaps = gaps.map(|pair| Event {
            end_ns: (pair[1] < last).then_some(pair[1]),
            worst: (pair[1] - pair[0]) as f64 * 1e-9,
            worst_ns: pair[0],
            unit: "s",
            ..Event::blank(EventKind::InputGap, pair[0], signal.subject.clone())
        });
        gaps.collect()
    };
    let gaps: Vec<Vec<Event>> = loaded.signals.par_iter().map(of_signal).collect();
    gaps.concat()
}

/// Faults that overlap the rows; close ones of the same kind and signal are merged, and all outliers of a signal.
pub(crate) fn faults(loaded: &LoadedLog, spans: &[FaultSpan], rows: &Table) -> Vec<Event> {
    let (first, last) = ends(rows);
    let mut joined: Vec<FaultSpan> = Vec::new();
    let mut latest: std::collections::HashMap<_, usize> = std::collections::HashMap::new();
    let touching = spans
        .iter()
        .filter(|span| span.start_ns <= last && span.until_ns.is_none_or(|until| until > first));
    for span in touching {
        let finding = &span.worst;
        let key = (finding.sensor, finding.part, finding.kind);
        let before = latest.get(&key).copied();
        let before = before.filter(|&before| {
            let until = joined[before].until_ns;
            let is_near = |until: i64| span.start_ns.saturating_sub(until) < MERGED_NS;
            // single samples all along are one finding
            finding.kind == FaultKind::Outlier || until.is_none_or(is_near)
        });
        match before {
            Some(before) => joined[before].merge(span),
            None => {
                latest.insert(key, joined.len());
                joined.push(*span);
            }
        }
    }
    let event = |span: &FaultSpan| {
        let (machine, finding) = (&loaded.machine, &span.worst);
        let machine_has_imu = loaded.matched.sensors.imu;
        let subject = finding.part.subject(finding.sensor, machine);
        Event {
            end_ns: span.until_ns.is_some().then_some(span.end_ns),
            worst: span.measure(),
            worst_ns: match finding.kind {
                FaultKind::NotFinite | FaultKind::Frozen => span.start_ns,
                _ => finding.stamp_ns,
            },
            unit: finding.part.measure_unit(finding.kind, machine),
            fault: Some(InputFault {
                kind: finding.kind,
                policy: finding.policy,
                limit: Some(finding.limit).filter(|limit| limit.is_finite()),
                samples: span.samples,
                explanation: (finding.explanation).map(|explanation| explanation.text(machine)),
                loads_are_right: loads_are_right(finding, machine_has_imu),
                possible_since_ns: (finding.kind == FaultKind::Contradiction)
                    .then_some(finding.possible_since_ns),
            }),
            ..Event::blank(EventKind::InputFault, span.start_ns, subject)
        }
    };
    joined.iter().map(event).collect()
}

/// Probability that the loads are right though this stands; `None` where it casts no doubt on them.
fn loads_are_right(finding: &Finding, has_imu: bool) -> Option<f64> {
    let explanation = finding.explanation?;
    finding
        .casts_doubt(has_imu)
        .then(|| finding.part.loads_are_right(explanation))
}

/// Weighs the events of the machine: where signals that its loads rest on contradict each other then or later, its certainty is
/// multiplied by the probability that the loads are right all the same. A doubt reaches back to when the sensor was last supported. What
/// gyro and attitude show needs no load: neither a tipping nor the wheels off its edge from its start on. `is_off`: whether a wheel is off
/// an edge, both in lower case.
pub(crate) fn add_doubts(events: &mut [Event], is_off: &dyn Fn(&str, &str) -> bool) {
    let is_shown_tipping = |event: &&Event| {
        let is_tipping = matches!(event.kind, EventKind::EdgeTipping | EventKind::TipOver);
        is_tipping && event.is_measured() && event.is_fact() && event.other_edge().is_none()
    };
    let tippings: Vec<(String, [i64; 2])> = (events.iter().filter(is_shown_tipping))
        .map(|event| (event.subject.clone(), event.span_ns()))
        .collect();
    let is_shown = |event: &Event| {
        let is_of_wheel = matches!(event.kind, EventKind::WheelLight | EventKind::WheelLift);
        let mut tippings = tippings.iter();
        is_of_wheel
            && tippings.any(|(edge, span_ns)| {
                event.start_ns >= span_ns[0]
                    && event.overlaps(*span_ns)
                    && is_off(edge, &event.subject)
            })
    };
    let doubts: Vec<([i64; 2], String, f64)> = (events.iter())
        .filter_map(|event| {
            let fault = event.fault.as_ref()?;
            let right = fault.loads_are_right?;
            let [start_ns, end_ns] = event.span_ns();
            let since_ns = fault.possible_since_ns.unwrap_or(start_ns);
            Some((
                [since_ns.min(start_ns), end_ns],
                event.subject.clone(),
                right,
            ))
        })
        .collect();
    for event in events.iter_mut() {
        if !event.rests_on_loads() || is_shown(event) {
            continue;
        }
        let meanwhile = doubts
            .iter()
            .filter(|(span_ns, ..)| event.overlaps(*span_ns));
        let of_event: Vec<(&String, f64)> = meanwhile.map(|(_, of, right)| (of, *right)).collect();
        let Some(loads_are_right) = of_event.iter().map(|doubt| doubt.1).reduce(f64::min) else {
            continue;
        };
        let mut subjects: Vec<String> = of_event.iter().map(|doubt| doubt.0.clone()).collect();
        subjects.sort_unstable();
        subjects.dedup();
        event.doubt_by(subjects, loads_are_right);
    }
}

fn ends(rows: &Table) -> (i64, i64) {
    (rows.times_ns[0], rows.times_ns[rows.len() - 1])
}

#[cfg(test)]
mod tests {
    use tipwatch_mechanics::estimation::rotation::RotationWitness;
    use tipwatch_mechanics::machine::Policy;

    use super::*;
    use crate::events::MeasuredRotation;

    fn doubt(subject: &str, start_ns: i64, possible_since_ns: Option<i64>) -> Event {
        Event {
            fault: Some(InputFault {
                kind: FaultKind::Contradiction,
                policy: Policy::Widen,
                limit: None,
                samples: 1,
                explanation: None,
                loads_are_right: Some(0.5),
                possible_since_ns,
            }),
            ..Event::blank(EventKind::InputFault, start_ns, subject.into())
        }
    }

    #[test]
    fn a_joint_that_is_doubted_takes_nothing_from_a_measured_fall() {
        let fall = Event {
            certainty: Some(0.999),
            ..Event::blank(EventKind::TipOver, 0, "left".into())
        };
        let measured = Event {
            measured_rotation: Some(MeasuredRotation::blank(RotationWitness::Both, 0.01)),
            ..fall.clone()
        };
        let doubt = doubt("lift", 0, None);
        let lift = |wheel: &str, start_ns: i64| Event {
            certainty: Some(0.8),
            ..Event::blank(EventKind::WheelLift, start_ns, wheel.into())
        };
        let lifts = [lift("fr", 0), lift("fr", -1), lift("fl", 0)];
        let mut events = [&[fall, measured, doubt][..], &lifts].concat();
        add_doubts(&mut events, &|edge, wheel| edge == "left" && wheel == "fr");
        assert_eq!(events[0].certainty, Some(0.4995));
        assert_eq!(events[1].certainty, Some(0.999));
        // the wheels off its edge are as certain from its start on
        let of_lifts: Vec<Option<f64>> = events[3..].iter().map(|it| it.certainty).collect();
        assert_eq!(of_lifts, [Some(0.8), Some(0.4), Some(0.4)]);
    }

    #[test]
    fn a_doubt_reaches_back_to_when_the_sensor_was_last_supported() {
        let certainty = |end_ns: i64| {
            let lift = Event {
                certainty: Some(0.9),
                end_ns: Some(end_ns),
                ..Event::blank(EventKind::WheelLift, 0, "fl".into())
            };
            let mut events = [lift, doubt("slew", 200, Some(100))];
            add_doubts(&mut events, &|_, _| false);
            events[0].certainty
        };
        assert_eq!(certainty(150), Some(0.45));
        assert_eq!(certainty(50), Some(0.9));
    }
}
