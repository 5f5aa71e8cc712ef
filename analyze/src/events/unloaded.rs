//! Supports off the ground by their own measured load: the loads computed from dynamics may differ.

use tipwatch_mechanics::machine::{ForceSource, Machine};
use tipwatch_mechanics::number::{normal_density, normal_distribution};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::{Quantity, State};

use super::episodes::MERGED_NS;
use super::event::{Event, EventKind};
use crate::base::rows::Rows;
use crate::load::MeasuredLoads;

/// Shortest time for which a support measures nothing that is an event (ns).
const LEAST_NS: i64 = 200_000_000;
/// Prior probability of a dead sensor, as opposed to a lift.
const DEAD: f64 = 0.05;
/// A load of so many standard deviations is one: from there its fall to nothing is timed.
const LOADED_SIGMAS: f64 = 3.0;
/// Standard deviation of the computed total of all supports, as a share of it, and the time over which it is averaged before (s).
const TOTAL_SHARE: f64 = 0.03;
const BEFORE_S: f64 = 1.0;

/// A support whose load is measured by itself.
struct Jack {
    measured_by: Source,
    /// Its name, in lower case.
    subject: String,
    /// Standard deviation of one sample (N).
    sigma: f64,
    /// The mean load of the supports on the ground, at rest, and the load of all (N).
    mean_load: f64,
    weight: f64,
    /// Shortest time without a measured load that is an event (ns).
    least_ns: i64,
    /// Time at which the support last measured a load, and that load (N).
    loaded: Option<(i64, f64)>,
    /// Excess of the measured total of all supports over the computed one while this support last measured a load (N), and the
    /// time of that.
    before: Option<(i64, f64)>,
    /// Time in which the support measures nothing, if that goes on.
    open: Option<Unloaded>,
}

/// Source of the load of a support.
#[derive(Clone, Copy)]
enum Source {
    /// A force of the state, by the index of its actuated joint.
    Force(usize),
    /// A load sensor beside the state, by its index.
    Sensor(usize),
}

/// A time in which a support measures nothing.
#[derive(Clone)]
struct Unloaded {
    start_ns: i64,
    /// Standard deviation of the start (s); `None` where no load was measured before.
    start_sigma_s: Option<f64>,
    last_ns: i64,
    /// Standard deviation of the end (s); `None` where no load was measured afterwards.
    end_sigma_s: Option<f64>,
    /// The smallest measured load (N), and its time.
    least: (f64, i64),
    sum: f64,
    samples: f64,
    /// Sum (N) and number of samples of the excess of all measured supports over the computed total, beyond the excess before;
    /// where all are known.
    total: (f64, f64),
}

/// Finds the times in which supports on the ground measure no load.
pub(super) struct UnloadedSupports<'a> {
    jacks: Vec<Jack>,
    measured: &'a MeasuredLoads,
    events: Vec<Event>,
}

impl<'a> UnloadedSupports<'a> {
    /// Returns no supports: of a supposition nothing was measured. Its forces are derived, and sensors beside the state show the
    /// recorded log.
    pub(super) fn of_supposed(measured: &'a MeasuredLoads) -> Self {
        Self {
            jacks: Vec::new(),
            measured,
            events: Vec::new(),
        }
    }

    /// Prepares the supports of a machine that stands on one set of supports.
    pub(super) fn of(machine: &Machine, measured: &'a MeasuredLoads) -> Self {
        let weight = machine.mass() * machine.gravity();
        let mean_load = weight / machine.wheels().len() as f64;
        let subject = |wheel: usize| machine.wheels()[wheel].name.to_lowercase();
        let joints = machine.contact().actuated_joints.iter().enumerate();
        let forces = joints.filter_map(|(index, joint)| match joint.source {
            ForceSource::Support {
                wheel: Some(wheel), ..
            } => Some(Jack {
                measured_by: Source::Force(index),
                subject: subject(wheel),
                sigma: joint.force_sigma,
                mean_load,
                weight,
                // a single sample is none
                least_ns: measured.held.period_ns(index).unwrap_or(0).max(LEAST_NS),
                loaded: None,
                before: None,
                open: None,
            }),
            _ => None,
        });
        let mut jacks: Vec<Jack> = forces.collect();
        for (index, load) in measured.sensors.iter().enumerate() {
            let mut places = load.sensor.places(machine);
            let (Some(wheel), None) = (places.next(), places.next()) else {
                continue;
            };
            let subject = subject(wheel);
            if jacks.iter().all(|jack| jack.subject != subject) {
                jacks.push(Jack {
                    measured_by: Source::Sensor(index),
                    subject,
                    sigma: load.sensor.sigma,
                    mean_load,
                    weight,
                    least_ns: LEAST_NS,
                    loaded: None,
                    before: None,
                    open: None,
                });
            }
        }
        Self {
            jacks,
            measured,
            events: Vec::new(),
        }
    }

