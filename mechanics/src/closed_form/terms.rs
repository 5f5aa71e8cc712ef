//! The terms zeta of every wheel's load, (61)-(108).

use super::{DemandContributions, Platform};
use crate::number::Real;

/// zeta_1 to zeta_11 of (65)-(108) by wheel, for any roll moment distribution and half tracks (N); the wheels by
/// [`Corner`](super::Corner), FL FR RR RL.
///
/// The terms: weights; the arm's f_x, f_y, f_z, m_x, m_y; derivatives of v_x and v_y; turning at speed; yaw rate squared; yaw
/// acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Terms<T> {
    /// The terms of each wheel.
    pub wheel: [[T; 11]; 4],
}

impl<T: Real> Terms<T> {
    /// (61)-(64): the signed loads FL FR RR RL, the overturning forces OTF of (109) (N).
    #[must_use]
    pub fn loads(&self) -> [T; 4] {
        self.wheel
            .map(|terms| terms.into_iter().fold(T::zero(), |sum, term| sum + term))
    }
}

impl<T: Real> DemandContributions<T> {
    /// The eleven terms of every wheel. For a measured motion, the seventh and eighth include the paper's ninth.
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
        let loads = demands.map(|demand| demand.loads(platform));
        Terms {
            wheel: std::array::from_fn(|wheel| loads.map(|loads| loads[wheel])),
        }
    }
}
