//! Supports on the ground over time: from signals, spans of time and measured loads.

use anyhow::Result;
use tipwatch_binding::{MachineFile, number_field};
use tipwatch_ingest::{FieldRequest, Log, TimeBase, record_fields};
use tipwatch_language::say;
use tipwatch_mechanics::estimation::support_configuration::{
    GroundGap, GroundSet, LOAD_MAX_AGE_S, SupportStatus as Status, carries_from, is_set_from,
    on_ground,
};
use tipwatch_mechanics::machine::{
    FieldSpec, Machine, PresenceSpec, SupportId, SupportKind, Supports,
};

use crate::base::error_text::error_text;
use crate::base::rows::last_until;

/// Times (ns) from which on a status holds, rising; the first is `i64::MIN`.
type Course = Vec<(i64, Status)>;

/// Reason why it is unknown which supports are on the ground.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Unknown {
    /// The reports on the supports leave the set unknown.
    Ground(GroundGap),
    /// The machine cannot stand on the reported supports.
    Impossible(String),
}

const TRANSITION: Unknown = Unknown::Ground(GroundGap::Transition);

/// A time in which the same supports are on the ground.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SupportSpan {
    /// Its begin (ns).
    pub(crate) from_ns: i64,
    /// Its end (ns), where the next one begins.
    pub(crate) to_ns: i64,
    /// Index in [`SupportTimeline::sets`].
    pub(crate) set: Result<usize, Unknown>,
}

/// Supports on the ground over time.
#[derive(Debug, Clone)]
pub(crate) struct SupportTimeline {
    /// The different sets.
    pub(crate) sets: Vec<Vec<SupportId>>,
    /// Times without gaps, in order.
    pub(crate) spans: Vec<SupportSpan>,
    /// Signals that could not be read, as sentences.
    pub(crate) notes: Vec<String>,
}

impl SupportTimeline {
    /// Builds the timeline from the set known in each row, at rising times (ns).
    pub(crate) fn of_rows(
        supports: &Supports,
        rows: impl Iterator<Item = (i64, Result<GroundSet, GroundGap>)>,
    ) -> Self {
        let mut sets: Vec<GroundSet> = Vec::new();
        let mut spans: Vec<SupportSpan> = Vec::new();
        for (time_ns, ground) in rows {
            let set = ground.map_err(Unknown::Ground);
            let set = set.map(|set| place_of(set, &mut sets));
            // the row holds until the next one
            match spans.last_mut() {
                Some(last) if last.set == set => continue,
                Some(last) => last.to_ns = time_ns,
                None => {}
            }
            let from_ns = if spans.is_empty() { i64::MIN } else { time_ns };
            spans.push(SupportSpan {
                from_ns,
                to_ns: i64::MAX,
                set,
            });
        }
        Self {
            sets: sets.into_iter().map(|set| set.list(supports)).collect(),
            spans,
            notes: Vec::new(),
        }
    }

    /// The supports on the ground at a time (ns); `None` where they are unknown.
    pub(crate) fn on_at(&self, time_ns: i64) -> Option<&[SupportId]> {
        Some(&self.sets[self.set_at(time_ns)?])
    }

    /// Index in [`SupportTimeline::sets`] of the set at a time (ns); `None` where it is unknown.
    pub(crate) fn set_at(&self, time_ns: i64) -> Option<usize> {
        let place = self.spans.partition_point(|span| span.to_ns <= time_ns);
        self.spans.get(place)?.set.as_ref().ok().copied()
    }
}

/// Returns the index of a set among those known; a new one becomes the last.
fn place_of(set: GroundSet, sets: &mut Vec<GroundSet>) -> usize {
    let known = sets.iter().position(|other| *other == set);
    known.unwrap_or_else(|| {
        sets.push(set);
        sets.len() - 1
    })
}

