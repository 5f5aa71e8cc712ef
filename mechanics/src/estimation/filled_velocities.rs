//! Velocities of joints that nobody measures: a driver without them fills its messages with zeros.

use super::turns::shorter_way;

/// Distance (rad or m), beyond two of its largest steps, from which on a joint has moved: farther than noise and resolution of a
/// position, and no encoder that jumped.
const MOVED: f64 = 0.01;

/// Tells velocities that a driver fills in from those of a joint that rests: the position moves on while the velocity has never
/// been other than exactly zero.
///
/// A joint that has not moved has no velocity, whoever says so. From the sample on that shows the motion NaN takes the place
/// of the zeros, as of any velocity that is not measured. One that is not zero shows that it is measured after all.
#[derive(Debug, Clone)]
pub struct FilledVelocities {
    joints: Vec<Zeros>,
    /// Number of joints whose velocity is not known to be measured.
    open: usize,
}

/// A joint whose velocity has always been exactly zero so far.
#[derive(Debug, Clone, Copy, Default)]
struct Zeros {
    is_measured: bool,
    is_filled: bool,
    last: Option<f64>,
    /// Way since the first position (rad or m), its least and greatest, and the largest step.
    way: f64,
    least: f64,
    greatest: f64,
    largest_step: f64,
}

impl FilledVelocities {
    /// Creates the filling of a stream of so many joints, before its first sample.
    #[must_use]
    pub fn new(joints: usize) -> Self {
        Self {
            joints: vec![Zeros::default(); joints],
            open: joints,
        }
    }

    /// Takes the values of the next sample, positions and then velocities, and replaces velocities that are not measured by NaN.
    #[inline]
    pub fn mark(&mut self, values: &mut [f64]) {
        if self.open > 0 {
            self.mark_open(values);
        }
    }

    fn mark_open(&mut self, values: &mut [f64]) {
        let (positions, velocities) = values.split_at_mut(values.len() / 2);
        let values = positions.iter().zip(velocities);
        for (joint, (position, velocity)) in self.joints.iter_mut().zip(values) {
            if joint.is_measured {
                continue;
            }
            if velocity.is_finite() && *velocity != 0.0 {
                joint.is_measured = true;
                self.open -= 1;
                continue;
            }
            // where no velocity is stated, nothing is filled in
            if *velocity == 0.0 {
                joint.take(*position);
            }
            if joint.is_filled {
                *velocity = f64::NAN;
            }
        }
    }

    /// Whether every velocity is measured: nothing is replaced any more.
    #[must_use]
    pub fn are_all_measured(&self) -> bool {
        self.open == 0
    }

    /// Returns the filling of some joints of the stream, by their places.
    #[must_use]
    pub fn of(&self, places: &[usize]) -> Self {
        let joints: Vec<Zeros> = places.iter().map(|&place| self.joints[place]).collect();
        let open = joints.iter().filter(|joint| !joint.is_measured).count();
        Self { joints, open }
    }

    /// The joints whose velocity is filled in, by their place in the stream.
    pub fn filled(&self) -> impl Iterator<Item = usize> {
        let joints = self.joints.iter().enumerate();
        joints
            .filter(|(_, joint)| joint.is_filled && !joint.is_measured)
            .map(|(place, _)| place)
    }
}

impl Zeros {
    fn take(&mut self, position: f64) {
        if self.is_filled || !position.is_finite() {
            return;
        }
        let last = self.last.replace(position);
        let step = last.map_or(0.0, |last| shorter_way(position - last));
        self.way += step;
        self.least = self.least.min(self.way);
        self.greatest = self.greatest.max(self.way);
        self.largest_step = self.largest_step.max(step.abs());
        self.is_filled = self.greatest - self.least > MOVED + 2.0 * self.largest_step;
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// The samples from which on the velocity of one joint is not measured, of 200.
    fn marked(position: impl Fn(usize) -> f64, velocity: impl Fn(usize) -> f64) -> Vec<usize> {
        let mut filled = FilledVelocities::new(1);
        let is_marked = |sample: &usize| {
            let mut values = [position(*sample), velocity(*sample)];
            filled.mark(&mut values);
            values[1].is_nan()
        };
        (0..200).filter(is_marked).collect()
    }

    #[test]
    fn zeros_of_a_joint_that_moves_are_no_velocity() {
        let moves = |sample: usize| 0.002 * sample.saturating_sub(50) as f64;
        let found = marked(moves, |_| 0.0);
        assert_eq!(found, (58..200).collect::<Vec<_>>());
        // the position of a wheel that begins anew
        let turns = |sample: usize| (0.3 * sample as f64) % TAU;
        assert_eq!(marked(turns, |_| 0.0)[0], 3);
    }

    #[test]
    fn velocities_that_nobody_states_are_not_filled_in() {
        for velocity in [0.0, f64::NAN] {
            let mut filled = FilledVelocities::new(1);
            (0..200).for_each(|sample| filled.mark(&mut [0.01 * f64::from(sample), velocity]));
            assert_eq!(filled.filled().count(), usize::from(velocity == 0.0));
        }
    }

    #[test]
    fn a_joint_that_rests_has_no_velocity() {
        let noise = |sample: usize| 0.004 * (sample as f64 * 1.7).sin();
        assert_eq!(marked(noise, |_| 0.0), [] as [usize; 0]);
        // an encoder that jumps, and one that comes back
        let jumps = |sample: usize| if (50..90).contains(&sample) { 0.7 } else { 0.1 };
        assert_eq!(marked(jumps, |_| 0.0), [] as [usize; 0]);
        assert_eq!(marked(|_| f64::NAN, |_| 0.0), [] as [usize; 0]);
    }

    #[test]
    fn a_velocity_that_is_not_zero_is_measured() {
        let moves = |sample: usize| 0.002 * sample as f64;
        let begins = |at: usize| move |sample: usize| if sample < at { 0.0 } else { 0.2 };
        assert_eq!(marked(moves, begins(5)), [] as [usize; 0]);
        // and all of them from then on
        let stops = |sample: usize| if sample == 20 { 0.2 } else { 0.0 };
        assert_eq!(marked(moves, stops), (8..20).collect::<Vec<_>>());
        assert_eq!(marked(moves, |_| -0.0).len(), 192);
    }
}