    /// Takes the next rows.
    pub(super) fn take(&mut self, machine: &Machine, rows: &Rows) {
        if self.jacks.is_empty() {
            return;
        }
        let mut state = State::zero(machine);
        let normal_force = rows.outcomes.column(Quantity::NormalForce);
        // of a load that leaves one support the others carry more
        let is_whole = self.jacks.len() == machine.wheels().len();
        let mut forces = Vec::with_capacity(self.jacks.len());
        for row in 0..rows.len() {
            let time_ns = rows.times_ns[row];
            let reasons = rows.reasons[row];
            // forces in another unit are below any noise
            if reasons.leave_state_unknown() || reasons.has(Reason::GrossInput) {
                continue;
            }
            rows.states.get(row, &mut state);
            let measured = self.measured;
            let force_of = |jack: &Jack| match jack.measured_by {
                Source::Force(joint) if state.actuator_force[joint].is_nan() => {
                    measured.held.at(joint, time_ns)
                }
                Source::Force(joint) => state.actuator_force[joint],
                Source::Sensor(index) => measured.at(index, time_ns),
            };
            forces.clear();
            forces.extend(self.jacks.iter().map(force_of));
            let beyond = match is_whole {
                true => forces.iter().sum::<f64>() - normal_force[row],
                false => f64::NAN,
            };
            for (jack, &force) in self.jacks.iter_mut().zip(&forces) {
                // a load that is not known neither begins nor ends anything
                if force.is_nan() {
                    continue;
                }
                if force <= jack.sigma {
                    jack.add(time_ns, force, beyond, &mut self.events);
                    continue;
                }
                let is_loaded = force > LOADED_SIGMAS * jack.sigma;
                if is_loaded {
                    jack.note_rise(time_ns, force);
                }
                if let Some(ended) = jack.ended(time_ns) {
                    self.events.extend(ended);
                }
                if is_loaded {
                    jack.loaded = Some((time_ns, force));
                }
                jack.note_total(time_ns, beyond);
            }
        }
    }

    /// The machine is on other supports from here on.
    pub(super) fn end(&mut self) {
        for jack in &mut self.jacks {
            let found = jack.open.take();
            let event = found.and_then(|found| jack.event(&found, Some(found.last_ns)));
            self.events.extend(event);
        }
    }

    /// The events, the last of which may go on when the log ends.
    fn finish(mut self) -> Vec<Event> {
        for jack in &mut self.jacks {
            let found = jack.open.take();
            let event = found.and_then(|found| jack.event(&found, None));
            self.events.extend(event);
        }
        self.events
    }

    /// Adds the events to those of the computed loads. A lift that both show is one event.
    pub(super) fn join(self, computed: &mut Vec<Event>) {
        for measured in self.finish() {
            let overlaps = |event: &Event| {
                event.kind == EventKind::WheelLift
                    && event.subject == measured.subject
                    && event.overlaps(measured.span_ns())
            };
            let same = computed.iter().filter(|event| overlaps(event));
            let Some(first) = same.min_by_key(|event| event.start_ns).cloned() else {
                computed.push(measured);
                continue;
            };
            let ends = computed.iter().filter(|event| overlaps(event));
            let ends = ends.chain([&measured]);
            let last = ends.max_by_key(|event| event.end_ns.unwrap_or(i64::MAX));
            let (end_ns, end_sigma_s) =
                last.map_or((None, None), |last| (last.end_ns, last.end_sigma_s));
            computed.retain(|event| !overlaps(event));
            let is_measured_earlier = measured.start_ns < first.start_ns;
            computed.push(Event {
                start_ns: first.start_ns.min(measured.start_ns),
                start_sigma_s: match is_measured_earlier {
                    true => measured.start_sigma_s,
                    false => first.start_sigma_s,
                },
                end_ns,
                end_sigma_s,
                // no split of the load changes what is measured, and no computed load is as certain
                split_dependent: Some(false),
                certainty: measured.certainty,
                certainty_any_split: measured.certainty_any_split,
                load_range_n: measured.load_range_n,
                judged_ns: measured.judged_ns,
                measured_load_n: measured.measured_load_n,
                ..first
            });
        }
    }
}

