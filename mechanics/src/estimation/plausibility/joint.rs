//! Plausibility checks of a joint: position, velocity, and their consistency.

use super::fault::Component;
use super::flicker::Flicker;
use super::notice::{Found, Limits, Notice};
use super::outliers::Outliers;
use super::pace::Pace;
use crate::estimation::turns::shorter_way;
use crate::machine::FaultKind;

/// Time constant of the comparison of velocity and position (s).
const MEMORY_S: f64 = 0.5;
/// Time constant of the reported difference (s).
const DIFFERENCE_MEMORY_S: f64 = 0.1;
/// Allowance for noise and resolution of a position in a difference (rad or m).
const POSITION_ALLOWANCE: f64 = 0.01;
/// Allowance for noise of a measured velocity in its change (rad/s or m/s).
const RATE_ALLOWANCE: f64 = 0.2;
/// Number of identical positions, contradicted by the velocity, from which the joint counts as frozen.
const FEWEST_IDENTICAL: u32 = 5;
/// A wheel that turns further between two samples (rad) could be mistaken for one turning backwards.
const LARGEST_WHEEL_STEP: f64 = 2.0;
/// Velocity above which a joint counts as moving (rad/s or m/s); ten times as much for a wheel.
const MOVING_RATE: f64 = 0.05;
/// Differences between two velocities that do no harm (rad/s or m/s), of a joint and of a wheel.
const HARMLESS_RATE: [f64; 2] = [0.3, 3.0];
/// Acceleration that a step between two positions does not exceed without being an outlier, where no velocity is measured
/// (rad/s^2 or m/s^2).
const USUAL_ACCELERATION: f64 = 10.0;
/// Largest difference between two positions that noise explains, as a multiple of the mean change that goes back: some four
/// standard deviations.
const NOISE: f64 = 5.0;

/// Limits of a joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointLimits {
    /// Smallest and largest position from the URDF.
    pub(super) range: Option<[f64; 2]>,
    /// Tolerance beyond them.
    pub(super) margin: f64,
    pub(super) max_velocity: f64,
    pub(super) max_acceleration: f64,
    /// Tolerance between the velocity and the derivative of the position.
    pub(super) rate_tolerance: f64,
    pub(super) spins_wheel: bool,
    /// Whether the position may jump by a full turn.
    pub(super) wraps: bool,
}

impl JointLimits {
    /// Difference between two positions; for a joint without limits the shorter way round.
    fn step(&self, from: f64, to: f64) -> f64 {
        match self.wraps {
            true => shorter_way(to - from),
            false => to - from,
        }
    }
}

/// State of the checks of one joint.
#[derive(Debug, Clone)]
pub(super) struct JointWatch {
    pub(super) limits: JointLimits,
    /// The last credible position, and whether another one agreed with it: the first one is as likely to be wrong.
    good: Option<Held>,
    is_confirmed: bool,
    /// Jump of the joint to a position that it cannot have moved to, while it stays there.
    jump: Option<Jump>,
    /// Last position that was measured: before a gap, before the joint froze, or in an earlier session. Kept until a second
    /// sample has confirmed the present position.
    last_known: Option<Held>,
    /// The freeze, while the joint repeats the position at which it froze.
    frozen: Option<Frozen>,
    /// Stamp since which the position has been exactly zero without a break: as before the hardware is read (ns).
    zero_since_ns: Option<i64>,
    /// Whether the joint has had two different credible positions, with a motion between them that is possible.
    has_changed: bool,
    good_rate: Option<(i64, f64)>,
    /// Position and velocity of the last sample that was compared.
    last: Option<(i64, f64, f64)>,
    last_ns: Option<i64>,
    period_s: f64,
    moves: bool,
    /// Number of consecutive identical positions, and their start.
    run: u32,
    run_since_ns: i64,
    agreement: Agreement,
    flicker: Flicker,
    pace: Pace,
    outliers: Outliers<1>,
    rate_outliers: Outliers<1>,
}

/// Positions that the joint cannot have reached, each of which agrees with the one before.
#[derive(Debug, Clone, Copy)]
struct Jump {
    since_ns: i64,
    /// Size of the jump, and the part of it that may be motion (rad or m).
    by: f64,
    moved: f64,
    last: Held,
}

/// A joint that is not measured any more, and shows the same position.
#[derive(Debug, Clone, Copy)]
struct Frozen {
    /// Start of the freeze (ns); of a joint that froze in an earlier session, the first sample.
    since_ns: i64,
    was_before: bool,
    /// NaN before the first sample.
    position: f64,
    /// Stamp of the last sample with that position (ns).
    last_ns: i64,
    /// Velocity of the joint when it froze (rad/s or m/s); zero if it rested.
    rate: f64,
    /// Mean change by noise before the joint froze (rad or m), and the usual time between changes (s).
    noise: f64,
    interval_s: f64,
}

/// A sample of the joint.
#[derive(Debug, Clone, Copy)]
struct Held {
    stamp_ns: i64,
    position: f64,
    /// Velocity; NaN if it was not measured.
    rate: f64,
}

/// Change of position compared with the integral of the velocity, over the last half second.
///
/// ```text
///     e <- e T/(T + dt) + dq - (r + r_before)/2 dt,    T = 0.5 s
/// ```
/// A velocity error d makes e tend to d T. The difference is a fault beyond
/// `allowance + T tolerance + share * motion`; e is limited to twice that, so that a fault that ends is quickly
/// forgotten. Where the two agree again, the joint is still off by what they came apart, undiminished: that counts as a jump.
#[derive(Debug, Clone, Copy, Default)]
struct Agreement {
    apart: f64,
    motion: f64,
    /// Both without fading, since position and velocity last agreed, and whether there was a fault since then.
    apart_in_all: f64,
    motion_in_all: f64,
    had_fault: bool,
    /// Difference of the velocities, smoothed.
    difference: f64,
    /// Accumulated difference since the fault began.
    since_quiet: f64,
    quiet_ns: i64,
}

impl JointWatch {
    /// `threshold`: log likelihood ratio from which a position that stands still is frozen.
    pub(super) fn new(limits: JointLimits, threshold: f64) -> Self {
        let harmless_rate = HARMLESS_RATE[usize::from(limits.spins_wheel)];
        Self {
            limits,
            flicker: Flicker::new(threshold),
            pace: Pace::new(),
            outliers: Outliers::new(2.0 * POSITION_ALLOWANCE),
            rate_outliers: Outliers::new(harmless_rate),
            good: None,
            is_confirmed: false,
            jump: None,
            last_known: None,
            frozen: None,
            zero_since_ns: None,
            has_changed: false,
            good_rate: None,
            last: None,
            last_ns: None,
            period_s: 0.0,
            moves: false,
            run: 0,
            run_since_ns: 0,
            agreement: Agreement::default(),
        }
    }

    /// Whether the last sample indicates that the joint moves.
    pub(super) fn moves(&self) -> bool {
        self.moves
    }

