//! Detects events of the machine in the rows around them; [`EventKind`] defines them.

use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::number::SURE_SIGMAS;

use super::causes::Causes;
use super::episodes::{Episode, MERGED_NS, episodes_within, joined, least, most};
use super::event::{Bound, Event, EventKind, ShownBy, TIP_OVER_RAD};
use super::evidence::Evidence;
use super::leaning;
use super::onset::{self, Curve, Onset};
use super::pages::Pages;
use super::tipping::Tipping;

/// Time before a rotation about an edge at which the wheel that lifts last is identified (s).
const BEFORE_S: f64 = 0.1;
/// Time over which its load is averaged then (s).
const AVERAGED_S: f64 = 0.3;
/// Probability that loads are right from which on nothing is stated about their error.
const LEAST_RIGHT: f64 = 0.99;
/// Subject of the doubt of loads that the platform does not show.
pub(crate) const NO_LEAN: &str = "loads without the lean that they cause";
/// Time before a row from which the standard deviation of a load is taken that is unknown there (s).
const NEAR_S: f64 = 1.0;
/// Shortest time before an onset that rows must show (s).
const SEEN_S: f64 = 0.1;

/// Finds the events of the machine in some rows around which nothing happens.
pub(super) struct Finder<'a> {
    pub(super) machine: &'a Machine,
    pub(super) rows: &'a Pages<'a>,
    /// The rows.
    pub(super) within: Episode,
    pub(super) min_loads_n: Option<&'a [f64]>,
    /// Times of tipping in these rows and near them.
    pub(super) tippings: &'a [Tipping],
    pub(super) evidence: Evidence<'a>,
    pub(super) causes: Option<Causes<'a>>,
}

/// Direction in which time runs.
#[derive(Clone, Copy)]
enum Time {
    /// Forward, up to a time (s) from which on the load is known to be zero.
    Forward(f64),
    Backward,
}

/// A load that falls through zero when an event begins, and rises through it when it ends.
#[derive(Clone, Copy)]
enum Falling<'a> {
    /// That of a wheel above a level (N), as if it alone were held to the ground.
    Wheel(usize, f64),
    /// That of a wheel beside others in the air: how far below zero it was is not known, but how fast it rises.
    BesideOthers(usize),
    /// That off the edge of a tipping.
    OffEdge(&'a Tipping),
}

