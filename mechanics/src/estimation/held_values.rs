//! Values that are held: a logger writes rows more often than the sensor measures, and repeats its last value meanwhile.
//!
//! Such a signal goes in stairs. Each repeat is late by up to a period, and the step at its end is a velocity that no joint has.
//! The repeats are no samples.
//!
//! A coarse resolution gives stairs, too, but goes by one step after an uneven time, or, when faster, by several steps from one
//! sample to the next. A held value has uneven steps at even intervals, of which none is shorter. With the interval `d` of the
//! samples and a tolerance `t` = 1.1 `d` + 0.1 `P`, an interval between changes is near a multiple of the period `P` by chance with
//! probability `p = 2 t / P`; of a held value it is so in all but [`MISSED`] of the cases. The logarithms of the ratio are summed.

/// Share of the updates of a held value that come at an odd time.
const MISSED: f64 = 0.02;
/// Sum of the logarithms of the ratio from which on a value is held: a thousand to one.
const EVIDENCE: f64 = 7.0;
/// Fewest intervals of one period.
const FEWEST: usize = 5;
/// Smallest uneven step, as a multiple of the least step of the value.
const UNEVEN: f64 = 2.5;
/// Least share of uneven steps.
const UNEVEN_SHARE: f64 = 0.1;
/// Fewest samples for the interval between two of them.
const FEWEST_SAMPLES: usize = 20;
/// Share of the changes that may follow each other from sample to sample, and how many may in any case.
const CLOSE: (f64, usize) = (0.04, 8);
/// Number of changes that are remembered sample by sample.
const REMEMBERED: usize = 64;
/// Number of changes that tell whether values are held.
const TELLING: usize = 32;
/// Number of samples over which the interval between them is averaged.
const INTERVAL_MEMORY: i64 = 8;
/// Smallest resolved velocity, as a multiple of its least step.
const RESOLVED: f64 = 10.0;
/// Number of repeats of position and velocity by chance within the first samples.
const BY_CHANCE: u32 = 3;
/// Share of the changes of two parts that are in the same samples if the parts are measured together.
const SAME: f64 = 0.9;

/// The repeats of a held value.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldValues {
    /// Time between two measurements (ns).
    pub period_ns: i64,
    /// Time between two samples (ns).
    pub interval_ns: i64,
    /// The samples that repeat a value, by index in rising order.
    pub repeats: Vec<usize>,
}

/// Parts of a sensor that are measured at the same instants.
#[derive(Debug, Clone, PartialEq)]
pub struct Together {
    /// The parts, by their index.
    pub parts: Vec<usize>,
    /// Their repeats; `None` if their values are not held.
    pub held: Option<HeldValues>,
}

impl HeldValues {
    /// Finds the parts of a sensor that are measured together, and their repeats. Each part is given by the places of its values
    /// in a sample; `read` passes the sample with an index on.
    pub fn among(
        stamps_ns: &[i64],
        parts: &[Vec<usize>],
        mut read: impl FnMut(usize, &mut dyn FnMut(&[f64])),
    ) -> Vec<Together> {
        let mut order: Vec<usize> = (0..stamps_ns.len()).collect();
        order.sort_by_key(|&index| stamps_ns[index]);
        let mut steps_ns: Vec<i64> = (order.windows(2))
            .map(|pair| stamps_ns[pair[1]].saturating_sub(stamps_ns[pair[0]]))
            .collect();
        let all = (0..parts.len()).collect();
        if steps_ns.len() < FEWEST_SAMPLES {
            return vec![Together {
                parts: all,
                held: None,
            }];
        }
        let middle = steps_ns.len() / 2;
        let interval_ns = *steps_ns.select_nth_unstable(middle).1;
        let mut changes: Vec<Changes> = parts
            .iter()
            .map(|places| Changes::new(interval_ns, places))
            .collect();
        for &index in &order {
            let mut is_open = false;
            read(index, &mut |values| {
                for changes in changes.iter_mut().filter(|changes| !changes.are_close()) {
                    changes.take(stamps_ns[index], values);
                    is_open = true;
                }
            });
            if !is_open {
                return vec![Together {
                    parts: all,
                    held: None,
                }];
            }
        }
        let together = |parts: Vec<usize>| {
            let of_parts = parts.iter().map(|&part| &changes[part]);
            let joined = Changes::joined(interval_ns, of_parts);
            let held = joined.and_then(|changes| changes.repeats(stamps_ns, &order));
            Together { parts, held }
        };
        at_the_same_instants(&changes)
            .into_iter()
            .map(together)
            .collect()
    }
}

