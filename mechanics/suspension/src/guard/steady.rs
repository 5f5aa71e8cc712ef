//! The motion of the ground under the machine without its swing.
//!
//! A platform on tyres and oil swings, and its IMU measures that. A control that took each swing for a motion that lasts
//! would move the rods in step with it, and feed it. So the rods are guided by the mean of the motion:
//!
//! ```text
//!     S(18)  df_s/dt = (f - f_s)/T,   likewise w and w'            at the contact plane, T = 1 s
//!     S(19)  swing = max(swing exp(-dt/T_s), |N_lock(f) - N_lock(f_s)|)                            by wheel, T_s = 2 s
//! ```
//! The swing is a doubt of every forecast, S(17): after a shock, or while the platform swings, the wheels have less to spare.

use tipwatch_mechanics::state::ImuState;

use super::by_wheel::ByWheel;

/// T (s).
const MEAN_S: f64 = 1.0;
/// T_s (s).
const SWING_S: f64 = 2.0;
/// Time in which a sudden acceleration is forgotten (s).
const FORGET_S: f64 = 30.0;

/// S(18) and S(19).
#[derive(Debug, Clone, Copy)]
pub(super) struct Steady {
    motion: Option<ImuState<f64>>,
    /// (N)
    swing: ByWheel,
    /// The largest horizontal acceleration that was not in the mean, forgotten within half a minute (m/s^2).
    shock: f64,
}

impl Steady {
    pub(super) const UNKNOWN: Self = Self {
        motion: None,
        swing: [0.0; tipwatch_mechanics::machine::MAX_WHEELS],
        shock: 0.0,
    };

    /// The mean motion, `seconds` after the last one.
    pub(super) fn see(&mut self, measured: &ImuState<f64>, seconds: f64) -> ImuState<f64> {
        let known = |motion: &ImuState<f64>| {
            let parts = [
                &motion.specific_force,
                &motion.angular_velocity,
                &motion.angular_acceleration,
            ];
            parts.iter().all(|part| part.iter().all(|x| x.is_finite()))
        };
        let mean = match self.motion {
            Some(before) if known(&before) && known(measured) => {
                let share = 1.0 - libm::exp(-seconds / MEAN_S);
                ImuState {
                    specific_force: before.specific_force
                        + (measured.specific_force - before.specific_force) * share,
                    angular_velocity: before.angular_velocity
                        + (measured.angular_velocity - before.angular_velocity) * share,
                    angular_acceleration: before.angular_acceleration
                        + (measured.angular_acceleration - before.angular_acceleration) * share,
                }
            }
            _ => *measured,
        };
        self.motion = Some(mean);
        let sudden = (measured.specific_force - mean.specific_force).xy().amax();
        self.shock = (self.shock * (1.0 - seconds / FORGET_S).max(0.0)).max(sudden);
        mean
    }

    /// S(19) for the loads of locked rods by the measured and by the mean motion (N).
    pub(super) fn see_loads(&mut self, measured: &ByWheel, mean: &ByWheel, seconds: f64) {
        let fading = libm::exp(-seconds / SWING_S);
        for ((swing, measured), mean) in self.swing.iter_mut().zip(measured).zip(mean) {
            *swing = (*swing * fading).max((measured - mean).abs());
        }
    }

    /// The largest sudden acceleration (m/s^2).
    pub(super) fn shock(&self) -> f64 {
        self.shock
    }

    /// The swing by wheel (N).
    pub(super) fn swing(&self) -> &ByWheel {
        &self.swing
    }
}