impl Jack {
    fn add(&mut self, time_ns: i64, force: f64, beyond: f64, events: &mut Vec<Event>) {
        if let Some(ended) = self.ended(time_ns) {
            events.extend(ended);
        }
        let start_sigma_s = self.loaded.map(|(loaded_ns, load)| {
            self.passage_sigma_s(time_ns.saturating_sub(loaded_ns), load - force)
        });
        let found = self.open.get_or_insert(Unloaded {
            start_ns: time_ns,
            start_sigma_s,
            last_ns: time_ns,
            end_sigma_s: None,
            least: (force, time_ns),
            sum: 0.0,
            samples: 0.0,
            total: (0.0, 0.0),
        });
        if beyond.is_finite() {
            // a mass that is not as stated is the same before and now
            let more = beyond - self.before.map_or(0.0, |(_, before)| before);
            found.total = (found.total.0 + more, found.total.1 + 1.0);
        }
        (found.last_ns, found.end_sigma_s) = (time_ns, None);
        found.sum += force;
        found.samples += 1.0;
        if force < found.least.0 {
            found.least = (force, time_ns);
        }
    }

    /// Standard deviation of the time (s) at which a load passed through nothing between two samples: by the rate at which it changed,
    /// and anywhere in the time between them. The time is stated as that of the one without a load, about which the root mean square
    /// of a uniform time is its length over the root of 3 (of 12 about its middle).
    fn passage_sigma_s(&self, apart_ns: i64, change_n: f64) -> f64 {
        apart_ns as f64 * 1e-9 * (self.sigma / change_n).hypot(1.0 / 3.0_f64.sqrt())
    }

    /// Notes the first sample that shows a load again.
    fn note_rise(&mut self, time_ns: i64, force: f64) {
        let Some(last_ns) = self.open.as_ref().map(|open| open.last_ns) else {
            return;
        };
        let sigma_s = self.passage_sigma_s(time_ns.saturating_sub(last_ns), force);
        if let Some(open) = &mut self.open {
            open.end_sigma_s.get_or_insert(sigma_s);
        }
    }

    /// Averages the excess of the measured total of all supports over the computed one while this support is loaded.
    fn note_total(&mut self, time_ns: i64, beyond: f64) {
        if !beyond.is_finite() || self.open.is_some() {
            return;
        }
        let share = self.before.map_or(1.0, |(last_ns, _)| {
            let step_s = time_ns.saturating_sub(last_ns) as f64 * 1e-9;
            step_s / (step_s + BEFORE_S)
        });
        let (_, before) = self.before.unwrap_or((time_ns, beyond));
        self.before = Some((time_ns, before + share * (beyond - before)));
    }

    /// The time that is over, if there is one; close ones are one.
    fn ended(&mut self, time_ns: i64) -> Option<Option<Event>> {
        let is_over = |open: &mut Unloaded| time_ns.saturating_sub(open.last_ns) > MERGED_NS;
        let found = self.open.take_if(is_over)?;
        Some(self.event(&found, Some(found.last_ns)))
    }

    /// The event of a time that is long enough.
    fn event(&self, found: &Unloaded, end_ns: Option<i64>) -> Option<Event> {
        if found.last_ns.saturating_sub(found.start_ns) < self.least_ns {
            return None;
        }
        let mean = found.sum / found.samples;
        let mut certainty = unloaded_certainty(mean, self.sigma, self.mean_load);
        let (beyond, rows) = found.total;
        if rows > 0.0 {
            let sigma = self.sigma.hypot(TOTAL_SHARE * self.weight);
            certainty *= alive_certainty(beyond / rows, sigma, self.mean_load);
        }
        Some(Event {
            end_ns,
            end_sigma_s: found.end_sigma_s.filter(|_| end_ns.is_some()),
            start_sigma_s: found.start_sigma_s,
            worst: found.least.0,
            worst_ns: found.least.1,
            unit: "N",
            certainty: Some(certainty),
            certainty_any_split: Some(certainty),
            split_dependent: Some(false),
            load_range_n: Some([0.0, (mean + 2.0 * self.sigma).max(0.0)]),
            judged_ns: Some(found.least.1),
            measured_load_n: Some(mean),
            ..Event::blank(EventKind::WheelLift, found.start_ns, self.subject.clone())
        })
    }
}

/// Probability that a support carries nothing whose sensor reads F with the standard deviation s, if it is as likely to be
/// off the ground as on it, and on the ground to carry anything up to the mean load L:
/// ```text
///     p = f / (f + g),   f = exp(-(F / s)^2 / 2) / (s sqrt(2 pi)),   g = (P(F / s) - P((F - L) / s)) / L
/// ```
/// with P the normal distribution: a reading near zero would be a rare coincidence of a support on the ground.
fn unloaded_certainty(reading: f64, sigma: f64, mean_load: f64) -> f64 {
    let sigma = sigma.max(f64::MIN_POSITIVE);
    // less than nothing is an offset of the sensor
    let [reading, mean_load] = [reading.max(0.0) / sigma, mean_load / sigma];
    let off = normal_density(reading, 1.0);
    let on = (normal_distribution(reading) - normal_distribution(reading - mean_load)) / mean_load;
    off / (off + on)
}

