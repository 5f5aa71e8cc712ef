//! Plausibility checks of a joint: position, velocity, and their consistency.

use super::fault::Component;
use super::flicker::Flicker;
use super::notice::{Found, Limits, Notice};
use super::outliers::Outliers;
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

/// State of the checks of one joint.
#[derive(Debug, Clone)]
pub(super) struct JointWatch {
    pub(super) limits: JointLimits,
    /// The last credible position, and whether another one agreed with it: the first one is as likely to be wrong.
    good: Option<Held>,
    is_confirmed: bool,
    /// Where the joint is since it cannot have moved there.
    jump: Option<Jump>,
    /// Where it was before a gap, until another sample has confirmed where it is now.
    before_gap: Option<Held>,
    /// Since when the position has been exactly zero without a break: as before the hardware is read.
    zero_since_ns: Option<i64>,
    /// Whether a credible position, that another one agreed with, was not exactly zero.
    has_left_zero: bool,
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
    outliers: Outliers<1>,
    rate_outliers: Outliers<1>,
}

/// Positions that the joint cannot have reached, each of which agrees with the one before.
#[derive(Debug, Clone, Copy)]
struct Jump {
    since_ns: i64,
    /// How far it jumped, and what of it may be motion.
    by: f64,
    moved: f64,
    last: Held,
}

/// A sample of the joint.
#[derive(Debug, Clone, Copy)]
struct Held {
    stamp_ns: i64,
    position: f64,
    /// NaN if it was not measured.
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
    /// The same without fading, since they last agreed, and whether there was a fault since then.
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
            outliers: Outliers::new(2.0 * POSITION_ALLOWANCE),
            rate_outliers: Outliers::new(harmless_rate),
            good: None,
            is_confirmed: false,
            jump: None,
            before_gap: None,
            zero_since_ns: None,
            has_left_zero: false,
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

    /// Whether the joint has ever been elsewhere than at exactly zero, where an encoder is that nobody reads.
    pub(super) fn has_left_zero(&self) -> bool {
        self.has_left_zero
    }

    /// By how much the joint has jumped, and what of it may be motion, where at least two samples say so and nobody knows yet
    /// whether it stays; `None` without a jump. What a jump begins with, zeros before the hardware is read, does not count.
    pub(super) fn jump(&self) -> Option<[f64; 2]> {
        let jump = (self.jump).filter(|jump| jump.last.stamp_ns > jump.since_ns)?;
        self.zero_since_ns
            .is_none()
            .then_some([jump.by, jump.moved])
    }

    /// A person trusts the joint where it is now.
    pub(super) fn trust(&mut self) {
        if let Some(jump) = self.jump.take() {
            self.good = Some(jump.last);
            self.forget_motion(jump.last.stamp_ns);
        }
        self.before_gap = None;
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
        let is_credible =
            self.check_step(here, limits, found) && self.check_outlier(here, limits, found);
        self.has_left_zero |= is_credible && self.is_confirmed && position != 0.0;
        let rate = if rate.is_finite() && self.check_rate(stamp_ns, rate, limits, found) {
            rate
        } else {
            f64::NAN
        };
        if is_credible && !self.check_agreement(stamp_ns, position, rate, limits, found) {
            self.check_flicker(stamp_ns, position, works, limits, found);
        }
    }

    /// Checks whether a position without a velocity is an outlier; with one, [`Self::check_step`] finds that.
    fn check_outlier(&mut self, here: Held, limits: &Limits, found: &mut Found<'_>) -> bool {
        if self.limits.spins_wheel || here.rate.is_finite() {
            return true;
        }
        let step_s = self.period_s.min(limits.max_gap_s);
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
        let rests = !self.moves;
        let stopped = (self.flicker).stopped_ns(stamp_ns, position, rests, works, limits);
        if let Some(since_ns) = stopped {
            // where it froze is no place from which it could reach another
            self.is_confirmed = false;
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
            self.before_gap = self.good.take().filter(|_| is_known);
            self.jump = None;
            self.forget_motion(stamp_ns);
        } else {
            self.period_s += 0.1 * (step_s - self.period_s);
        }
    }