impl Finder<'_> {
    /// The events, those of `tippings` in these rows included.
    pub(super) fn events(&self) -> Vec<Event> {
        let mut events = Vec::new();
        for wheel in 0..self.machine.wheels().len() {
            if let Some(min_loads_n) = self.min_loads_n {
                events.extend(self.wheel_light(wheel, min_loads_n[wheel]));
            }
            events.extend(self.wheel_lift(wheel));
        }
        let Episode { first, last } = self.within;
        let of_rows = |tipping: &&Tipping| (first..=last).contains(&tipping.episode.first);
        for tipping in self.tippings.iter().filter(of_rows) {
            let event = self.edge_tipping(tipping, &events);
            events.extend(self.tip_over(tipping, &event));
            events.push(event);
        }
        events
    }

    fn column(&self, quantity: Quantity) -> impl Fn(usize) -> f64 {
        move |row| self.rows.value(quantity, row)
    }

    fn episodes(&self, holds: impl Fn(usize) -> bool) -> Vec<Episode> {
        episodes_within(self.rows.times_ns, self.within, |row| {
            self.rows.is_meaningful(row) && holds(row)
        })
    }

    fn event(
        &self,
        kind: EventKind,
        subject: &str,
        episode: Episode,
        worst: (usize, f64),
        unit: &'static str,
    ) -> Event {
        let times = self.rows.times_ns;
        let [start_bound, end_bound] = self.bounds(episode);
        Event {
            start_bound,
            end_ns: (episode.last + 1 < times.len()).then(|| times[episode.last]),
            end_bound,
            worst: worst.1,
            worst_ns: times[worst.0],
            unit,
            ..Event::blank(kind, times[episode.first], subject.to_lowercase())
        }
    }

    /// Returns how the first and the last row of an episode bound it: next to rows that are missing, or without loads, nothing
    /// shows that the episode began or ended there.
    fn bounds(&self, episode: Episode) -> [Bound; 2] {
        let Episode { first, last } = episode;
        let times = self.rows.times_ns;
        let is_known = |row: usize| row < self.rows.known() && self.rows.is_meaningful(row);
        let follows = |row: usize| times[row + 1] - times[row] <= MERGED_NS;
        let begins = first > 0 && is_known(first - 1) && follows(first - 1);
        let is_last = last + 1 == times.len();
        let ends = is_last || is_known(last + 1) && follows(last);
        [
            if begins { Bound::At } else { Bound::AtOrBefore },
            if ends { Bound::At } else { Bound::AtOrAfter },
        ]
    }

    /// The times in which the machine rotated about an edge that does not carry a wheel.
    fn rotations_off(&self, wheel: usize) -> impl Iterator<Item = &Tipping> {
        let rotations = self.tippings.iter().filter(|tipping| tipping.rotates);
        rotations.filter(move |tipping| tipping.factors[wheel] > 0.0)
    }

    /// The first of them in an episode. A machine that falls on its side and then on its roof rotates about more than one edge:
    /// the first lifted the wheel.
    fn rotation_over(&self, wheel: usize, episode: Episode) -> Option<&Tipping> {
        let overlaps = |t: &&Tipping| t.episode.overlaps(episode);
        (self.rotations_off(wheel).filter(overlaps)).min_by_key(|tipping| tipping.episode.first)
    }

    /// Whether the machine rotated about an edge already when an episode began. A wheel of an axle astride that edge, which leaves the
    /// ground when the axle comes to its stop, carries no load by then that is seen to fall.
    fn rotates_before(&self, Episode { first, .. }: Episode) -> bool {
        let mut rotating = self.tippings.iter().filter(|tipping| tipping.rotates);
        rotating.any(|it| it.episode.first < first && first <= it.episode.last)
    }

    fn is_rotated_off(&self, wheel: usize, row: usize) -> bool {
        let mut rows = (self.rotations_off(wheel)).map(|t| t.episode.first..=t.episode.last);
        rows.any(|rows| rows.contains(&row))
    }

    fn wheel_light(&self, wheel: usize, min_load_n: f64) -> Vec<Event> {
        let load = self.column(Quantity::Load(wheel));
        let largest = self.column(Quantity::LoadLargest(wheel));
        let name = &self.machine.wheels()[wheel].name;
        let found = self.episodes(|row| load(row) < min_load_n || self.is_rotated_off(wheel, row));
        let found = found.into_iter().map(|episode| {
            let worst = least(&load, episode);
            let mut event = self.event(EventKind::WheelLight, name, episode, worst, "N");
            let falling = Falling::Wheel(wheel, min_load_n);
            self.end(&mut event, episode.last, falling);
            let rotation = self.rotation_over(wheel, episode);
            match rotation.filter(|_| !(load(episode.first) < min_load_n)) {
                // where the rotation alone shows that it was light, it was so when the rotation began, and may have been before
                Some(tipping) => {
                    self.start_with(&mut event, tipping);
                    event.start_bound = Bound::AtOrBefore;
                }
                None => {
                    let time = self.lifts_before(wheel, episode);
                    let passes = self.passage(falling, episode.first, time);
                    event.start_sigma_s = passes.map(|onset| {
                        let off_s = onset.at_s - self.rows.seconds(episode.first);
                        onset.sigma_s.hypot(off_s)
                    });
                }
            }
            // loads held at zero are equal: any row may be the least
            let holds = |row: usize| largest(row) < min_load_n;
            let is_sure = rotation.is_some() || (episode.first..=episode.last).any(holds);
            event.split_dependent = Some(!is_sure);
            self.add_confidence(&mut event, wheel, min_load_n, episode);
            self.doubt_lift(&mut event, wheel, episode, rotation);
            event.causes = self.causes(event.start_ns, &self.only(wheel));
            event
        });
        found.collect()
    }

    fn wheel_lift(&self, wheel: usize) -> Vec<Event> {
        let (load, otf) = (
            self.column(Quantity::Load(wheel)),
            self.column(Quantity::Otf(wheel)),
        );
        let largest = self.column(Quantity::LoadLargest(wheel));
        let weight = self.column(Quantity::NormalForce);
        let name = &self.machine.wheels()[wheel].name;
        let found = self.episodes(|row| load(row) <= 0.0 || self.is_rotated_off(wheel, row));
        // a load that is zero within its error is no touch-down
        let may_lift = |row: usize| {
            self.rows.is_meaningful(row) && load(row) <= self.evidence.load_sigma(wheel, row)
        };
        let parts = found.clone();
        let found = joined(self.rows.times_ns, found, may_lift);
        let found = found.into_iter().map(|episode| {
            // beside a wheel that is off the ground the OTF is not what holding this one takes
            let worst = least(|row| otf(row).min(load(row)), episode);
            let mut event = self.event(EventKind::WheelLift, name, episode, worst, "N");
            // with no load left off an edge, that of one wheel is unknown: the first one came down when their sum rose through zero
            let comes_down =
                |t: &&Tipping| t.factors[wheel] > 0.0 && t.episode.last == episode.last;
            let with_edge = self.tippings.iter().find(comes_down);
            let falling = Falling::Wheel(wheel, 0.0);
            let beside = Falling::BesideOthers(wheel);
            let rising = [Some(falling), with_edge.map(Falling::OffEdge), Some(beside)];
            let mut rising = rising.into_iter().flatten();
            rising.any(|of| self.end(&mut event, episode.last, of));
            self.add_confidence(&mut event, wheel, 0.0, episode);
            let rotation = self.rotation_over(wheel, episode);
            let holds = |row: usize| largest(row) <= 1e-6 * weight(row);
            let is_sure = rotation.is_some() || (episode.first..=episode.last).any(holds);
            event.split_dependent = Some(!is_sure);
            // where the loads do not show the rotation, they do not show when the wheel lifted before it
            let is_shown = rotation
                .is_none_or(|tipping| tipping.is_by_loads || episode.first < tipping.episode.first);
            let passage = |of| self.passage(of, episode.first, self.lifts_before(wheel, episode));
            // of a lift that is joined of parts, those before the first that is one for certain may have been none
            let mut parts = parts.iter().filter(|part| part.overlaps(episode));
            let is_certain = |part: &Episode| {
                let mut rows = part.first..=part.last;
                rows.any(|row| otf(row) < -SURE_SIGMAS * self.evidence.load_sigma(wheel, row))
            };
            let last = parts.clone().next_back();
            let lifts_by = parts.find(|part| is_certain(part)).or(last);
            let lifts_by_s = lifts_by.map_or(0.0, |part| {
                self.rows.seconds(part.first) - self.rows.seconds(episode.first)
            });
            let own = passage(falling).filter(|_| is_shown).map(|onset| Onset {
                sigma_s: onset.sigma_s.hypot(lifts_by_s),
                ..onset
            });
            // with no load left off an edge, that of one wheel is unknown: the last one lifted when their sum was zero
            let first_s = self.rows.seconds(episode.first);
            let of_edge = || {
                let off = (self.tippings.iter()).filter(|t| t.factors[wheel] > 0.0 && !t.rotates);
                let onsets = off.filter_map(|tipping| tipping.onset);
                // a wheel that was off the ground before the others has no onset of theirs
                let is_here = |onset: &Onset| {
                    (onset.at_s - first_s).abs() <= onset::STATED_SIGMAS * onset.sigma_s
                };
                let distance_s = |onset: &Onset| (onset.at_s - first_s).abs();
                (onsets.filter(is_here)).min_by(|a, b| distance_s(a).total_cmp(&distance_s(b)))
            };
            let beside = || (!self.rotates_before(episode)).then(|| passage(beside));
            let without_rotation = || of_edge().or_else(|| beside().flatten());
            let own = own.or_else(|| rotation.is_none().then(without_rotation).flatten());
            let is_earlier =
                |tipping: &Tipping| own.is_some_and(|own| own.at_s < self.begins_s(tipping));
            // what is off the ground from the first known row on, by its own load, does not lift with a machine that tips later
            let is_unseen = event.start_bound == Bound::AtOrBefore;
            let was_off = |tipping: &Tipping| {
                let sigma_s = tipping.onset.map_or(0.0, |onset| onset.sigma_s);
                let until_s = self.begins_s(tipping) - SURE_SIGMAS * sigma_s;
                let rows = episode.first..=episode.last;
                let mut before = rows.take_while(|&row| self.rows.seconds(row) < until_s);
                before.any(|row| {
                    let error_n = SURE_SIGMAS * self.evidence.load_sigma(wheel, row);
                    self.rows.is_meaningful(row) && otf(row) < -error_n
                })
            };
            let lifts_with = |tipping: &Tipping| {
                let is_with = self.lifts_last(wheel, tipping) || !is_earlier(tipping);
                is_with && !(is_unseen && was_off(tipping))
            };
            match rotation {
                Some(tipping) if lifts_with(tipping) => {
                    self.start_with(&mut event, tipping);
                    if !self.lifts_last(wheel, tipping) {
                        event.start_bound = Bound::AtOrBefore;
                    }
                    event.causes = self.causes(event.start_ns, &tipping.factors);
                }
                _ => {
                    self.doubt_lift(&mut event, wheel, episode, rotation);
                    self.start(&mut event, episode, own, Some(falling));
                    if own.is_none() && self.rotates_before(episode) {
                        event.start_bound = Bound::AtOrBefore;
                    }
                    event.any_split_ns = rotation.map(|t| self.start_of(t.episode, t.onset));
                    event.causes = self.causes(event.start_ns, &self.only(wheel));
                }
            }
            event
        });
        found.collect()
    }

    /// Doubts the event of a wheel that began before a rotation showed it, if any does: what was before, only loads show.
    fn doubt_lift(
        &self,
        event: &mut Event,
        wheel: usize,
        Episode { first, last }: Episode,
        rotation: Option<&Tipping>,
    ) {
        let last = match rotation.map(|tipping| tipping.episode.first) {
            Some(shown) if shown <= first => return,
            Some(shown) => shown - 1,
            None => last,
        };
        let by_loads = Episode { first, last };
        self.doubt(event, by_loads, |tipping| tipping.factors[wheel] > 0.0);
        let known = self.rows.known() - 1;
        self.doubt_by_lean(event, by_loads, rotation.map_or(known, |_| last));
    }

    /// Doubts an event that only loads show if the platform does not lean as they do, in rows up to `last`.
    fn doubt_by_lean(&self, event: &mut Event, by_loads: Episode, last: usize) {
        let right = leaning::loads_are_right(self.machine, self.rows, by_loads, last);
        // loads below zero, if they are a doubt already, are another sign of the same wrong loads
        let known = (event.doubt.as_ref()).map_or(1.0, |doubt| doubt.loads_are_right);
        if let Some(right) = right.filter(|right| *right < LEAST_RIGHT.min(known)) {
            event.doubt_by(vec![NO_LEAN.into()], right / known);
        }
    }

    /// Doubts the event of a wheel, or of an edge, by the tippings that only loads show if these are farther below zero than their
    /// error.
    fn doubt(&self, event: &mut Event, episode: Episode, is_of: impl Fn(&Tipping) -> bool) {
        let overlaps = |t: &&Tipping| t.episode.overlaps(episode);
        let tippings = self.tippings.iter().filter(overlaps);
        let least = tippings
            .filter(|tipping| is_of(tipping) && tipping.loads_are_right < LEAST_RIGHT)
            .min_by(|a, b| a.loads_are_right.total_cmp(&b.loads_are_right));
        if let Some(tipping) = least {
            let edge = &self.machine.polygon().edges()[tipping.edge].name;
            let edge = edge.to_lowercase();
            event.doubt_by(
                vec![format!("loads below zero off the {edge} edge")],
                tipping.loads_are_right,
            );
        }
    }

    /// Whether a wheel is the last one to lift when the machine begins to rotate about an edge: the heaviest shortly before.
    fn lifts_last(&self, wheel: usize, tipping: &Tipping) -> bool {
        let onset_s = self.begins_s(tipping);
        let [first, last] = [BEFORE_S + AVERAGED_S, BEFORE_S]
            .map(|before_s| self.rows.row_from(onset_s - before_s));
        // one row alone may be one in which the platform rocks
        let load = |wheel: usize| {
            let loads = (first..=last).map(|row| self.rows.value(Quantity::Load(wheel), row));
            loads.filter(|load| load.is_finite()).sum::<f64>()
        };
        let off = (0..self.machine.wheels().len()).filter(|&other| tipping.factors[other] > 0.0);
        let heaviest = off.max_by(|&a, &b| load(a).total_cmp(&load(b)));
        heaviest == Some(wheel)
    }

    /// A load without this expected error, in a row (N).
    fn load(&self, of: Falling<'_>, error_n: f64, row: usize) -> f64 {
        let value = |quantity: Quantity| self.rows.value(quantity, row);
        match of {
            Falling::Wheel(wheel, level_n) => {
                self.evidence.held_load(wheel, row) - error_n - level_n
            }
            Falling::BesideOthers(wheel) => value(Quantity::Load(wheel)) - error_n,
            Falling::OffEdge(tipping) => {
                let wheels = tipping.factors.iter().enumerate();
                let off = wheels.filter(|(_, factor)| **factor > 0.0);
                let loads = off.map(|(wheel, factor)| factor * value(Quantity::Otf(wheel)));
                loads.sum::<f64>() - error_n
            }
        }
    }

    /// Time at which a tipping began (s).
    fn begins_s(&self, tipping: &Tipping) -> f64 {
        match tipping.onset {
            Some(onset) => onset.at_s,
            None => self.rows.seconds(tipping.episode.first),
        }
    }

    /// Returns time that runs forward up to where a wheel carries nothing for certain, if its load fell to zero in an episode at all:
    /// a rotation lifts it, or the episode ends.
    fn lifts_before(&self, wheel: usize, episode: Episode) -> Time {
        let last_s = self.rows.seconds(episode.last);
        let rotation = self.rotation_over(wheel, episode);
        Time::Forward(rotation.map_or(last_s, |tipping| self.begins_s(tipping).min(last_s)))
    }

    /// Finds the time at which a load falls through zero around a row, or rises through it: then it falls in time that runs
    /// backward.
    fn passage(&self, of: Falling<'_>, row: usize, time: Time) -> Option<Onset> {
        let known = |sigma_n: f64| Some(sigma_n).filter(|sigma_n| sigma_n.is_finite());
        let (error_n, sigma_n) = match of {
            Falling::Wheel(wheel, _) => {
                let error = self.evidence.known_error(wheel, row);
                let sigma_n = self.evidence.sigma_of(wheel, row);
                (error.mean_n, sigma_n * error.variance_share.sqrt())
            }
            Falling::BesideOthers(wheel) => (0.0, known(self.sigma_beside(wheel, row))?),
            Falling::OffEdge(tipping) => (0.0, known(tipping.sigma_n)?),
        };
        let near_s = self.rows.seconds(row);
        let longest_s = onset::PASSAGES_S[onset::PASSAGES_S.len() - 1];
        let mut curve = Curve::default();
        let near = |row: &usize| (self.rows.seconds(*row) - near_s).abs() <= longest_s;
        let before = (0..row).rev().take_while(near).last().unwrap_or(row);
        let mut rows: Vec<usize> = (before..self.rows.len()).take_while(near).collect();
        let sign = match time {
            Time::Forward(zero_from_s) => {
                curve.zero_from_s = Some(zero_from_s);
                1.0
            }
            Time::Backward => {
                rows.reverse();
                -1.0
            }
        };
        for row in rows.into_iter().filter(|&row| self.rows.is_meaningful(row)) {
            curve.push(sign * self.rows.seconds(row), self.load(of, error_n, row));
        }
        let found = onset::passage(&curve, sign * near_s, sigma_n)?;
        let at_s = sign * found.at_s;
        Some(Onset { at_s, ..found })
    }

    /// Standard deviation of the load of a wheel beside others in the air, at a row or shortly before it (N): not that of its OTF.
    fn sigma_beside(&self, wheel: usize, row: usize) -> f64 {
        let sigma = self.column(Quantity::LoadSigma(wheel));
        let near = |before: &usize| self.rows.seconds(row) - self.rows.seconds(*before) <= NEAR_S;
        let mut before = (0..=row).rev().take_while(near).map(sigma);
        let known = before.find(|sigma_n| sigma_n.is_finite());
        known.unwrap_or_else(|| self.evidence.sigma_of(wheel, row))
    }

    fn start_of(&self, episode: Episode, onset: Option<Onset>) -> i64 {
        match onset {
            Some(onset) => self.rows.time_ns(onset.at_s),
            None => self.rows.times_ns[episode.first],
        }
    }

    /// Starts an event with its onset, if one was found; where a load must have been seen to fall before it, with that.
    fn start(
        &self,
        event: &mut Event,
        episode: Episode,
        onset: Option<Onset>,
        falling: Option<Falling<'_>>,
    ) {
        // an onset after the end was fitted to what follows: between both lies how wrong it is
        let first_s = self.rows.seconds(episode.first);
        let ends_ns = event.end_ns.unwrap_or(i64::MAX);
        let onset = onset.map(|onset| match self.rows.time_ns(onset.at_s) > ends_ns {
            true => Onset {
                at_s: first_s,
                sigma_s: onset.sigma_s.hypot(onset.at_s - first_s),
                ..onset
            },
            false => onset,
        });
        event.start_ns = self.start_of(episode, onset);
        event.start_sigma_s = onset.map(|onset| onset.sigma_s);
        if let Some(onset) = onset {
            let is_shown = self.is_known_before(onset);
            event.start_bound = if is_shown {
                Bound::At
            } else {
                Bound::AtOrBefore
            };
        }
        let start_s = onset.map_or(first_s, |onset| onset.at_s);
        if falling.is_some_and(|of| !self.is_seen_to_fall(of, start_s)) {
            event.start_bound = Bound::AtOrBefore;
        }
    }

    /// Starts an event with a tipping: in a fall that is under way, what is so in its first row was so before.
    fn start_with(&self, event: &mut Event, tipping: &Tipping) {
        // what gyro and attitude show needs no load that was seen to fall
        let falling = (!tipping.rotates).then_some(Falling::OffEdge(tipping));
        self.start(event, tipping.episode, tipping.onset, falling);
        if tipping.is_under_way {
            event.is_under_way = true;
            event.start_bound = Bound::AtOrBefore;
        }
    }

    /// Ends an event where a load rises through zero, between the last row of its episode and the next; tells whether it does.
    fn end(&self, event: &mut Event, last: usize, of: Falling<'_>) -> bool {
        if event.end_ns.is_none() || event.end_bound != Bound::At {
            return false;
        }
        let [below_n, above_n] = [last, last + 1].map(|row| self.load(of, 0.0, row));
        let does_rise = below_n <= 0.0 && above_n > 0.0;
        if does_rise {
            let share = below_n / (below_n - above_n);
            let [last_s, next_s] = [last, last + 1].map(|row| self.rows.seconds(row));
            let end_s = last_s + share * (next_s - last_s);
            event.end_ns = Some(self.rows.time_ns(end_s));
            let rises = self.passage(of, last, Time::Backward);
            event.end_sigma_s = rises.map(|it| it.sigma_s.hypot(it.at_s - end_s));
        }
        does_rise
    }

    /// Whether any of the rows before a time, back to the first that is missing, shows a load above zero, by two standard deviations:
    /// where all of them leave open whether it was there, it may have been zero from the first of them on.
    fn is_seen_to_fall(&self, of: Falling<'_>, at_s: f64) -> bool {
        let follows =
            |row: usize| self.rows.times_ns[row + 1] - self.rows.times_ns[row] <= MERGED_NS;
        let before = (0..self.rows.row_from(at_s).min(self.rows.len())).rev();
        let mut known = before.take_while(|&row| {
            self.rows.is_meaningful(row) && (row + 1 == self.rows.len() || follows(row))
        });
        known.any(|row| {
            let load_n = match of {
                Falling::Wheel(wheel, level_n) => {
                    self.rows.value(Quantity::Load(wheel), row) - level_n
                }
                _ => self.load(of, 0.0, row),
            };
            let sigma_n = match of {
                Falling::Wheel(wheel, _) | Falling::BesideOthers(wheel) => {
                    self.evidence.load_sigma(wheel, row)
                }
                Falling::OffEdge(tipping) => tipping.sigma_n,
            };
            // without uncertainties any load is one
            load_n > SURE_SIGMAS * if sigma_n.is_finite() { sigma_n } else { 0.0 }
        })
    }

    /// Whether the rows show the time before an onset: a load that falls must have been seen to fall.
    fn is_known_before(&self, onset: Onset) -> bool {
        let seconds = |row: usize| self.rows.seconds(row);
        let from_s = onset.at_s - onset.sigma_s.max(SEEN_S);
        let mut row = self.rows.row_from(onset.at_s);
        while let Some(before) = row.checked_sub(1) {
            let is_gap = row < self.rows.len()
                && self.rows.times_ns[row] - self.rows.times_ns[before] > MERGED_NS;
            if is_gap || !self.rows.is_meaningful(before) {
                return false;
            }
            if seconds(before) <= from_s {
                return true;
            }
            row = before;
        }
        false
    }

    fn add_confidence(&self, event: &mut Event, wheel: usize, limit_n: f64, episode: Episode) {
        let confidence = self.evidence.below(wheel, limit_n, episode);
        let row = confidence.row;
        let range_n = [Quantity::LoadLeast(wheel), Quantity::LoadLargest(wheel)];
        let range_n = range_n.map(|quantity| self.rows.value(quantity, row));
        event.certainty = confidence.stated;
        event.certainty_any_split = confidence.any_split;
        event.judged_ns = Some(self.rows.times_ns[row]);
        event.load_range_n = (range_n.iter().all(|n| n.is_finite())).then_some(range_n);
    }

    fn only(&self, wheel: usize) -> Vec<f64> {
        let wheels = 0..self.machine.wheels().len();
        wheels.map(|w| f64::from(u8::from(w == wheel))).collect()
    }

    fn causes(&self, start_ns: i64, factors: &[f64]) -> Option<super::event::EventCauses> {
        self.causes.as_ref()?.of(start_ns, factors)
    }

    /// Edge tipping: every wheel off the edge is unloaded. Their sum does not depend on the load split.
    fn edge_tipping(&self, tipping: &Tipping, found: &[Event]) -> Event {
        let name = &self.machine.polygon().edges()[tipping.edge].name;
        let moment = self.column(Quantity::ItomFull(tipping.edge));
        let worst = most(&moment, tipping.episode);
        let mut event = self.event(EventKind::EdgeTipping, name, tipping.episode, worst, "N m");
        self.start_with(&mut event, tipping);
        // where the load of one wheel is all that shows it, it is the same event
        if let Some(lift) = self.lift_that_is(tipping, event.start_ns, found) {
            (event.start_ns, event.start_sigma_s) = (lift.start_ns, lift.start_sigma_s);
            event.start_bound = lift.start_bound;
        }
        self.end(&mut event, tipping.episode.last, Falling::OffEdge(tipping));
        event.split_dependent = Some(false);
        event.certainty = tipping.certainty;
        event.certainty_any_split = tipping.certainty;
        event.judged_ns = Some(self.rows.times_ns[tipping.judged]);
        event.shown_by = Some(match tipping.is_by_loads {
            true => ShownBy::Loads,
            false => ShownBy::Rotation,
        });
        event.rotation_rad = Some(tipping.rotation.0).filter(|rotation| rotation.is_finite());
        self.doubt(&mut event, tipping.episode, |other| {
            other.edge == tipping.edge
        });
        if !tipping.rotates {
            self.doubt_by_lean(&mut event, tipping.episode, self.rows.known() - 1);
        }
        event.causes = self.causes(event.start_ns, &tipping.factors);
        event
    }

    /// Returns the lift that is all there is of a tipping about an edge off which one wheel stands, as about the pivot of an axle.
    fn lift_that_is<'e>(
        &self,
        tipping: &Tipping,
        start_ns: i64,
        found: &'e [Event],
    ) -> Option<&'e Event> {
        let mut off = (0..tipping.factors.len()).filter(|&wheel| tipping.factors[wheel] > 0.0);
        let (wheel, None) = (off.next()?, off.next()) else {
            return None;
        };
        let name = self.machine.wheels()[wheel].name.to_lowercase();
        let is_it = |event: &&Event| {
            let [first, last] = event.span_ns();
            let is_lift = event.kind == EventKind::WheelLift && event.subject == name;
            let ends_ns = self.rows.times_ns[tipping.episode.last];
            let begins_by_ns = start_ns.saturating_add(MERGED_NS).min(ends_ns);
            is_lift && first <= begins_by_ns && start_ns <= last
        };
        let lifts = found.iter().filter(|_| !tipping.rotates).filter(is_it);
        lifts.min_by_key(|event| event.start_ns.abs_diff(start_ns))
    }

    /// Returns the tip-over that an edge tipping turned into, if it did.
    fn tip_over(&self, tipping: &Tipping, event: &Event) -> Option<Event> {
        let (rotation, row) = tipping.rotation;
        (rotation >= TIP_OVER_RAD).then(|| Event {
            kind: EventKind::TipOver,
            worst: rotation,
            worst_ns: self.rows.times_ns[row],
            unit: "rad",
            ..event.clone()
        })
    }
}