    /// Whether the last position was measured anew, as its noise shows.
    pub(super) fn flickers(&self) -> bool {
        self.flicker.flickers()
    }

    /// Whether the joint's position has ever changed. An encoder that stopped before the first sample, or that nobody reads,
    /// shows no change.
    pub(super) fn has_changed(&self) -> bool {
        self.has_changed
    }

    /// Whether the joint's position is exactly zero, as that of an encoder that nobody reads.
    pub(super) fn is_at_zero(&self) -> bool {
        self.good.is_none_or(|good| good.position == 0.0)
    }

    /// Whether the joint is not measured any more, and shows the same position since.
    pub(super) fn is_frozen(&self) -> bool {
        let contradicts_rate = self.agreement.had_fault && self.run >= FEWEST_IDENTICAL;
        self.frozen.is_some() || (contradicts_rate && !self.limits.spins_wheel)
    }

    /// Whether the joint was found frozen in this session, and still repeats its position.
    pub(super) fn still_repeats(&self) -> bool {
        let was_before = self.frozen.is_some_and(|frozen| frozen.was_before);
        self.is_frozen() && !was_before && self.run >= FEWEST_IDENTICAL
    }

    /// Returns the velocity of the joint when it stopped to be measured (rad/s or m/s), zero if it rested; `None` if the joint is
    /// measured.
    pub(super) fn frozen_rate(&self) -> Option<f64> {
        let by_rate = self.last.map_or(0.0, |(_, _, rate)| rate);
        let rate = self.frozen.map_or(by_rate, |frozen| frozen.rate);
        self.is_frozen()
            .then_some(if rate.is_finite() { rate } else { 0.0 })
    }

    /// Remembers that the joint was frozen at the end of an earlier session, with its velocity when it froze (rad/s or m/s).
    pub(super) fn remember_frozen(&mut self, rate: f64) {
        self.frozen = Some(Frozen {
            since_ns: i64::MAX,
            was_before: true,
            position: f64::NAN,
            last_ns: i64::MAX,
            rate,
            // no noise is wider than what is allowed
            noise: POSITION_ALLOWANCE / NOISE,
            interval_s: 0.0,
        });
    }

    /// Remembers the position at a stamp of an earlier session.
    pub(super) fn remember_position(&mut self, stamp_ns: i64, position: f64) {
        self.last_known = Some(Held {
            stamp_ns,
            position,
            rate: f64::NAN,
        });
    }

    /// Stamp (ns) and value of the last credible position, that another one agreed with.
    pub(super) fn known_position(&self) -> Option<(i64, f64)> {
        let is_measured = self.is_confirmed && self.zero_since_ns.is_none() && !self.is_frozen();
        let good = self.good.filter(|_| is_measured)?;
        Some((good.stamp_ns, good.position))
    }

    /// Returns the size of the present jump, and the part of it that may be motion (rad or m), where at least two samples show it
    /// and nobody knows yet whether it stays; `None` without a jump. A jump from zeros, before the hardware is read, does not
    /// count.
    pub(super) fn jump(&self) -> Option<[f64; 2]> {
        let jump = (self.jump).filter(|jump| jump.last.stamp_ns > jump.since_ns)?;
        self.zero_since_ns
            .is_none()
            .then_some([jump.by, jump.moved])
    }

    /// Trusts the present position of the joint, as a person says.
    pub(super) fn trust(&mut self) {
        if let Some(jump) = self.jump.take() {
            self.good = Some(jump.last);
            self.forget_motion(jump.last.stamp_ns);
        }
        (self.last_known, self.frozen) = (None, None);
    }

    /// Reports faults of a position and its velocity (NaN if absent) to `found`. `works`: whether something else
    /// moves, or another joint of the message flickers.
    pub(super) fn check(
        &mut self,
        stamp_ns: i64,
        [position, rate]: [f64; 2],
        works: bool,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        // NaN is not measured, in one message or in all of them
        if rate.is_infinite() {
            found(Notice::not_finite(stamp_ns, Component::Rate));
        }
        if !position.is_finite() {
            found(Notice::not_finite(stamp_ns, Component::Value));
            return;
        }
        self.begin(stamp_ns, limits, found);
        self.check_range(stamp_ns, position, found);
        let here = Held {
            stamp_ns,
            position,
            rate,
        };
        let before = self.good;
        let is_credible =
            self.check_step(here, limits, found) && self.check_outlier(here, limits, found);
        let is_changed = before.is_some_and(|before| before.position != position);
        self.has_changed |= is_credible && self.is_confirmed && is_changed;
        let rate = if rate.is_finite() && self.check_rate(stamp_ns, rate, limits, found) {
            rate
        } else {
            f64::NAN
        };
        if is_credible {
            self.check_lost_counts(here, limits, found);
        }
        if is_credible && !self.check_agreement(stamp_ns, position, rate, limits, found) {
            self.check_flicker(stamp_ns, position, works, limits, found);
        }
    }

    /// Checks whether a position without a velocity is an outlier; with one, [`Self::check_step`] finds that.
    fn check_outlier(&mut self, here: Held, limits: &Limits, found: &mut Found<'_>) -> bool {
        if self.limits.spins_wheel || here.rate.is_finite() {
            return true;
        }
        let read_s = self.period_s + self.age_s(here.stamp_ns, limits);
        let step_s = read_s.min(limits.max_gap_s);
        let usual = USUAL_ACCELERATION * step_s * step_s;
        self.outliers.allow(2.0 * POSITION_ALLOWANCE + usual);
        let notice = self
            .outliers
            .notice(here.stamp_ns, [here.position], Component::Value);
        let is_credible = notice.is_none();
        notice.into_iter().for_each(found);
        is_credible
    }

    fn check_flicker(
        &mut self,
        stamp_ns: i64,
        position: f64,
        works: bool,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        if self.limits.spins_wheel {
            return;
        }
        (self.pace).take(stamp_ns, position, limits, |a, b| self.limits.step(a, b));
        let rests = !self.moves;
        let stopped = (self.flicker).stopped_ns(stamp_ns, position, rests, works, limits);
        // whatever works meanwhile, it is measured again when it shows something else
        self.frozen = match (self.frozen, stopped) {
            (Some(frozen), _) if frozen.position == position => Some(frozen),
            (Some(frozen), _) if frozen.position.is_nan() => Some(Frozen {
                since_ns: stamp_ns,
                position,
                last_ns: stamp_ns,
                ..frozen
            }),
            (_, Some(since_ns)) => Some(Frozen {
                since_ns,
                was_before: false,
                position,
                last_ns: stamp_ns,
                rate: self.pace.beyond(NOISE * self.flicker.noise(), limits),
                noise: self.flicker.noise(),
                interval_s: self.period_s * (1.0 + self.flicker.repeats()),
            }),
            _ => None,
        };
        // one sample repeats nothing
        let repeats = self.frozen.filter(|frozen| frozen.since_ns < stamp_ns);
        if let Some(frozen) = repeats {
            let since_ns = frozen.since_ns;
            match frozen.was_before {
                // nobody knows since when
                true => self.is_confirmed = false,
                false => self.freeze(since_ns, position),
            }
            found(
                Notice::of(FaultKind::Frozen, since_ns)
                    .measured(limits.elapsed_s(since_ns, stamp_ns), f64::NAN)
                    .amount(
                        self.limits.max_velocity * limits.elapsed_s(since_ns, stamp_ns),
                        0.0,
                    ),
            );
        }
    }

