//! Motion of one joint, as measured and in the form that the kinematics uses.

use crate::number::Real;

/// Position, velocity and acceleration of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<T> {
    /// Position (rad or m).
    pub position: T,
    /// Velocity (rad/s or m/s).
    pub rate: T,
    /// Acceleration (rad/s^2 or m/s^2).
    pub acceleration: T,
}

impl<T: Real> Motion<T> {
    /// Returns the motion at rest at position zero.
    #[must_use]
    pub fn zero() -> Self {
        Self::at_rest(T::zero())
    }

    /// Returns the motion at rest at a position.
    #[must_use]
    pub fn at_rest(position: T) -> Self {
        let (rate, acceleration) = (T::zero(), T::zero());
        Self {
            position,
            rate,
            acceleration,
        }
    }

    /// Returns the motion in another number type.
    pub fn map<U>(&self, convert: impl Fn(T) -> U) -> Motion<U> {
        Motion {
            position: convert(self.position),
            rate: convert(self.rate),
            acceleration: convert(self.acceleration),
        }
    }

    /// Motion of a joint coupled to this one: `multiplier * this + offset`.
    pub fn scaled(&self, multiplier: f64, offset: f64) -> Self {
        let factor = T::constant(multiplier);
        Self {
            position: self.position * factor + T::constant(offset),
            rate: self.rate * factor,
            acceleration: self.acceleration * factor,
        }
    }
}

/// A joint coordinate for the kinematics: cosine and sine of an angle, or a displacement.
#[derive(Debug, Clone, Copy)]
pub struct Coordinate<T> {
    /// Cosine of the turn; 1 where the joint slides.
    pub cos: T,
    /// Sine of the turn; 0 where the joint slides.
    pub sin: T,
    /// Displacement (m); 0 where the joint turns.
    pub displacement: T,
    /// Velocity (rad/s or m/s).
    pub rate: T,
    /// Acceleration (rad/s^2 or m/s^2).
    pub acceleration: T,
}

impl<T: Real> Coordinate<T> {
    /// Returns the coordinate of a joint that turns.
    pub fn turned(cos: T, sin: T, rate: T, acceleration: T) -> Self {
        Self {
            cos,
            sin,
            displacement: T::zero(),
            rate,
            acceleration,
        }
    }

    /// Returns the coordinate in another number type.
    pub fn map<U>(&self, convert: impl Fn(T) -> U) -> Coordinate<U> {
        Coordinate {
            cos: convert(self.cos),
            sin: convert(self.sin),
            displacement: convert(self.displacement),
            rate: convert(self.rate),
            acceleration: convert(self.acceleration),
        }
    }

    /// Returns the coordinate of a joint that slides.
    pub fn slid(displacement: T, rate: T, acceleration: T) -> Self {
        Self {
            cos: T::one(),
            sin: T::zero(),
            displacement,
            rate,
            acceleration,
        }
    }
}