/// Divides parts by the instants at which they are measured: those whose values are held, and all others.
fn at_the_same_instants(changes: &[Changes]) -> Vec<Vec<usize>> {
    let mut divided: Vec<(i64, Vec<usize>)> = Vec::new();
    let mut others = Vec::new();
    for (part, own) in changes.iter().enumerate() {
        let Some(period_ns) = own.period_ns() else {
            others.push(part);
            continue;
        };
        let with = (divided.iter_mut())
            .find(|(period_ns, with)| own.share_with(&changes[with[0]], *period_ns) >= SAME);
        match with {
            Some((_, with)) => with.push(part),
            None => divided.push((period_ns, vec![part])),
        }
    }
    // a part that hardly moves shows no period of its own
    others.retain(|&part| {
        let own = &changes[part];
        let with = (divided.iter_mut())
            .find(|(period_ns, with)| own.share_with(&changes[with[0]], *period_ns) >= 1.0);
        let is_alone = own.are_close() || with.is_none();
        if let Some((_, with)) = with.filter(|_| !is_alone) {
            with.push(part);
        }
        is_alone
    });
    let mut divided: Vec<Vec<usize>> = divided.into_iter().map(|(_, parts)| parts).collect();
    match divided.first_mut() {
        Some(first) if others.iter().all(|&part| changes[part].at.is_empty()) => {
            first.append(&mut others);
        }
        _ => divided.push(others),
    }
    divided.iter_mut().for_each(|parts| parts.sort_unstable());
    divided
}

/// A sample that differs from the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Change {
    stamp_ns: i64,
    /// Whether the step of any of the values is uneven: more than [`UNEVEN`] times the least step of that value so far.
    is_uneven: bool,
}

/// The changes of the values of a sensor, or of a part of it.
#[derive(Debug, Clone)]
struct Changes {
    /// Time between two samples (ns).
    interval_ns: i64,
    /// Places of the values in a sample.
    places: Vec<usize>,
    last: Vec<f64>,
    /// The least step of each value so far.
    least: Vec<f64>,
    at: Vec<Change>,
    /// The number of changes that follow each other from sample to sample.
    close: usize,
}

impl Changes {
    fn new(interval_ns: i64, places: &[usize]) -> Self {
        Self {
            interval_ns,
            places: places.to_vec(),
            last: Vec::new(),
            least: vec![f64::INFINITY; places.len()],
            at: Vec::new(),
            close: 0,
        }
    }