/// Reads the supports of a machine from a log; `None` if they are always the same.
///
/// Spans count from `start_ns`; stamps are converted to the clock `time_base`.
pub(crate) fn read(
    log: &Log,
    file: &MachineFile,
    machine: &Machine,
    start_ns: Option<i64>,
    time_base: Option<&TimeBase>,
) -> Option<SupportTimeline> {
    let supports = machine.supports();
    if !supports.vary() {
        return None;
    }
    let feet: Vec<usize> = (supports.ids())
        .filter(|id| supports.support(*id).kind == SupportKind::Foot)
        .map(SupportId::index)
        .collect();
    let mut notes = Vec::new();
    let courses = supports.ids().map(|support| {
        let presence = supports.presence_of(support);
        let is_foot = supports.support(support).kind == SupportKind::Foot;
        let mut from_log = |field: &FieldSpec, above: f64, max_age_s: f64| match series(
            log, file, time_base, field,
        ) {
            Ok(samples) => by_samples(&samples, above, max_age_s),
            Err(error) => {
                notes.push(say!(
                    "Support {}: its signal cannot be read, so the loads are unknown: {}.",
                    supports.support(support).name,
                    error_text(&error)
                ));
                vec![(i64::MIN, Status::Missing)]
            }
        };
        let told = match &presence.told {
            Some(PresenceSpec::Always(told)) => always(*told),
            Some(PresenceSpec::Spans(spans)) => by_spans(spans, start_ns),
            Some(PresenceSpec::Signal(switch)) => {
                from_log(&switch.number, switch.above, switch.max_age)
            }
            None => match &presence.load {
                Some(load) => from_log(&load.field, is_set_from(load), LOAD_MAX_AGE_S),
                // a wheel or track that is never raised
                None => always(is_foot),
            },
        };
        match &presence.load {
            Some(load) if is_foot && presence.told.is_some() => {
                let samples = series(log, file, time_base, &load.field).unwrap_or_default();
                let load = by_samples(&samples, carries_from(machine, load), LOAD_MAX_AGE_S);
                carrying(&told, &load)
            }
            _ => told,
        }
    });
    let mut courses: Vec<Course> = courses.collect();
    for support in supports.ids() {
        let presence = supports.presence_of(support);
        if presence.told.is_none() && presence.load.is_some() {
            let others = feet.iter().filter(|foot| **foot != support.index());
            let others: Vec<Course> = others.map(|foot| courses[*foot].clone()).collect();
            keep_set(&mut courses[support.index()], &others);
        }
    }
    let mut timeline = timeline(supports, &courses);
    timeline.notes = notes;
    Some(timeline)
}

/// Stamps (ns) and values of a number, by time.
fn series(
    log: &Log,
    file: &MachineFile,
    time_base: Option<&TimeBase>,
    field: &FieldSpec,
) -> Result<Vec<(i64, f64)>> {
    let request = FieldRequest {
        topic: field.topic.clone(),
        number: number_field(field, "effort"),
    };
    let (recordings, _) = record_fields(log, &[request], time_base)?;
    let offset_s = file.spec.clock.offset.get(&field.topic);
    let shift_ns = (offset_s.copied().unwrap_or(0.0) * 1e9).round() as i64;
    let mut samples: Vec<(i64, f64)> = Vec::new();
    for recording in recordings {
        let stamps = recording
            .stamps_ns
            .iter()
            .map(|s| s.saturating_add(shift_ns));
        samples.extend(stamps.zip(recording.values));
    }
    samples.sort_by_key(|(stamp, _)| *stamp);
    Ok(samples)
}

fn always(on: bool) -> Course {
    vec![(i64::MIN, Status::of(on))]
}

fn by_spans(spans: &[[f64; 2]], start_ns: Option<i64>) -> Course {
    let mut course = always(false);
    let at = |s: f64| {
        start_ns
            .unwrap_or(0)
            .saturating_add((s * 1e9).round() as i64)
    };
    for &[from, to] in spans {
        course.push((at(from), Status::On));
        course.push((at(to), Status::Off));
    }
    course
}

/// A sample holds until the next one, but not for longer than its greatest age. Between two samples that differ the
/// support changes at an unknown time.
fn by_samples(samples: &[(i64, f64)], above: f64, max_age_s: f64) -> Course {
    let max_age_ns = (max_age_s * 1e9).min(9e18) as i64;
    let told = |value: f64| Status::of_number(value, above);
    let mut course = vec![(i64::MIN, Status::Missing)];
    for (at, &(stamp, value)) in samples.iter().enumerate() {
        let now = told(value);
        course.push((stamp, now));
        let next = samples.get(at + 1);
        let old = stamp.saturating_add(max_age_ns);
        if next.is_none_or(|&(next, _)| next > old) {
            course.push((old, Status::Missing));
        } else if next.is_some_and(|&(_, value)| told(value) != now && now != Status::Missing) {
            course.push((stamp.saturating_add(1), Status::Changing));
        }
    }
    course
}

/// Combines the reported status of a support with its measured load: a support reported as not set counts as set while its load
/// says so.
fn carrying(told: &Course, load: &Course) -> Course {
    let mut times: Vec<i64> = told.iter().chain(load).map(|(from, _)| *from).collect();
    times.sort_unstable();
    times.dedup();
    let status = |time: i64| {
        let at = |of: &Course| last_until(of, time).map_or(Status::Missing, |(_, status)| *status);
        let [told, load] = [told, load].map(at);
        told.beside_load(load)
    };
    let mut course: Course = times.into_iter().map(|time| (time, status(time))).collect();
    course.dedup_by_key(|(_, status)| *status);
    course
}