    /// No motion leads to what follows.
    fn forget_motion(&mut self, stamp_ns: i64) {
        (self.good_rate, self.last) = (None, None);
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
            if let Some(before) = self.before_gap.take() {
                let moved = self.farthest(before, good, limits);
                let by = self.step(before.position, good.position);
                if by.abs() > moved {
                    found(Notice::offset(good.stamp_ns, by, moved));
                }
            }
            self.zero_since_ns = self.zero_since_ns.filter(|_| position == 0.0);
            return true;
        }
        let elapsed_s = limits.elapsed_s(good.stamp_ns, stamp_ns).max(self.period_s);
        let step = self.step(good.position, position).abs();
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
            by: self.step(good.position, position),
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
                // zeros before the hardware is read are wrong, and not what follows
                if self.zero_since_ns.is_none() {
                    found(Notice::offset(jump_ns, jump.by, jump.moved));
                }
                (self.good, self.jump, self.zero_since_ns) = (Some(here), None, None);
                self.forget_motion(stamp_ns);
            }
        }
        false
    }

    /// How far it can have moved (rad or m).
    fn farthest(&self, from: Held, to: Held, limits: &Limits) -> f64 {
        let elapsed_s = limits
            .elapsed_s(from.stamp_ns, to.stamp_ns)
            .max(self.period_s);
        self.limits.max_velocity * elapsed_s + 2.0 * POSITION_ALLOWANCE
    }

    /// How far it moved by its velocities; without them, what they allow beside none.
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
    /// An error of the velocities shows over many samples, a position that jumps in one.
    fn can_reach(&self, from: Held, to: Held, limits: &Limits) -> bool {
        let elapsed_s = limits
            .elapsed_s(from.stamp_ns, to.stamp_ns)
            .max(self.period_s);
        let step = self.step(from.position, to.position);
        let allowance = 2.0 * POSITION_ALLOWANCE;
        if step.abs() > self.farthest(from, to, limits) {
            return false;
        }
        let mean = 0.5 * (from.rate + to.rate);
        let largest = from.rate.abs().max(to.rate.abs());
        let tolerance = self.limits.rate_tolerance + limits.rate_tolerance_share * largest;
        let between = 0.25 * self.limits.max_acceleration * elapsed_s * elapsed_s;
        let is_apart =
            (step - mean * elapsed_s).abs() > between + tolerance * elapsed_s + allowance;
        // without velocities nothing is apart
        !is_apart
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
            let elapsed_s = limits.elapsed_s(good_ns, stamp_ns).max(self.period_s);
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

    /// Returns whether it reported something. `rate` is NaN if the message has none.
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
        let step = self.step(last_position, position);
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
        // where it froze is no place from which it could reach another
        self.is_confirmed &= !is_frozen;
        let notice = match is_frozen {
            true => {
                let since_ns = it.quiet_ns.max(self.run_since_ns);
                Notice::of(FaultKind::Frozen, since_ns)
                    .measured(limits.elapsed_s(since_ns, stamp_ns), f64::NAN)
                    .amount(it.since_quiet.abs(), it.difference.abs())
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

    /// Difference between two positions; for a joint without limits the shorter way round.
    fn step(&self, from: f64, to: f64) -> f64 {
        match self.limits.wraps {
            true => shorter_way(to - from),
            false => to - from,
        }
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

    /// By how much a joint is off, that moves from 0.5 to 1.5 s: what its positions and velocities show, by the sample.
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

    /// From when to when (s) positions every 10 ms are in doubt, each with what its sample says of earlier ones.
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

    /// By how much the joint is off for good.
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
    fn joint_has_left_zero_once_two_positions_say_so() {
        let has_left_zero = |position: fn(usize) -> f64| {
            let mut watch = JointWatch::new(LIMITS, 25.0);
            for sample in 0..200 {
                let values = [position(sample), f64::NAN];
                let stamp_ns = sample as i64 * 10_000_000;
                watch.check(stamp_ns, values, false, &Limits::OF_TESTS, &mut |_| ());
            }
            watch.has_left_zero()
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
        assert!(has_left_zero(|sample| if sample < 80 { 0.0 } else { 1.2 }));
        assert!(has_left_zero(|sample| 0.01 * (100.0 - sample as f64)));
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