    /// Joins the changes of several parts as those of one; `None` if one of them changes from sample to sample.
    fn joined<'c>(interval_ns: i64, parts: impl Iterator<Item = &'c Self>) -> Option<Self> {
        let mut all = Vec::new();
        for part in parts {
            if part.are_close() {
                return None;
            }
            all.extend_from_slice(&part.at);
        }
        // of one sample the uneven change is the last
        all.sort_unstable();
        let mut joined = Self::new(interval_ns, &[]);
        for one in all.chunk_by(|a, b| a.stamp_ns == b.stamp_ns) {
            joined.at.extend(one.last());
        }
        joined.count_close();
        Some(joined)
    }

    /// Takes a sample; returns whether its values differ from those of the sample before, to the bit.
    fn take(&mut self, stamp_ns: i64, values: &[f64]) -> bool {
        let values = self.places.iter().map(|&place| values[place]);
        if self.last.is_empty() {
            self.last.extend(values);
            return true;
        }
        let (mut differs, mut is_uneven) = (false, false);
        let places = self.last.iter_mut().zip(&mut self.least).zip(values);
        for ((last, least), value) in places {
            differs |= last.to_bits() != value.to_bits();
            let step = (value - *last).abs();
            if step > 0.0 {
                is_uneven |= step > UNEVEN * *least;
                *least = least.min(step);
            }
            *last = value;
        }
        if differs {
            let is_close = |before: &Change| self.is_close(before.stamp_ns, stamp_ns);
            self.close += usize::from(self.at.last().is_some_and(is_close));
            self.at.push(Change {
                stamp_ns,
                is_uneven,
            });
        }
        differs
    }

    fn count_close(&mut self) {
        let are_close = |pair: &&[Change]| self.is_close(pair[0].stamp_ns, pair[1].stamp_ns);
        self.close = self.at.windows(2).filter(are_close).count();
    }

    /// Whether two stamps are those of two samples in a row.
    fn is_close(&self, before_ns: i64, stamp_ns: i64) -> bool {
        let apart_ns = stamp_ns.saturating_sub(before_ns);
        apart_ns.saturating_mul(2) < self.interval_ns.saturating_mul(3)
    }

    /// Whether the values change from sample to sample.
    fn are_close(&self) -> bool {
        let (share, few) = CLOSE;
        self.close > few && self.close as f64 > share * self.at.len() as f64
    }

    /// Share of the changes that are in samples in which the other part changes, too, of those while it moves; zero if it rests at
    /// all of them.
    fn share_with(&self, other: &Self, period_ns: i64) -> f64 {
        let (mut both, mut alone) = (0, 0);
        for change in &self.at {
            let next = (other.at).partition_point(|other| other.stamp_ns < change.stamp_ns);
            let near = other.at[next.saturating_sub(1)..].iter().take(2);
            let apart = near.map(|near| near.stamp_ns.abs_diff(change.stamp_ns));
            match apart.min() {
                Some(0) => both += 1,
                Some(apart_ns) if apart_ns <= period_ns.unsigned_abs() / 2 => alone += 1,
                _ => {}
            }
        }
        f64::from(both) / f64::from((both + alone).max(1))
    }

    /// The time between two measurements (ns), if the values are held.
    fn period_ns(&self) -> Option<i64> {
        self.period_with(&mut Vec::new())
    }

    /// Returns the time between two measurements, with room for the times between the changes.
    fn period_with(&self, apart: &mut Vec<f64>) -> Option<i64> {
        let uneven = || self.at.iter().filter(|change| change.is_uneven).count();
        let is_even = || (uneven() as f64) < UNEVEN_SHARE * self.at.len() as f64;
        if self.are_close() || self.at.len() <= FEWEST || is_even() {
            return None;
        }
        apart.clear();
        let pairs = self.at.windows(2);
        apart.extend(pairs.map(|pair| pair[1].stamp_ns.saturating_sub(pair[0].stamp_ns) as f64));
        apart.sort_unstable_by(f64::total_cmp);
        let short = apart[apart.len() / 10];
        let is_one = |apart: &&f64| (0.75 * short..1.5 * short).contains(*apart);
        let ones = apart.iter().filter(is_one).count();
        let period = *apart.iter().filter(is_one).nth(ones / 2)?;
        let tolerance = 1.1 * self.interval_ns as f64 + 0.1 * period;
        let by_chance = (2.0 * tolerance / period).min(1.0 - MISSED);
        let (mut evidence, mut fitting) = (0.0, 0);
        for &apart in &*apart {
            let periods = (apart / period).round();
            // after many periods every time is near a multiple: the sensor's own clock drifts
            if periods > 2.0 {
                break;
            }
            let fits = periods > 0.0 && (apart - periods * period).abs() <= tolerance;
            evidence += match fits {
                true => ((1.0 - MISSED) / by_chance).ln(),
                false => (MISSED / (1.0 - by_chance)).ln(),
            };
            fitting += usize::from(fits && periods == 1.0);
        }
        (fitting >= FEWEST && evidence >= EVIDENCE).then_some(period as i64)
    }

    /// The repeats among samples with these stamps (ns), of which `order` is the order in time; `None` if the values are not held.
    fn repeats(&self, stamps_ns: &[i64], order: &[usize]) -> Option<HeldValues> {
        let period_ns = self.period_ns()?;
        let (first, earliest_ns) = (self.at.first()?, stamps_ns[*order.first()?]);
        // the first value was measured before the log began
        let periods = first.stamp_ns.saturating_sub(earliest_ns) / period_ns;
        let mut due_ns = first.stamp_ns.saturating_sub(periods * period_ns);
        let mut next_change = self.at.iter().map(|change| change.stamp_ns).peekable();
        let mut repeats = Vec::new();
        for &index in order {
            let stamp_ns = stamps_ns[index];
            let is_change = next_change.next_if_eq(&stamp_ns).is_some();
            // a value that stays was measured again
            if is_change || stamp_ns >= due_ns.saturating_sub(self.interval_ns / 2) {
                due_ns = stamp_ns.saturating_add(period_ns);
            } else {
                repeats.push(index);
            }
        }
        repeats.sort_unstable();
        Some(HeldValues {
            period_ns,
            interval_ns: self.interval_ns,
            repeats,
        })
    }
}

