//! The terms zeta of every wheel's load, (61)-(108).

use super::{Demand, DemandContributions, Platform};
use crate::number::Real;

/// Loads by wheel and contribution (N); the wheels by [`Corner`](super::Corner), FL FR RR RL.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TermTable<T, const N: usize> {
    /// The terms of each wheel.
    pub wheel: [[T; N]; 4],
}

/// zeta_1 to zeta_11 of (65)-(108), for any roll moment distribution and half tracks (N): weights; the arm's
/// f_x, f_y, f_z, m_x, m_y; derivatives of v_x and v_y; turning at speed; yaw rate squared; yaw acceleration.
pub type Terms<T> = TermTable<T, 11>;

/// The terms that a [`MeasuredMotion`](super::MeasuredMotion) can separate (N): wheel weights, a part of zeta_1;
/// zeta_2 to zeta_6; chassis weight and acceleration, the rest of zeta_1 with zeta_7 to zeta_9; zeta_10;
/// zeta_11.
pub type MeasuredTerms<T> = TermTable<T, 9>;

impl<T: Real, const N: usize> TermTable<T, N> {
    fn of(demands: &[Demand<T>; N], platform: &Platform<T>) -> Self {
        let loads = demands.each_ref().map(|demand| demand.loads(platform));
        let of_wheel = |wheel| std::array::from_fn(|term| loads[term][wheel]);
        Self {
            wheel: std::array::from_fn(of_wheel),
        }
    }

    /// (61)-(64): the signed loads FL FR RR RL, the overturning forces OTF of (109) (N).
    #[must_use]
    pub fn loads(&self) -> [T; 4] {
        self.wheel
            .map(|terms| terms.into_iter().fold(T::zero(), |sum, term| sum + term))
    }
}

impl<T: Real> DemandContributions<T> {
    /// The eleven terms of every wheel. For a measured motion, the seventh and eighth include the paper's ninth:
    /// see [`DemandContributions::measured_terms`].
    #[must_use]
    pub fn terms(&self, platform: &Platform<T>) -> Terms<T> {
        let weights = self.chassis_weight.plus(&self.wheel_weights);
        let ([f_x, f_y, f_z, m_x, m_y], [forward, sideways, turning]) =
            (self.arm, self.acceleration);
        let [rate, acceleration] = self.yaw;
        let demands = [
            weights,
            f_x,
            f_y,
            f_z,
            m_x,
            m_y,
            forward,
            sideways,
            turning,
            rate,
            acceleration,
        ];
        Terms::of(&demands, platform)
    }

    /// The terms of every wheel that an accelerometer can separate; those of a motion given by velocities are
    /// merged in the same way.
    #[must_use]
    pub fn measured_terms(&self, platform: &Platform<T>) -> MeasuredTerms<T> {
        let chassis = self.chassis_weight.plus(&Demand::sum(&self.acceleration));
        let [f_x, f_y, f_z, m_x, m_y] = self.arm;
        let [rate, acceleration] = self.yaw;
        let wheels = self.wheel_weights;
        let demands = [wheels, f_x, f_y, f_z, m_x, m_y, chassis, rate, acceleration];
        MeasuredTerms::of(&demands, platform)
    }
}