    /// Reports an encoder that lost counts, if the first position after a freeze shows that: see [`Self::lost`].
    fn check_lost_counts(&mut self, here: Held, limits: &Limits, found: &mut Found<'_>) {
        let Some(mut frozen) = self.frozen else {
            return;
        };
        if frozen.position.is_nan() {
            // one that shows something else than before, or of which nobody knows where it was, is measured again
            let is_elsewhere =
                (self.last_known).is_none_or(|known| known.position != here.position);
            frozen.rate = if is_elsewhere { 0.0 } else { frozen.rate };
        } else if frozen.position == here.position {
            frozen.last_ns = here.stamp_ns;
        } else {
            if let Some([by, moved]) = self.lost(&frozen, here, limits) {
                found(Notice::offset(frozen.since_ns, by, moved));
                // what the velocities say of that time is the same
                self.agreement = Agreement {
                    quiet_ns: here.stamp_ns,
                    ..Agreement::default()
                };
            }
            // later values say nothing of it
            frozen.rate = 0.0;
        }
        self.frozen = Some(frozen);
    }

    /// Returns the error of the position of an encoder that lost counts, and the part of it that may be motion (rad or m): the
    /// joint moved when it froze, and now goes on from there by no more than its motion since the last repeat explains. An
    /// absolute encoder comes back with a step instead.
    ///
    /// The motion meanwhile is not known: the mean of the velocities before and after gives about the distance, unless the joint
    /// turned round. So all of the error may be motion.
    fn lost(&self, frozen: &Frozen, here: Held, limits: &Limits) -> Option<[f64; 2]> {
        if frozen.rate == 0.0 {
            return None;
        }
        let after = match here.rate.abs() <= self.limits.max_velocity {
            true => here.rate,
            false => frozen.rate,
        };
        let since_s = limits
            .elapsed_s(frozen.last_ns, here.stamp_ns)
            .max(frozen.interval_s);
        // by its motion before: a velocity that is derived from the positions explains every step
        let explained = 2.0 * frozen.rate.abs() * since_s + NOISE * frozen.noise;
        let goes_on = self.limits.step(frozen.position, here.position).abs() <= explained;
        let moved = explained + 2.0 * POSITION_ALLOWANCE;
        let still_s = limits.elapsed_s(frozen.since_ns, frozen.last_ns);
        let off = |rate: f64| {
            let [least, greatest] =
                (self.limits.range).unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
            // as far as it can have gone
            let [least, greatest] = [least.min(frozen.position), greatest.max(frozen.position)];
            frozen.position - (frozen.position + rate * still_s).clamp(least, greatest)
        };
        let [before, mean] = [frozen.rate, 0.5 * (frozen.rate + after)].map(off);
        let by = match mean.abs() > moved {
            true => mean,
            false => moved.copysign(before),
        };
        // of one that froze before, nobody knows for how long
        let has_gone_on = frozen.was_before || before.abs() > moved;
        (goes_on && has_gone_on).then_some([by, by.abs()])
    }

    /// Takes the joint as frozen since a stamp at a position: no motion leads on from there, but as after a gap the joint cannot
    /// have gone further than there was time for.
    fn freeze(&mut self, since_ns: i64, position: f64) {
        self.is_confirmed = false;
        self.remember_position(since_ns, position);
    }

    /// Tracks the usual sampling interval; restarts all checks after a gap.
    fn begin(&mut self, stamp_ns: i64, limits: &Limits, found: &mut Found<'_>) {
        let Some(last_ns) = self.last_ns.replace(stamp_ns) else {
            self.agreement.quiet_ns = stamp_ns;
            return;
        };
        let step_s = limits.elapsed_s(last_ns, stamp_ns);
        if step_s > limits.max_gap_s {
            if let (Some([by, moved]), Some(jump)) = (self.jump(), self.jump) {
                // nobody will see whether it would have stayed
                found(Notice::offset(jump.since_ns, by, moved));
                self.good = Some(jump.last);
            }
            let is_known = self.is_confirmed && self.zero_since_ns.is_none();
            // what nothing has confirmed is no place to go on from
            let known = self.good.take().filter(|_| is_known);
            self.last_known = known.or(self.last_known);
            self.jump = None;
            self.forget_motion(stamp_ns);
        } else {
            self.period_s += 0.1 * (step_s - self.period_s);
        }
    }

    /// Forgets the motion: the next position is the first one.
    fn forget_motion(&mut self, stamp_ns: i64) {
        (self.good_rate, self.last) = (None, None);
        self.pace.restart();
        self.outliers.restart();
        self.rate_outliers.restart();
        self.agreement = Agreement {
            quiet_ns: stamp_ns,
            ..Agreement::default()
        };
    }

    fn check_range(&self, stamp_ns: i64, position: f64, found: &mut Found<'_>) {
        let Some([least, greatest]) = self.limits.range else {
            return;
        };
        let nearest = position.clamp(least, greatest);
        let excess = (position - nearest).abs();
        if excess > self.limits.margin {
            found(
                Notice::of(FaultKind::JointLimit, stamp_ns)
                    .measured(position, nearest)
                    .amount(excess, 0.0),
            );
        }
    }