/// Recognises, sample by sample, repeats of the last measurement of a sensor, by the changes so far. A step never allocates.
#[derive(Debug, Clone)]
pub(super) struct Repeats {
    changes: Changes,
    /// Room for the times between the changes.
    apart: Vec<f64>,
    last_ns: Option<i64>,
    /// Longest time for which a repeated value counts as held until enough changes show the period (ns); zero if no value does.
    assumed_ns: i64,
    /// The time between two measurements; `None` if the values are not held, or too long to tell.
    period_ns: Option<i64>,
    /// Stamp of the last sample that was taken as a measurement (ns).
    taken_ns: i64,
    /// True until enough changes have shown whether the values are held.
    is_open: bool,
    /// Whether the values are those of one joint among several in a message.
    is_of_joint: bool,
    /// Number of repeats of position and velocity at a velocity above its resolution, counted until the changes show the period.
    by_chance: u32,
    /// Whether the last sample taken was sound: a repeat of a fault is a fault, too.
    is_sound: bool,
}

impl Repeats {
    /// Creates the repeats before the first sample, which has so many values. Until the changes tell, values count as held for
    /// less than `assumed_ns`: a step is one of the whole time since then, or of one sample.
    pub(super) fn new(values: usize, assumed_ns: i64) -> Self {
        let places: Vec<usize> = (0..values).collect();
        let mut changes = Changes::new(0, &places);
        changes.last.reserve_exact(values);
        changes.at.reserve_exact(REMEMBERED);
        Self {
            changes,
            apart: Vec::with_capacity(REMEMBERED),
            last_ns: None,
            assumed_ns,
            period_ns: None,
            taken_ns: i64::MIN,
            is_open: true,
            is_of_joint: false,
            by_chance: 0,
            is_sound: true,
        }
    }

    /// Creates the repeats of one joint in a message of several, by its position and velocity. The others show that the message
    /// is new, so this joint may rest: until the changes tell, its value counts as held only while its velocity says that it
    /// moves, and more often than a coarse sensor repeats by chance.
    pub(super) fn of_joint(assumed_ns: i64) -> Self {
        Self {
            is_of_joint: true,
            ..Self::new(2, assumed_ns)
        }
    }