/// Sets the lead of each event: time since the onset of the earliest `wheel_light` still active at its start. Of a wheel that
/// the rotation alone shows to be light, it is not known since when; after one that may have been light before the rows that show
/// it, no lead is known.
pub(super) fn add_leads(events: &mut [Event]) {
    let by_rotation =
        |event: &&Event| event.start_bound == Bound::AtOrBefore && event.start_sigma_s.is_some();
    let light: Vec<(Option<i64>, [i64; 2], String)> = events
        .iter()
        .filter(|event| event.kind == EventKind::WheelLight && !by_rotation(event))
        .map(|event| {
            let is_known = event.start_bound == Bound::At;
            let start_ns = is_known.then_some(event.start_ns);
            (start_ns, event.span_ns(), event.subject.clone())
        })
        .collect();
    for event in events
        .iter_mut()
        .filter(|event| event.kind != EventKind::WheelLight)
    {
        let going = light.iter().filter(|(_, [start, end], _)| {
            *start <= event.start_ns && event.start_ns <= end.saturating_add(MERGED_NS)
        });
        // none is less than any
        let earliest = going.min_by_key(|(start, ..)| *start);
        let from = earliest.and_then(|(start, _, wheel)| Some(((*start)?, wheel)));
        event.lead_s = from.map(|(start, _)| (event.start_ns - start) as f64 * 1e-9);
        event.lead_from = from.map(|(_, wheel)| wheel.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lead_counts_from_the_wheel_that_was_light_first() {
        let event = |kind, subject: &str, [start_s, end_s]: [i64; 2]| Event {
            end_ns: Some(end_s * 1_000_000_000),
            ..Event::blank(kind, start_s * 1_000_000_000, subject.into())
        };
        let mut events = [
            event(EventKind::WheelLight, "fl", [1, 2]),
            event(EventKind::WheelLight, "rr", [4, 9]),
            event(EventKind::WheelLight, "fr", [3, 9]),
            event(EventKind::WheelLift, "rr", [5, 9]),
            event(EventKind::WheelLift, "fl", [20, 21]),
        ];
        add_leads(&mut events);
        let lead = |place: usize| (events[place].lead_s, events[place].lead_from.as_deref());
        assert_eq!(lead(3), (Some(2.0), Some("fr")));
        assert_eq!(lead(4), (None, None));
        // one that may have been light before the rows that show it was so first
        events[1].start_bound = Bound::AtOrBefore;
        add_leads(&mut events);
        assert_eq!((events[3].lead_s, &events[3].lead_from), (None, &None));
    }
}