    /// Checks whether the joint can have moved here since the last credible position. The angle of a wheel does not
    /// matter.
    ///
    /// A first position that the next one contradicts is as doubtful as that one. Where the joint stays after a jump, it counts
    /// after longer than a gap, so that no motion leads there. One side of the jump is wrong then, so it contradicts itself.
    /// The same holds of a gap in which it cannot have moved so far.
    fn check_step(&mut self, here: Held, limits: &Limits, found: &mut Found<'_>) -> bool {
        let Held {
            stamp_ns, position, ..
        } = here;
        let Some(good) = self.good.filter(|_| !self.limits.spins_wheel) else {
            (self.good, self.is_confirmed) = (Some(here), false);
            self.zero_since_ns = (position == 0.0).then_some(stamp_ns);
            return true;
        };
        let goes_on = (self.jump).filter(|jump| self.can_reach(jump.last, here, limits));
        if goes_on.is_none() && self.can_reach(good, here, limits) {
            (self.good, self.is_confirmed, self.jump) = (Some(here), true, None);
            self.zero_since_ns = self.zero_since_ns.filter(|_| position == 0.0);
            if self.zero_since_ns.is_none() {
                self.compare_with_last_known(good, good.stamp_ns, limits, found);
            }
            return true;
        }
        let elapsed_s = self.longest_s(good, here, limits);
        let step = self.limits.step(good.position, position).abs();
        let limit = self.limits.max_velocity;
        let mut notice = |since_ns: i64| {
            found(
                Notice::of(FaultKind::ImpossibleRate, since_ns)
                    .measured(step / elapsed_s, limit)
                    .amount(step, step / elapsed_s),
            );
        };
        let begins = Jump {
            since_ns: stamp_ns,
            by: self.limits.step(good.position, position),
            moved: self.moved_between(good, here, elapsed_s),
            last: here,
        };
        let jump = goes_on.map_or(begins, |jump| Jump { last: here, ..jump });
        let jump_ns = jump.since_ns;
        let stays = limits.elapsed_s(jump_ns, stamp_ns) > limits.max_gap_s;
        match (self.is_confirmed, stays) {
            (false, _) => {
                notice(good.stamp_ns);
                self.good = Some(here);
                self.forget_motion(stamp_ns);
            }
            (true, false) => {
                notice(stamp_ns);
                self.jump = Some(jump);
            }
            (true, true) => {
                notice(self.zero_since_ns.unwrap_or(jump_ns));
                // zeros before the hardware is read are wrong, and not what follows: that goes on from where it was before
                match self.zero_since_ns {
                    Some(_) => self.compare_with_last_known(here, jump_ns, limits, found),
                    None => found(Notice::offset(jump_ns, jump.by, jump.moved)),
                }
                (self.good, self.jump, self.zero_since_ns) = (Some(here), None, None);
                self.forget_motion(stamp_ns);
            }
        }
        false
    }

    /// Compares the present position with the last one that was measured, and reports an offset since `since_ns` if the joint
    /// cannot have come here.
    fn compare_with_last_known(
        &mut self,
        here: Held,
        since_ns: i64,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        let Some(before) = self.last_known.take() else {
            return;
        };
        let moved = self.farthest(before, here, limits);
        let by = self.limits.step(before.position, here.position);
        if by.abs() > moved {
            found(Notice::offset(since_ns, by, moved));
        }
    }

    /// Returns the age of a value when its sample came, as [`Flicker::age_s`] (s).
    fn age_s(&self, stamp_ns: i64, limits: &Limits) -> f64 {
        self.flicker.age_s(stamp_ns, self.period_s, limits)
    }

    /// Returns the time between two samples (s).
    fn shortest_s(&self, from: Held, to: Held, limits: &Limits) -> f64 {
        limits
            .elapsed_s(from.stamp_ns, to.stamp_ns)
            .max(self.period_s)
    }

    /// Returns the time between two samples, and that before the first of them since its value was read (s).
    fn longest_s(&self, from: Held, to: Held, limits: &Limits) -> f64 {
        self.shortest_s(from, to, limits) + self.age_s(from.stamp_ns, limits)
    }

    /// Returns the farthest that the joint can have moved between two samples, at its largest velocity (rad or m).
    fn farthest(&self, from: Held, to: Held, limits: &Limits) -> f64 {
        self.limits.max_velocity * self.longest_s(from, to, limits) + 2.0 * POSITION_ALLOWANCE
    }

    /// Returns the farthest that the joint moved between two samples by its measured velocities and their tolerance (rad or m);
    /// without velocities, by the tolerance alone.
    fn moved_between(&self, from: Held, to: Held, elapsed_s: f64) -> f64 {
        let fastest =
            [from.rate, to.rate].map(|rate| if rate.is_finite() { rate.abs() } else { 0.0 });
        let fastest = fastest[0].max(fastest[1]) + self.limits.rate_tolerance;
        fastest * elapsed_s + 2.0 * POSITION_ALLOWANCE
    }

    /// Whether the joint can have moved like this: at its largest velocity, and within what the measured velocities before
    /// and after leave between them,
    /// ```text
    ///     |dq - (r + r_before)/2 dt| <= a_max dt^2 / 4 + (tolerance + share |r|) dt
    /// ```
    /// An error of the velocities shows over many samples, a position that jumps in one. Of a value that is read less often than it
    /// is sent, `dt` is between the time from sample to sample, none if it repeats itself, and that from when it was read.
    fn can_reach(&self, from: Held, to: Held, limits: &Limits) -> bool {
        let step = self.limits.step(from.position, to.position);
        let shortest_s = match step == 0.0 && self.flicker.may_repeat() {
            true => 0.0,
            false => self.shortest_s(from, to, limits),
        };
        let longest_s = self.longest_s(from, to, limits);
        let allowance = 2.0 * POSITION_ALLOWANCE;
        if step.abs() > self.farthest(from, to, limits) {
            return false;
        }
        let mean = 0.5 * (from.rate + to.rate);
        let largest = from.rate.abs().max(to.rate.abs());
        let tolerance = self.limits.rate_tolerance + limits.rate_tolerance_share * largest;
        let [newer, older] = [shortest_s, longest_s].map(|elapsed_s| step - mean * elapsed_s);
        let between = 0.25 * self.limits.max_acceleration * longest_s * longest_s;
        let is_beyond = newer.abs().min(older.abs()) > between + tolerance * longest_s + allowance;
        // without velocities nothing is apart
        !(is_beyond && newer * older > 0.0)
    }

    fn check_rate(
        &mut self,
        stamp_ns: i64,
        rate: f64,
        limits: &Limits,
        found: &mut Found<'_>,
    ) -> bool {
        let mut notice = |measure: f64, limit: f64| {
            found(
                Notice::of(FaultKind::ImpossibleRate, stamp_ns)
                    .about(Component::Rate)
                    .measured(measure, limit)
                    .amount(0.0, rate.abs()),
            );
            false
        };
        if rate.abs() > self.limits.max_velocity {
            return notice(rate.abs(), self.limits.max_velocity);
        }
        if !self.limits.spins_wheel
            && let Some((good_ns, good)) = self.good_rate
        {
            let elapsed_s = limits.elapsed_s(good_ns, stamp_ns).max(self.period_s)
                + self.age_s(good_ns, limits);
            let change = (rate - good).abs();
            if change > self.limits.max_acceleration * elapsed_s + RATE_ALLOWANCE {
                return notice(rate.abs(), self.limits.max_acceleration * elapsed_s);
            }
        }
        self.good_rate = Some((stamp_ns, rate));
        let outlier = self.rate_outliers.notice(stamp_ns, [rate], Component::Rate);
        let is_credible = outlier.is_none();
        outlier.into_iter().for_each(found);
        is_credible
    }