/// A foot whose load alone tells whether it is set stays set where it carries nothing for some time while another one of the
/// `others` stays set: then it was lifted. Whoever takes it back takes all of them back.
fn keep_set(course: &mut Course, others: &[Course]) {
    let is_on = |(_, status): &(i64, Status)| *status == Status::On;
    let stays_set = |other: &Course, from_ns: i64, to_ns: i64| {
        let first = other.partition_point(|(at, _)| *at <= from_ns);
        let until = other.partition_point(|(at, _)| *at <= to_ns);
        let known = other
            .get(first.saturating_sub(1)..until)
            .unwrap_or_default();
        !known.is_empty() && known.iter().all(is_on)
    };
    let runs: Vec<&[(i64, Status)]> = course.chunk_by(|a, b| is_on(a) == is_on(b)).collect();
    let mut kept = Course::with_capacity(course.len());
    for (place, run) in runs.iter().enumerate() {
        let is_known = run.iter().all(|(_, status)| *status != Status::Missing);
        let is_lifted = match (place.checked_sub(1), runs.get(place + 1)) {
            (Some(_), Some(next)) if !is_on(&run[0]) && is_known => {
                (others.iter()).any(|other| stays_set(other, run[0].0, next[0].0))
            }
            _ => false,
        };
        if !is_lifted {
            kept.extend_from_slice(run);
        }
    }
    *course = kept;
}

/// Builds the set of supports at all times from the status of each.
fn timeline(supports: &Supports, courses: &[Course]) -> SupportTimeline {
    let mut times: Vec<i64> = courses.iter().flatten().map(|(from, _)| *from).collect();
    times.sort_unstable();
    times.dedup();
    let mut places = vec![0; courses.len()];
    let mut sets: Vec<GroundSet> = Vec::new();
    let mut spans: Vec<SupportSpan> = Vec::new();
    for (k, &from_ns) in times.iter().enumerate() {
        let to_ns = times.get(k + 1).copied().unwrap_or(i64::MAX);
        for (place, course) in places.iter_mut().zip(courses) {
            while course
                .get(*place + 1)
                .is_some_and(|(from, _)| *from <= from_ns)
            {
                *place += 1;
            }
        }
        let told = |support: SupportId| {
            let support = support.index();
            courses[support][places[support]].1
        };
        let set = on_ground(supports, &told).map_err(Unknown::Ground);
        let set = set.map(|set| place_of(set, &mut sets));
        match spans.last_mut() {
            Some(last) if last.set == set => last.to_ns = to_ns,
            _ => spans.push(SupportSpan {
                from_ns,
                to_ns,
                set,
            }),
        }
    }
    let transition_ns = (supports.transition_s * 1e9).min(9e18) as i64;
    SupportTimeline {
        sets: sets.into_iter().map(|set| set.list(supports)).collect(),
        spans: with_transitions(spans, transition_ns),
        notes: Vec::new(),
    }
}