    fn is_by_chance(&mut self) -> bool {
        self.by_chance += u32::from(!self.may_rest());
        self.may_rest() || self.by_chance <= BY_CHANCE
    }

    /// Whether the last velocity of the joint is within the resolution: a joint that moves does not repeat a finer velocity to
    /// the bit.
    fn may_rest(&self) -> bool {
        let [rate, least_step] = [&self.changes.last, &self.changes.least].map(|of| of[1]);
        // written so that NaN may rest
        !(rate.abs() > RESOLVED * least_step)
    }

    /// Whether the changes have told that values are held.
    pub(super) fn are_held(&self) -> bool {
        self.period_ns.is_some()
    }

    /// Takes whether the sample that was taken last was sound.
    pub(super) fn judge(&mut self, is_sound: bool) {
        self.is_sound = is_sound;
    }

    /// Takes the next sample; returns whether it repeats the last measurement. A sample that is not later than the one before is
    /// no repeat: it is wrong otherwise.
    pub(super) fn take(&mut self, stamp_ns: i64, values: &[f64]) -> bool {
        let Some(step_ns) = (self.last_ns).map_or(Some(0), |last| stamp_ns.checked_sub(last))
        else {
            return false;
        };
        if (self.last_ns.is_some() && step_ns <= 0) || values.len() != self.changes.places.len() {
            return false;
        }
        self.last_ns = Some(stamp_ns);
        let interval_ns = &mut self.changes.interval_ns;
        *interval_ns = match *interval_ns {
            0 => step_ns,
            // one step may be a gap
            own => own + (step_ns - own).clamp(-own / 2, own / 2) / INTERVAL_MEMORY,
        };
        if self.changes.take(stamp_ns, values) {
            if self.changes.at.len() == REMEMBERED {
                self.changes.at.drain(..REMEMBERED / 2);
                self.changes.count_close();
            }
            let period_ns = self.changes.period_with(&mut self.apart);
            let tells = self.changes.are_close() || self.changes.at.len() > TELLING;
            self.is_open &= period_ns.is_none() && !tells;
            if !self.is_open {
                self.period_ns = period_ns;
            }
        } else if self.is_sound {
            let interval_ns = self.changes.interval_ns;
            let held_ns = match (self.is_open, self.is_of_joint) {
                (true, true) if self.is_by_chance() => 0,
                // the next one, late as it may be, must not come after a gap
                (true, _) => (self.assumed_ns).saturating_sub(interval_ns.saturating_mul(2)),
                (false, _) => self.period_ns.unwrap_or(0).saturating_sub(interval_ns / 2),
            };
            if stamp_ns.saturating_sub(self.taken_ns) < held_ns {
                return true;
            }
        }
        // a value that stays was measured again
        self.taken_ns = stamp_ns;
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// Returns the held values found in 20 s of one value sampled at 100 Hz; `None` if the value is measured with every sample.
    fn found(value: impl Fn(f64) -> f64) -> Option<HeldValues> {
        let stamps: Vec<i64> = (0..2000).map(|k| k * 10 * MS).collect();
        let read = |index: usize, take: &mut dyn FnMut(&[f64])| take(&[value(index as f64 * 0.01)]);
        let [found] = &HeldValues::among(&stamps, &[vec![0]], read)[..] else {
            panic!("one part");
        };
        found.held.clone()
    }

    /// A joint that swings, rests from 8 s to 12 s, and swings on (rad).
    fn swing(at_s: f64) -> f64 {
        let moving_s = at_s.min(8.0) + (at_s - 12.0).max(0.0);
        0.4 * (0.9 * moving_s).sin()
    }

    fn held(value: impl Fn(f64) -> f64, period_s: f64, phase_s: f64) -> impl Fn(f64) -> f64 {
        move |at_s| value(((at_s + 1e-9 + phase_s) / period_s).floor() * period_s - phase_s)
    }

    #[test]
    fn held_values_are_found_with_their_period() {
        for period_s in [0.05, 0.1, 0.2, 0.5, 1.0] {
            for phase_s in [0.0, 0.3 * period_s] {
                let found = found(held(swing, period_s, phase_s)).unwrap();
                assert_eq!(found.period_ns, (period_s * 1e9).round() as i64);
                let kept = 2000 - found.repeats.len();
                let expected = (20.0 / period_s) as usize;
                assert!(kept.abs_diff(expected) <= 1, "{period_s}: {kept}");
            }
        }
    }

    /// Also where the resolution is coarse, or the sensor's time uneven.
    #[test]
    fn held_values_are_found_by_a_coarse_sensor_and_with_an_uneven_time() {
        let coarse = |at_s: f64| (swing(at_s) / 0.004).round() * 0.004;
        assert_eq!(found(held(coarse, 0.2, 0.0)).unwrap().period_ns, 200 * MS);
        let updates: Vec<f64> = (0..101)
            .map(|k| 0.2 * f64::from(k) + 0.02 * f64::from(k).sin())
            .collect();
        let uneven = |at_s: f64| {
            let next = updates.partition_point(|update| *update <= at_s);
            swing(updates[next.saturating_sub(1)])
        };
        let period_ns = found(uneven).unwrap().period_ns;
        assert!((period_ns - 200 * MS).abs() <= 20 * MS, "{period_ns}");
    }

    /// Samples that are kept are those with a new value, whose stamps are closest to the measurement.
    #[test]
    fn no_new_value_is_left_out() {
        let value = held(swing, 0.25, 0.1);
        let found = found(&value).unwrap();
        for index in 1..2000_usize {
            let at = |index: usize| value(index as f64 * 0.01);
            let is_new = at(index).to_bits() != at(index - 1).to_bits();
            assert!(!(is_new && found.repeats.contains(&index)));
        }
    }

    #[test]
    fn values_that_are_measured_are_kept() {
        let noise = |at_s: f64| 1e-4 * (at_s * 7919.0).sin();
        assert_eq!(found(|at_s| swing(at_s) + noise(at_s)), None);
        assert_eq!(found(swing), None);
        assert_eq!(found(|_| 0.3), None);
        for resolution in [1e-4, 1e-3, 4e-3, 0.02, 0.1] {
            let coarse = |value: f64| (value / resolution).round() * resolution;
            assert_eq!(found(|at_s| coarse(swing(at_s))), None, "{resolution}");
            // at an even speed its steps come at even times, and all are one
            assert_eq!(found(|at_s| coarse(0.05 * at_s)), None, "{resolution}");
            let turns = |at_s: f64| (0.6 * at_s) % std::f64::consts::TAU;
            assert_eq!(found(|at_s| coarse(turns(at_s))), None, "{resolution}");
        }
    }

    /// Joints of one message that are measured at instants of their own, each with a period.
    #[test]
    fn joints_of_one_message_are_divided_by_when_they_are_measured() {
        let joints: [Box<dyn Fn(f64) -> f64>; 6] = [
            Box::new(held(swing, 0.2, 0.0)),
            Box::new(held(|at_s| swing(0.9 * at_s + 1.0), 0.2, 0.0)),
            Box::new(held(|at_s| swing(1.1 * at_s), 0.2, 0.07)),
            Box::new(held(|at_s| swing(0.8 * at_s + 2.0), 0.05, 0.01)),
            Box::new(swing),
            Box::new(|_| 0.7),
        ];
        let stamps: Vec<i64> = (0..2000).map(|k| k * 10 * MS).collect();
        let parts: Vec<Vec<usize>> = (0..6).map(|joint| vec![joint]).collect();
        let read = |index: usize, take: &mut dyn FnMut(&[f64])| {
            take(&joints.each_ref().map(|joint| joint(index as f64 * 0.01)));
        };
        let found = HeldValues::among(&stamps, &parts, read);
        let of = |together: &Together| {
            let period_ns = together.held.as_ref().map(|held| held.period_ns / MS);
            (together.parts.clone(), period_ns)
        };
        let expected = [
            (vec![0, 1], Some(200)),
            (vec![2], Some(200)),
            (vec![3], Some(50)),
            (vec![4, 5], None),
        ];
        assert_eq!(found.iter().map(of).collect::<Vec<_>>(), expected);
    }

    #[test]
    fn a_few_samples_show_nothing() {
        for stamps in [&[0, MS][..], &[]] {
            let few = HeldValues::among(stamps, &[vec![0]], |_, take| take(&[1.0]));
            assert_eq!(few.len(), 1);
            assert_eq!(few[0].held, None);
        }
    }

    /// The samples of 20 s at 100 Hz that are taken sample by sample, where values are taken as held for 250 ms at first.
    fn taken(value: impl Fn(f64) -> f64) -> Vec<usize> {
        let mut repeats = Repeats::new(1, 250 * MS);
        let mut is_taken =
            |k: &usize| !repeats.take(*k as i64 * 10 * MS, &[value(*k as f64 * 0.01)]);
        (0..2000).filter(|k| is_taken(k)).collect()
    }

    #[test]
    fn repeats_are_told_sample_by_sample() {
        for period_s in [0.05, 0.1, 0.2] {
            for phase_s in [0.0, 0.3 * period_s] {
                let value = held(|at_s| swing(at_s + 0.3), period_s, phase_s);
                let taken = taken(&value);
                let is_new =
                    |k: &usize| *k == 0 || value(*k as f64 * 0.01) != value((*k - 1) as f64 * 0.01);
                let of_values = (0..2000).filter(is_new);
                assert!(of_values.clone().all(|k| taken.contains(&k)), "{period_s}");
                // the measurements at rest among them
                let measured = 20.0 / period_s;
                assert!(
                    (taken.len() as f64 / measured - 1.0).abs() < 0.05,
                    "{period_s}: {}",
                    taken.len()
                );
                assert!(taken.windows(2).all(|pair| pair[1] - pair[0] <= 25));
            }
        }
    }

    #[test]
    fn values_that_are_measured_are_taken_sample_by_sample() {
        let noise = |at_s: f64| 1e-4 * (at_s * 7919.0).sin();
        assert_eq!(taken(|at_s| swing(at_s) + noise(at_s)).len(), 2000);
        // one that rests was measured again, one that begins to move is
        let begins = taken(|at_s| swing((at_s - 10.0).max(0.0)));
        let at_rest = begins.partition_point(|&k| k <= 1000);
        assert_eq!((at_rest, begins.len() - at_rest), (44, 999));
        for resolution in [1e-4, 1e-3, 4e-3] {
            let coarse = |value: f64| (value / resolution).round() * resolution;
            let taken = taken(|at_s| coarse(swing(at_s + 0.3)));
            let told = taken.partition_point(|&k| k < 200);
            assert_eq!(taken.len() - told, 1800, "{resolution}");
        }
    }

    /// A value at rest from the first sample on is taken at least once per longest gap, at any rate and with jitter of the
    /// stamps; a repeated fault is taken each time.
    #[test]
    fn what_rests_is_taken_before_a_gap() {
        for (hertz, jitter_ns) in [
            (100.0, 0),
            (100.0, 100_000),
            (60.0, 0),
            (30.0, 500_000),
            (1000.0, 100_000),
        ] {
            let mut repeats = Repeats::new(1, 250 * MS);
            let (mut last_ns, mut taken) = (0, 0);
            for k in 1..2000 {
                let stamp_ns = (f64::from(k) * 1e9 / hertz) as i64
                    + [jitter_ns, 0, -jitter_ns][k as usize % 3];
                if !repeats.take(stamp_ns, &[0.3]) {
                    assert!(
                        stamp_ns - last_ns <= 250 * MS,
                        "{hertz} Hz: {}",
                        stamp_ns - last_ns
                    );
                    (last_ns, taken) = (stamp_ns, taken + 1);
                }
            }
            assert!(f64::from(taken) < 0.3 * 2000.0, "{hertz} Hz: {taken}");
        }
        let mut repeats = Repeats::new(1, 250 * MS);
        repeats.take(10 * MS, &[f64::NAN]);
        repeats.judge(false);
        assert!(!repeats.take(20 * MS, &[f64::NAN]));
    }

    /// The samples that are taken of one joint of several, by index: 20 s at 100 Hz of its position and velocity.
    fn taken_of_joint(position: impl Fn(f64) -> f64, velocity: impl Fn(f64) -> f64) -> Vec<i64> {
        let mut repeats = Repeats::of_joint(250 * MS);
        let is_taken = |k: &i64| {
            let at_s = *k as f64 * 0.01;
            !repeats.take(k * 10 * MS, &[position(at_s), velocity(at_s)])
        };
        (0..2000).filter(is_taken).collect()
    }

    /// One joint of a message may rest while others are measured: only its own velocity says that its position is held.
    #[test]
    fn a_joint_that_rests_is_measured_and_one_that_moves_is_held_from_its_third_step_on() {
        let rate = |at_s: f64| (swing(at_s + 1e-4) - swing(at_s - 1e-4)) / 2e-4;
        let coarse = |resolution: f64, value: f64| (value / resolution).round() * resolution;
        let rests = taken_of_joint(|_| 0.3, |_| 0.0);
        let begins = |at_s: f64| coarse(4e-3, swing((at_s - 10.0).max(0.0)));
        let coarse_rate = |at_s: f64| coarse(1e-2, rate((at_s - 10.0).max(0.0)));
        let begins = taken_of_joint(begins, coarse_rate);
        assert_eq!([rests.len(), begins.len()], [2000, 2000]);
        // one repeat by chance, before many changes
        let noise = |at_s: f64| 1e-3 * ((at_s - 0.1).abs() * 7919.0).sin();
        let repeats = |at_s: f64| {
            noise(if (0.045..0.055).contains(&at_s) {
                0.04
            } else {
                at_s
            })
        };
        assert_eq!(
            taken_of_joint(repeats, |at_s| 2.0 + repeats(at_s)).len(),
            2000
        );
        for hold_s in [0.05, 0.1, 0.2] {
            let taken = taken_of_joint(held(swing, hold_s, 0.0), held(rate, hold_s, 0.0));
            let samples = (hold_s * 100.0) as i64;
            let third = taken.partition_point(|&k| k < 3 * samples);
            let while_moving = taken[third..].partition_point(|&k| k < 800);
            assert_eq!(
                while_moving as i64,
                800 / samples - 3,
                "{hold_s}: {taken:?}"
            );
        }
    }

    #[test]
    fn a_sample_that_is_not_later_is_no_repeat() {
        let mut repeats = Repeats::new(1, 250 * MS);
        assert!(!repeats.take(10 * MS, &[0.5]));
        assert!(repeats.take(20 * MS, &[0.5]));
        for stamp_ns in [20 * MS, 0, i64::MIN] {
            assert!(!repeats.take(stamp_ns, &[0.5]));
        }
        assert!(!repeats.take(i64::MAX, &[0.5]));
        // nor does one whose stamp is no time stop it
        let mut repeats = Repeats::new(1, i64::MAX);
        for (k, stamp_ns) in [i64::MIN, -1, i64::MAX - 1, i64::MAX]
            .into_iter()
            .enumerate()
        {
            repeats.take(stamp_ns, &[k as f64]);
            repeats.take(stamp_ns, &[k as f64]);
        }
    }
}