    /// Checks that positions agree with velocities; returns whether a fault was reported. `rate` is NaN if the message has none.
    fn check_agreement(
        &mut self,
        stamp_ns: i64,
        position: f64,
        rate: f64,
        limits: &Limits,
        found: &mut Found<'_>,
    ) -> bool {
        let before = self.last.replace((stamp_ns, position, rate));
        let Some((last_ns, last_position, last_rate)) = before else {
            (self.run, self.run_since_ns) = (1, stamp_ns);
            return false;
        };
        if position.to_bits() == last_position.to_bits() {
            self.run = self.run.saturating_add(1);
        } else {
            (self.run, self.run_since_ns) = (1, stamp_ns);
        }
        let dt = limits.elapsed_s(last_ns, stamp_ns);
        let step = self.limits.step(last_position, position);
        let derived = step / dt.max(self.period_s);
        let velocity = if rate.is_finite() { rate } else { derived };
        let slowest = if self.limits.spins_wheel { 10.0 } else { 1.0 } * MOVING_RATE;
        self.moves = velocity.abs() > slowest;
        let mean = 0.5 * (rate + last_rate);
        let is_ambiguous = self.limits.spins_wheel && (mean * dt).abs() > LARGEST_WHEEL_STEP;
        if !mean.is_finite() || is_ambiguous {
            return false;
        }
        let tolerance = self.limits.rate_tolerance;
        let share = limits.rate_tolerance_share;
        let it = &mut self.agreement;
        let kept = MEMORY_S / (MEMORY_S + dt);
        it.motion = it.motion * kept + step.abs().max((mean * dt).abs());
        let allowed = POSITION_ALLOWANCE + MEMORY_S * tolerance + share * it.motion;
        it.apart = (it.apart * kept + step - mean * dt).clamp(-2.0 * allowed, 2.0 * allowed);
        it.apart_in_all += step - mean * dt;
        it.motion_in_all += step.abs().max((mean * dt).abs());
        let newer = dt / (DIFFERENCE_MEMORY_S + dt);
        it.difference += newer * (step / dt - mean - it.difference);
        // The sum decays slowly after a fault ends, the difference at once.
        if it.apart.abs() <= allowed || it.difference.abs() <= tolerance {
            it.since_quiet = it.apart;
            if it.apart.abs() <= 0.25 * allowed {
                let by = std::mem::take(&mut it.apart_in_all);
                let moved = POSITION_ALLOWANCE
                    + tolerance * limits.elapsed_s(it.quiet_ns, stamp_ns)
                    + share * std::mem::take(&mut it.motion_in_all);
                let is_off = by.abs() > moved && !self.limits.spins_wheel;
                if std::mem::take(&mut it.had_fault) && is_off {
                    found(Notice::offset(it.quiet_ns, by, moved));
                }
                it.quiet_ns = stamp_ns;
            }
            return false;
        }
        it.had_fault = true;
        it.since_quiet += step - mean * dt;
        let is_frozen = self.run >= FEWEST_IDENTICAL;
        let notice = match is_frozen {
            true => {
                let since_ns = it.quiet_ns.max(self.run_since_ns);
                let amount = [it.since_quiet.abs(), it.difference.abs()];
                self.freeze(since_ns, position);
                Notice::of(FaultKind::Frozen, since_ns)
                    .measured(limits.elapsed_s(since_ns, stamp_ns), f64::NAN)
                    .amount(amount[0], amount[1])
            }
            false => {
                let allowed = tolerance + share * mean.abs().max((step / dt).abs());
                Notice::of(FaultKind::Disagreement, it.quiet_ns)
                    .about(Component::Rate)
                    .measured(it.difference.abs(), allowed)
                    .amount(it.apart.abs(), it.difference.abs())
            }
        };
        found(notice);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: JointLimits = JointLimits {
        range: None,
        margin: 0.0,
        max_velocity: 1.0,
        max_acceleration: 100.0,
        rate_tolerance: 0.1,
        spins_wheel: false,
        wraps: false,
    };

    /// Returns the errors reported of a joint that moves from 0.5 to 1.5 s, by its positions and velocities at each sample.
    fn left_off(shown: impl Fn(usize) -> [f64; 2]) -> Vec<f64> {
        let mut watch = JointWatch::new(LIMITS, 25.0);
        let mut offsets = Vec::new();
        for sample in 0..500 {
            let stamp_ns = sample as i64 * 10_000_000;
            let mut take = |notice: Notice| {
                if notice.kind == FaultKind::Contradiction {
                    offsets.push(notice.measure);
                }
            };
            watch.check(stamp_ns, shown(sample), true, &Limits::OF_TESTS, &mut take);
        }
        offsets
    }

    #[test]
    fn a_position_that_stuck_while_the_joint_moved_stays_off() {
        let rate = |sample: usize| {
            if (50..150).contains(&sample) {
                0.5
            } else {
                0.0
            }
        };
        let way = |sample: usize| 0.005 * (sample.clamp(50, 150) - 50) as f64;
        let noise = |sample: usize| 1e-4 * (sample as f64 * 1.7).sin();
        let stuck = left_off(|sample| [noise(sample), rate(sample)]);
        assert!(
            stuck.len() == 1 && (stuck[0] + 0.5).abs() < 0.05,
            "{stuck:?}"
        );
        // until it is back where it should be
        let returns = left_off(|sample| {
            let shown = if sample < 400 { 0.0 } else { way(sample) };
            [shown + noise(sample), rate(sample)]
        });
        assert!(
            returns.len() == 2 && (returns[0] + returns[1]).abs() < 0.05,
            "{returns:?}"
        );
        // a velocity that is late has gone the same way in the end
        let late = left_off(|sample| [way(sample), rate(sample.saturating_sub(25))]);
        assert_eq!(late, [] as [f64; 0]);
    }

    /// Returns start and end (s) of the faults of positions every 10 ms; the start is the earliest that any sample reports.
    fn doubted(position: impl Fn(usize) -> f64) -> Option<(f64, f64)> {
        doubted_with(LIMITS, f64::NAN, position)
    }

    fn doubted_with(
        limits: JointLimits,
        rate: f64,
        position: impl Fn(usize) -> f64,
    ) -> Option<(f64, f64)> {
        let mut watch = JointWatch::new(limits, 25.0);
        let mut span: Option<(f64, f64)> = None;
        for sample in 0..200 {
            let stamp_ns = sample as i64 * 10_000_000;
            watch.check(
                stamp_ns,
                [position(sample), rate],
                false,
                &Limits::OF_TESTS,
                &mut |notice| {
                    let [since_s, now_s] = [notice.since_ns, stamp_ns].map(|ns| ns as f64 * 1e-9);
                    let first_s = span.map_or(since_s, |span| span.0.min(since_s));
                    span = Some((first_s, now_s));
                },
            );
        }
        span
    }

    #[test]
    fn a_first_position_that_the_next_ones_contradict_does_not_count() {
        let found = doubted(|sample| if sample == 0 { 0.7 } else { 0.1 });
        assert_eq!(found, Some((0.0, 0.01)));
    }

    #[test]
    fn a_spike_is_left_out_and_what_surrounds_it_stays() {
        let found = doubted(|sample| if (50..54).contains(&sample) { 0.9 } else { 0.1 });
        assert_eq!(found, Some((0.5, 0.53)));
    }

    #[test]
    fn after_a_jump_the_joint_is_believed_where_it_stays_and_no_motion_leads_there() {
        let found = doubted(|sample| if sample < 50 { 0.1 } else { 0.35 });
        let (first_s, last_s) = found.unwrap();
        assert_eq!(first_s, 0.5);
        let longest_gap_s = Limits::OF_TESTS.max_gap_s;
        assert!(last_s - first_s > longest_gap_s && last_s - first_s < 1.1 * longest_gap_s);
    }

    /// Returns the reported errors of the joint that last.
    fn offsets(position: impl Fn(usize) -> Option<f64>) -> Vec<f64> {
        let mut watch = JointWatch::new(LIMITS, 25.0);
        let mut offsets = Vec::new();
        for sample in 0..400 {
            let Some(position) = position(sample) else {
                continue;
            };
            let stamp_ns = sample as i64 * 10_000_000;
            let values = [position, f64::NAN];
            watch.check(stamp_ns, values, false, &Limits::OF_TESTS, &mut |notice| {
                if notice.kind == FaultKind::Contradiction {
                    offsets.push(notice.measure);
                }
            });
        }
        offsets
    }

    #[test]
    fn a_jump_that_stays_contradicts_what_was_before() {
        let jumps =
            |at: usize, by: f64| move |k: usize| Some(if k < at { 0.125 } else { 0.125 + by });
        assert_eq!(offsets(jumps(50, 0.5)), [0.5]);
        // and back
        let returns = |k: usize| Some(if (50..200).contains(&k) { 0.625 } else { 0.125 });
        assert_eq!(offsets(returns), [0.5, -0.5]);
        // a spike, zeros before the hardware is read, and a first sample that nothing confirms
        let spike = |k: usize| Some(if (50..54).contains(&k) { 0.9 } else { 0.1 });
        assert_eq!(offsets(spike), [] as [f64; 0]);
        assert_eq!(
            offsets(|k| Some(if k < 80 { 0.0 } else { 1.2 })),
            [] as [f64; 0]
        );
        assert_eq!(offsets(jumps(1, 0.7)), [] as [f64; 0]);
    }

    #[test]
    fn what_no_motion_reaches_in_a_gap_is_a_jump() {
        let hole = |by: f64| {
            move |k: usize| match k {
                0..50 => Some(0.125),
                50..150 => None,
                _ => Some(0.125 + by),
            }
        };
        // a second, at 1 rad/s
        assert_eq!(offsets(hole(0.9)), [] as [f64; 0]);
        assert_eq!(offsets(hole(2.0)), [2.0]);
    }

    #[test]
    fn a_jump_that_a_gap_follows_at_once_is_a_jump() {
        let slips = |gap: std::ops::Range<usize>, after: f64| {
            move |k: usize| match k {
                0..50 => Some(0.125),
                k if gap.contains(&k) => None,
                k => Some(if k < 100 { 1.625 } else { after }),
            }
        };
        // after a gap in which it could have moved anywhere, and after one in which it cannot have moved back
        assert_eq!(offsets(slips(55..350, 1.625)), [1.5]);
        assert_eq!(offsets(slips(55..100, 1.625)), [1.5]);
        assert_eq!(offsets(slips(55..100, 0.125)), [1.5, -1.5]);
        // one sample is none
        assert_eq!(offsets(slips(51..350, 0.125)), [] as [f64; 0]);
    }

    #[test]
    fn a_gap_after_one_sample_is_compared_with_what_was_confirmed_before() {
        let holes = |by: f64| {
            move |k: usize| match k {
                0..50 => Some(0.125),
                50..=79 | 81..=109 => None,
                _ => Some(0.125 + by),
            }
        };
        // 0.31 and 0.61 s at 1 rad/s
        assert_eq!(offsets(holes(0.55)), [] as [f64; 0]);
        assert_eq!(offsets(holes(1.5)), [1.5]);
    }

    #[test]
    fn zeros_after_a_gap_do_not_hide_where_it_was_before() {
        let zeros = |before: Option<f64>, after: f64| {
            move |k: usize| match k {
                0..50 => before,
                50..80 => None,
                80..140 => Some(0.0),
                _ => Some(after),
            }
        };
        assert_eq!(offsets(zeros(Some(0.5), 0.5)), [] as [f64; 0]);
        assert_eq!(offsets(zeros(Some(0.5), 2.5)), [2.0]);
        assert_eq!(offsets(zeros(None, 2.5)), [] as [f64; 0]);
        // one that really stands there
        assert_eq!(offsets(zeros(Some(0.2), 0.0)), [] as [f64; 0]);
    }

    /// Returns the reported errors of an encoder with noise that stands still between 2 and 4 s, and the index of the last faulty
    /// sample.
    fn freezes(after: f64) -> (Vec<f64>, usize) {
        let mut watch = JointWatch::new(LIMITS, 25.0);
        let (mut offsets, mut faulty) = (Vec::new(), 0);
        for sample in 0..600_usize {
            let noise = 1e-3 * ((sample as f64 * 12.9898).sin() * 43_758.545_3).fract();
            let position = match sample {
                0..200 => 0.5 + noise,
                200..400 => 0.5,
                _ => after + noise,
            };
            // another joint is read from 2 to 3.5 s
            let works = sample < 350;
            let stamp_ns = sample as i64 * 10_000_000;
            let values = [position, 0.0];
            watch.check(
                stamp_ns,
                values,
                works,
                &Limits::OF_TESTS,
                &mut |notice| match notice.kind {
                    FaultKind::Contradiction => offsets.push(notice.measure),
                    _ => faulty = faulty.max(sample),
                },
            );
        }
        (offsets, faulty)
    }

    #[test]
    fn what_froze_stays_faulty_until_it_is_measured_again_and_is_no_place_to_jump_from_or_to() {
        assert_eq!(freezes(0.5), (vec![], 399));
        // two seconds at 1 rad/s
        let (offsets, last) = freezes(2.0);
        assert!(offsets.is_empty() && last == 400, "{offsets:?} {last}");
        let (offsets, _) = freezes(3.5);
        assert!(offsets.len() == 1 && (offsets[0] - 3.0).abs() < 0.01);
    }

    /// An encoder that flickers, moves at `pace` from 4 s on, rests from sample `rests_from` on, and repeats itself in the
    /// samples `repeats`, of which none is sent in `hole`; `after`: the error of its positions afterwards.
    struct Repeats {
        pace: f64,
        rests_from: usize,
        repeats: std::ops::Range<usize>,
        hole: std::ops::Range<usize>,
        after: f64,
        every: usize,
        noise: f64,
    }

    const REPEATS: Repeats = Repeats {
        pace: 0.3,
        rests_from: 900,
        repeats: 500..800,
        hole: 0..0,
        after: 0.0,
        every: 1,
        noise: 1e-4,
    };

    impl Repeats {
        fn offsets(&self, limits: JointLimits) -> Vec<f64> {
            let is_at = |sample: usize| {
                self.pace * 0.01 * (sample.clamp(400, self.rests_from) - 400) as f64
            };
            let shown = |sample: usize| {
                let after = if sample < self.repeats.end {
                    0.0
                } else {
                    self.after
                };
                let read = match self.repeats.contains(&sample) {
                    true => self.repeats.start - 1,
                    false => sample / self.every * self.every,
                };
                let noise = self.noise * ((read as f64 * 12.9898).sin() * 43_758.545_3).fract();
                ((0.1 + is_at(read) + after + noise) / 1e-6).round() * 1e-6
            };
            let mut watch = JointWatch::new(limits, 25.0);
            let (mut offsets, mut has_frozen) = (Vec::new(), false);
            for sample in (0..1200).filter(|sample| !self.hole.contains(sample)) {
                let values = [shown(sample), f64::NAN];
                let stamp_ns = sample as i64 * 10_000_000;
                watch.check(
                    stamp_ns,
                    values,
                    true,
                    &Limits::OF_TESTS,
                    &mut |notice| match notice.kind {
                        FaultKind::Contradiction => offsets.push(notice.measure),
                        kind => has_frozen |= kind == FaultKind::Frozen,
                    },
                );
            }
            assert!(has_frozen);
            offsets
        }
    }

    #[test]
    fn what_froze_in_motion_and_goes_on_from_there_has_lost_counts() {
        let off = |of: Repeats, limits: JointLimits| of.offsets(limits);
        let is = |found: Vec<f64>, by: f64| {
            assert!(
                found.len() == 1 && (found[0] - by).abs() < 0.025,
                "{found:?} {by}"
            );
        };
        let lost = Repeats {
            after: -0.9,
            ..REPEATS
        };
        is(off(lost, LIMITS), -0.9);
        // a slow one that is read every fifth sample, and one that nobody hears of for a time
        let slow = Repeats {
            pace: 0.1,
            every: 5,
            after: -0.3,
            ..REPEATS
        };
        is(off(slow, LIMITS), -0.3);
        // before it is known that it has stopped, and after
        for hole in [530..570, 700..740] {
            let hole = Repeats {
                hole,
                after: -0.9,
                ..REPEATS
            };
            is(off(hole, LIMITS), -0.9);
        }
        // it cannot have gone beyond its limit, which is 0.2 further than where it froze
        let limits = JointLimits {
            range: Some([-1.0, 0.6]),
            ..LIMITS
        };
        let stopped = Repeats {
            rests_from: 566,
            after: -0.198,
            ..REPEATS
        };
        is(off(stopped, limits), -0.2);
    }

    #[test]
    fn what_froze_and_comes_back_or_rested_has_lost_nothing() {
        let off = |of: Repeats| of.offsets(LIMITS);
        assert_eq!(off(REPEATS), [] as [f64; 0], "an absolute one");
        // the last sample that moves is hardly older than the first that repeats
        for rests_from in [450, 480, 490, 495, 498] {
            let rests = Repeats {
                rests_from,
                ..REPEATS
            };
            assert_eq!(off(rests), [] as [f64; 0], "{rests_from}");
        }
        // noise is no motion
        for start in (500..700).step_by(4) {
            let rests = Repeats {
                pace: 0.0,
                noise: 1e-3,
                repeats: start..start + 400,
                ..REPEATS
            };
            assert_eq!(off(rests), [] as [f64; 0], "{start}");
        }
    }

    /// The velocity on the way back is no motion: it is derived from that step.
    #[test]
    fn an_absolute_encoder_that_comes_back_with_a_step_has_lost_nothing() {
        let fast = |max_velocity: f64| JointLimits {
            max_velocity,
            ..LIMITS
        };
        for (period_ns, limits, moves, repeats) in [
            (100_000_000, fast(2.0), 40..60, 57..75),
            (50_000_000, fast(3.0), 80..115, 110..150),
        ] {
            let period_s = period_ns as f64 * 1e-9;
            let shown = |sample: usize| {
                let read = match repeats.contains(&sample) {
                    true => repeats.start - 1,
                    false => sample,
                };
                let moved = (read.clamp(moves.start, moves.end) - moves.start) as f64;
                let noise = 1e-4 * ((read as f64 * 12.9898).sin() * 43_758.545_3).fract();
                0.3 * period_s * moved + noise
            };
            let mut watch = JointWatch::new(limits, 25.0);
            let mut kinds = Vec::new();
            for sample in 1..200 {
                let derived = (shown(sample) - shown(sample - 1)) / period_s;
                watch.check(
                    sample as i64 * period_ns,
                    [shown(sample), derived],
                    true,
                    &Limits::OF_TESTS,
                    &mut |notice| kinds.push(notice.kind),
                );
            }
            assert!(kinds.contains(&FaultKind::Frozen), "{period_ns}");
            assert!(!kinds.contains(&FaultKind::Contradiction), "{period_ns}");
        }
    }

    #[test]
    fn what_froze_in_a_session_before_is_faulty_until_it_changes() {
        let faulty = |position: fn(usize) -> f64| {
            let mut watch = JointWatch::new(LIMITS, 25.0);
            watch.remember_frozen(0.0);
            assert!(watch.is_frozen());
            let mut kinds = Vec::new();
            for sample in 0..50_usize {
                let values = [position(sample), 0.0];
                let stamp_ns = (100 + sample as i64) * 10_000_000;
                watch.check(stamp_ns, values, false, &Limits::OF_TESTS, &mut |notice| {
                    assert_eq!(
                        (notice.kind, notice.since_ns),
                        (FaultKind::Frozen, 1_000_000_000)
                    );
                    kinds.push(sample);
                });
            }
            (kinds.len(), watch.is_frozen())
        };
        assert_eq!(faulty(|_| 0.5), (49, true));
        assert_eq!(faulty(|sample| 0.5 + 1e-4 * sample as f64), (0, false));
        // wherever it has gone meanwhile
        assert_eq!(
            faulty(|sample| if sample < 30 { 0.5 } else { 0.51 }),
            (29, false)
        );
    }

    /// The duration of a freeze that began in an earlier session is unknown, so the joint may be off by anything.
    #[test]
    fn what_froze_in_motion_in_a_session_before_has_lost_counts_if_it_goes_on_from_there() {
        let offsets = |rate: f64, before: f64, step: f64| {
            let mut watch = JointWatch::new(LIMITS, 25.0);
            watch.remember_position(0, before);
            watch.remember_frozen(rate);
            let mut found = Vec::new();
            for sample in 0..80_usize {
                let gone = match sample {
                    0..30 => 0.0,
                    _ => step + 0.003 * (sample - 29) as f64,
                };
                let stamp_ns = (100 + sample as i64) * 10_000_000;
                let values = [0.5 + gone, f64::NAN];
                watch.check(stamp_ns, values, true, &Limits::OF_TESTS, &mut |notice| {
                    if notice.kind == FaultKind::Contradiction {
                        found.push([notice.measure.abs(), notice.amount.value]);
                    }
                });
            }
            assert_eq!(watch.frozen_rate(), None);
            found
        };
        let found = offsets(0.3, 0.5, 0.0);
        let [by, moved] = found[0];
        assert!(found.len() == 1 && by > 0.0 && by <= moved, "{found:?}");
        assert_eq!(offsets(0.0, 0.5, 0.0), [] as [[f64; 2]; 0], "it rested");
        assert_eq!(
            offsets(0.3, 0.5, 0.025),
            [] as [[f64; 2]; 0],
            "an absolute one"
        );
        assert_eq!(
            offsets(0.3, 0.4, 0.0),
            [] as [[f64; 2]; 0],
            "measured again"
        );
    }

    #[test]
    fn a_session_begins_where_the_one_before_ended() {
        let offset = |gone_s: i64, position: f64| {
            let mut watch = JointWatch::new(LIMITS, 25.0);
            watch.remember_position(-gone_s * 1_000_000_000, 0.5);
            let mut offset = None;
            for sample in 0..200_i64 {
                // zeros until the hardware is read
                let shown = if sample < 50 { 0.0 } else { position };
                watch.check(
                    sample * 10_000_000,
                    [shown, f64::NAN],
                    false,
                    &Limits::OF_TESTS,
                    &mut |notice| {
                        if notice.kind == FaultKind::Contradiction {
                            offset = Some(notice.measure);
                        }
                    },
                );
            }
            offset
        };
        assert_eq!(offset(1, 0.6), None);
        assert_eq!(offset(1, 3.5), Some(3.0));
        assert_eq!(offset(3, 3.5), None);
    }

    #[test]
    fn a_person_may_trust_it_before_it_is_known_whether_it_stays() {
        let mut watch = JointWatch::new(LIMITS, 25.0);
        let faulty = |watch: &mut JointWatch, sample: i64, position: f64| {
            let mut count = 0;
            let values = [position, f64::NAN];
            watch.check(
                sample * 10_000_000,
                values,
                false,
                &Limits::OF_TESTS,
                &mut |_| count += 1,
            );
            count > 0
        };
        (0..50).for_each(|sample| assert!(!faulty(&mut watch, sample, 0.125)));
        assert!(faulty(&mut watch, 50, 1.625));
        assert_eq!(watch.jump(), None, "one sample is none");
        assert!(faulty(&mut watch, 51, 1.625));
        assert_eq!(watch.jump().unwrap()[0], 1.5);
        watch.trust();
        assert_eq!(watch.jump(), None);
        (52..200).for_each(|sample| assert!(!faulty(&mut watch, sample, 1.625)));
    }

    #[test]
    fn zeros_until_the_hardware_is_read_do_not_count() {
        let (first_s, last_s) = doubted(|sample| if sample < 80 { 0.0 } else { 1.2 }).unwrap();
        assert!(first_s == 0.0 && last_s < 1.1, "{first_s} {last_s}");
    }

    #[test]
    fn joint_has_changed_once_a_motion_says_so() {
        let watched = |position: fn(usize) -> f64| {
            let mut watch = JointWatch::new(LIMITS, 25.0);
            for sample in 0..200 {
                let values = [position(sample), f64::NAN];
                let stamp_ns = sample as i64 * 10_000_000;
                watch.check(stamp_ns, values, false, &Limits::OF_TESTS, &mut |_| ());
            }
            watch
        };
        let has_left_zero = |position| {
            let watch = watched(position);
            assert!(watch.has_changed() || watch.is_at_zero());
            watch.has_changed()
        };
        assert!(!has_left_zero(|_| 0.0));
        assert!(!has_left_zero(|sample| if sample % 2 == 0 {
            0.0
        } else {
            -0.0
        }));
        assert!(!has_left_zero(|sample| if sample == 50 {
            0.9
        } else {
            0.0
        }));
        assert!(!has_left_zero(|sample| if sample == 50 {
            f64::NAN
        } else {
            0.0
        }));
        assert!(has_left_zero(|sample| if sample < 190 {
            0.0
        } else {
            1e-4
        }));
        assert!(has_left_zero(|sample| 0.01 * (100.0 - sample as f64)));
        // no motion: zeros until the hardware is read, a first sample that is wrong, and a constant
        for stands in [
            |sample: usize| if sample < 80 { 0.0 } else { 1.2 },
            |sample: usize| if sample == 0 { 0.7 } else { 1.2 },
            |_: usize| 1.2,
        ] {
            let watch = watched(stands);
            assert!(!watch.has_changed() && !watch.is_at_zero());
        }
    }

    /// A joint that rests, and then moves faster and faster, is read at every third message; `read_rate`: its velocity, too.
    #[test]
    fn an_encoder_that_is_read_less_often_than_it_is_sent_does_not_jump() {
        const PERIOD_S: f64 = 0.02;
        let limits = JointLimits {
            max_velocity: 4.0,
            max_acceleration: 5.0,
            ..LIMITS
        };
        let found = |read_rate: bool, jumps: f64| {
            let mut watch = JointWatch::new(limits, 25.0);
            let mut found = Vec::new();
            for sample in 1..300_usize {
                let read = sample / 3 * 3;
                let rate_at = |sample: usize| 0.03 * (sample.max(200) - 200) as f64;
                let moved = 0.5 * PERIOD_S * rate_at(read) * (read.max(200) - 200) as f64;
                let noise = 1e-4 * ((read as f64 * 12.9898).sin() * 43_758.545_3).fract();
                let offset = if read > 150 { jumps } else { 0.0 };
                let rate = rate_at(if read_rate { read } else { sample });
                let stamp_ns = (sample as f64 * PERIOD_S * 1e9) as i64;
                watch.check(
                    stamp_ns,
                    [moved + noise + offset, rate],
                    true,
                    &Limits::OF_TESTS,
                    &mut |notice| found.push(notice.kind),
                );
            }
            found
        };
        for read_rate in [true, false] {
            let sound = found(read_rate, 0.0);
            assert!(sound.is_empty(), "{read_rate}: {sound:?}");
            assert!(found(read_rate, 0.35).contains(&FaultKind::Contradiction));
        }
    }

    #[test]
    fn a_jump_that_the_velocities_do_not_show_is_one_of_the_position() {
        let jumps = |sample: usize| if sample < 50 { 0.1 } else { 0.16 };
        let fast = JointLimits {
            max_velocity: 20.0,
            ..LIMITS
        };
        // without velocities it is a step, which costs one sample
        assert_eq!(doubted_with(fast, f64::NAN, jumps), Some((0.5, 0.5)));
        let (first_s, last_s) = doubted_with(fast, 0.0, jumps).unwrap();
        assert!(first_s == 0.5 && last_s < 0.8, "{first_s} {last_s}");
    }

    #[test]
    fn motion_at_the_largest_velocity_is_credible() {
        assert_eq!(doubted(|sample| 0.01 * sample as f64), None);
        assert_eq!(doubted(|_| 0.0), None);
    }
}