/// Leaves the set unknown around each change from one set to another.
fn with_transitions(spans: Vec<SupportSpan>, transition_ns: i64) -> Vec<SupportSpan> {
    let mut wider: Vec<SupportSpan> = Vec::with_capacity(2 * spans.len());
    let known: Vec<usize> = (0..spans.len()).filter(|&k| spans[k].set.is_ok()).collect();
    for (k, span) in spans.iter().enumerate() {
        if span.set.is_err() {
            wider.push(span.clone());
            continue;
        }
        let place = known.partition_point(|&other| other < k);
        let differs = |other: Option<&usize>| other.is_some_and(|&o| spans[o].set != span.set);
        let before = place.checked_sub(1).and_then(|place| known.get(place));
        let (from_ns, to_ns) = (
            match differs(before) {
                true => span.from_ns.saturating_add(transition_ns).min(span.to_ns),
                false => span.from_ns,
            },
            match differs(known.get(place + 1)) {
                true => span.to_ns.saturating_sub(transition_ns).max(span.from_ns),
                false => span.to_ns,
            },
        );
        let mut push = |from_ns: i64, to_ns: i64, set: Result<usize, Unknown>| {
            if from_ns < to_ns {
                wider.push(SupportSpan {
                    from_ns,
                    to_ns,
                    set,
                });
            }
        };
        if from_ns >= to_ns {
            push(span.from_ns, span.to_ns, Err(TRANSITION));
            continue;
        }
        push(span.from_ns, from_ns, Err(TRANSITION));
        push(from_ns, to_ns, span.set.clone());
        push(to_ns, span.to_ns, Err(TRANSITION));
    }
    wider.dedup_by(|next, span| {
        let same = next.set == span.set && next.set.is_err();
        if same {
            span.to_ns = next.to_ns;
        }
        same
    });
    wider
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: i64 = 1_000_000_000;

    fn at(spans: &[SupportSpan], seconds: f64) -> &Result<usize, Unknown> {
        let ns = (seconds * 1e9) as i64;
        let span = spans.iter().find(|s| (s.from_ns..s.to_ns).contains(&ns));
        &span.unwrap().set
    }

    #[test]
    fn a_sample_ages_and_a_change_is_uncertain() {
        let samples = [(0, 0.0), (S, 0.0), (2 * S, 1.0), (10 * S, 1.0)];
        let course = by_samples(&samples, 0.5, 2.0);
        let status = |ns: i64| course.iter().rfind(|(from, _)| *from <= ns).unwrap().1;
        assert_eq!(status(-1), Status::Missing);
        assert_eq!(status(S / 2), Status::Off);
        assert_eq!(status(3 * S / 2), Status::Changing);
        assert_eq!(status(3 * S), Status::On);
        assert_eq!(status(5 * S), Status::Missing);
        assert_eq!(status(11 * S), Status::On);
        assert_eq!(status(13 * S), Status::Missing);
    }

    /// Loads of feet without switches, by second.
    fn courses(loads: &[&[f64]]) -> Vec<Course> {
        let course = |loads: &&[f64]| {
            let samples: Vec<(i64, f64)> =
                (0..).map(|at| at * S).zip(loads.iter().copied()).collect();
            by_samples(&samples, 100.0, 2.0)
        };
        loads.iter().map(course).collect()
    }

    fn statuses(course: &Course) -> Vec<Status> {
        let at = |second: i64| {
            course
                .iter()
                .rfind(|(from, _)| *from <= second * S)
                .unwrap()
                .1
        };
        (0..7).map(at).collect()
    }

    #[test]
    fn a_foot_that_is_lifted_while_others_stand_was_not_taken_back() {
        use Status::{Off, On};
        let lifted = [900.0, 900.0, 0.0, 0.0, 0.0, 900.0, 900.0];
        let stands = [900.0; 7];
        let taken_back = [900.0, 900.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let kept = |of: &[f64], beside: &[f64]| {
            let [mut course, other] = courses(&[of, beside]).try_into().unwrap();
            keep_set(&mut course, &[other]);
            statuses(&course)
        };
        assert_eq!(kept(&lifted, &stands), [On; 7]);
        // all of them, and one that does not come back
        let all = [On, On, Off, Off, Off, On, On];
        assert_eq!(kept(&lifted, &lifted), all);
        assert_eq!(
            kept(&taken_back, &stands),
            [On, On, Off, Off, Off, Off, Off]
        );
        // one that comes into use
        let set_later = [0.0, 0.0, 900.0, 900.0, 900.0, 900.0, 900.0];
        assert_eq!(kept(&set_later, &stands), [Off, Off, On, On, On, On, On]);
        // a hole in its samples is not known
        let [other] = courses(&[&stands]).try_into().unwrap();
        let mut course = by_samples(&[(0, 900.0), (S, 0.0), (5 * S, 900.0)], 100.0, 2.0);
        keep_set(&mut course, &[other]);
        assert_eq!(statuses(&course)[4], Status::Missing);
    }

    #[test]
    fn a_change_of_the_set_leaves_it_unknown_for_a_time() {
        let span = |from: i64, to: i64, set| SupportSpan {
            from_ns: from * S,
            to_ns: to * S,
            set,
        };
        let spans = vec![
            span(0, 10, Ok(0)),
            span(10, 20, Ok(1)),
            span(20, 21, Err(Unknown::Impossible("no ground".into()))),
            span(21, 30, Ok(1)),
        ];
        let wider = with_transitions(spans, S);
        assert_eq!(at(&wider, 8.9), &Ok(0));
        assert_eq!(at(&wider, 9.1), &Err(TRANSITION));
        assert_eq!(at(&wider, 10.9), &Err(TRANSITION));
        assert_eq!(at(&wider, 11.1), &Ok(1));
        // the same set before and after a gap of its signal
        assert_eq!(at(&wider, 19.9), &Ok(1));
        assert_eq!(
            at(&wider, 20.5),
            &Err(Unknown::Impossible("no ground".into()))
        );
        assert_eq!(at(&wider, 21.1), &Ok(1));
        for pair in wider.windows(2) {
            assert_eq!(pair[0].to_ns, pair[1].from_ns);
        }
    }

    #[test]
    fn a_set_that_is_shorter_than_its_transitions_is_never_known() {
        let span = |from: i64, to: i64, set| SupportSpan {
            from_ns: from * S,
            to_ns: to * S,
            set: Ok(set),
        };
        let wider = with_transitions(vec![span(0, 10, 0), span(10, 11, 1), span(11, 20, 0)], S);
        assert!(wider.iter().all(|span| span.set != Ok(1)));
        assert_eq!(at(&wider, 10.5), &Err(TRANSITION));
    }
}