/// Probability that a support that reads nothing is off the ground, and not its sensor dead. All supports together measure R
/// more than is computed, beyond what they did before, with the standard deviation s: nothing more or less if it is off the ground, for the others carry its
/// load; less by that load, anything up to the mean load L, if its sensor is dead.
/// ```text
///     p = f / (f + q g),   f = exp(-(R / s)^2 / 2) / (s sqrt(2 pi)),   g = (P((R + L) / s) - P(R / s)) / L
/// ```
/// with P the normal distribution and q how probable a dead sensor is beforehand. More than is computed speaks for neither, and
/// a total without more than this support's load for more than one dead sensor.
fn alive_certainty(beyond: f64, sigma: f64, mean_load: f64) -> f64 {
    let [less, mean_load] = [beyond.clamp(-mean_load, 0.0) / sigma, mean_load / sigma];
    let off = normal_density(less, 1.0);
    let dead = (normal_distribution(less + mean_load) - normal_distribution(less)) / mean_load;
    off / (off + DEAD * dead)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jack() -> Jack {
        Jack {
            measured_by: Source::Sensor(0),
            subject: "fl".into(),
            sigma: 1.0,
            mean_load: 30_000.0,
            weight: 120_000.0,
            least_ns: LEAST_NS,
            loaded: Some((0, 30_000.0)),
            before: None,
            open: None,
        }
    }

    #[test]
    fn the_end_is_as_uncertain_as_all_of_the_time_until_the_next_load() {
        let mut jack = jack();
        let mut events = Vec::new();
        for time_ns in (0..=2_000_000_000).step_by(40_000_000) {
            jack.add(time_ns, 0.0, f64::NAN, &mut events);
        }
        assert!(events.is_empty());
        jack.note_rise(2_200_000_000, 20_000.0);
        jack.note_rise(2_400_000_000, 30_000.0);
        let ended = jack.ended(3_000_000_000).flatten().expect("a lift");
        assert_eq!(ended.end_ns, Some(2_000_000_000));
        let sigma_s = ended.end_sigma_s.expect("a load afterwards");
        let expected_s = 0.2 / 3.0_f64.sqrt();
        assert!(
            (sigma_s - expected_s).abs() < 1e-5,
            "{sigma_s} {expected_s}"
        );
        // what goes on has no end
        jack.add(4_000_000_000, 0.0, f64::NAN, &mut events);
        jack.note_rise(4_020_000_000, 20_000.0);
        jack.add(4_040_000_000, 0.0, f64::NAN, &mut events);
        assert!(jack.open.is_some_and(|open| open.end_sigma_s.is_none()));
    }

    #[test]
    fn the_start_is_as_uncertain_as_all_of_the_time_before_its_sample() {
        let mut jack = jack();
        let mut events = Vec::new();
        jack.add(1_000_000_000, 0.0, f64::NAN, &mut events);
        let open = jack.open.expect("a time without load");
        assert_eq!(open.start_ns, 1_000_000_000);
        // second moment of a uniform time about the end of its interval
        let steps = 1000_u32;
        let squares = (0..steps).map(|step| ((f64::from(step) + 0.5) / f64::from(steps)).powi(2));
        let expected_s = (squares.sum::<f64>() / f64::from(steps)).sqrt();
        let sigma_s = open.start_sigma_s.expect("a load before");
        let off_s = (sigma_s - expected_s).abs();
        assert!(off_s < 1e-5, "{sigma_s} {expected_s}");
    }

    #[test]
    fn a_dead_sensor_takes_its_load_from_the_total() {
        let alive = |beyond| alive_certainty(beyond, 7_000.0, 30_000.0);
        assert!(alive(0.0) > 0.98, "{}", alive(0.0));
        assert!(alive(25_000.0) > 0.98, "{}", alive(25_000.0));
        assert!(alive(-30_000.0) < 0.02, "{}", alive(-30_000.0));
        // all sensors are dead
        assert!(alive(-120_000.0) < 0.02, "{}", alive(-120_000.0));
    }

    #[test]
    fn a_measured_zero_is_as_certain_as_its_sensor_is_exact() {
        // a sensor that tells 1 % of the mean load from nothing
        let exact = |reading| unloaded_certainty(reading, 300.0, 30_000.0);
        assert!(exact(0.0) > 0.98, "{}", exact(0.0));
        assert!(exact(300.0) > 0.95, "{}", exact(300.0));
        assert!(exact(1500.0) < 0.01, "{}", exact(1500.0));
        assert!(exact(-30_000.0) > 0.98 && exact(30_000.0) < 0.01);
        // one that tells nothing from no load leaves both as likely as before
        let vague = unloaded_certainty(0.0, 300_000.0, 30_000.0);
        assert!((vague - 0.5).abs() < 0.01, "{vague}");
    }
}
