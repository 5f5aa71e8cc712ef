//! How long until a wheel lifts, if its load goes on falling as it does now.
//!
//! ```text
//!     t = OTF / -(dOTF/dt),   of the wheel for which that is least
//! ```
//! with the OTF, as shares of the static loads, followed by the same filter as every signal. It is an
//! extrapolation by the present rate alone: a load that falls faster and faster lifts sooner. Nothing is
//! said of a rate that may be noise.

use crate::estimation::{Doubt, Model, Track};
use crate::machine::Machine;

/// Standard deviation of an OTF by noise, as a share of the static load.
const NOISE: f64 = 0.003;
/// Standard deviation of the change of its second derivative in one second, in shares (1/s^2).
const AGILITY: f64 = 10.0;
/// Further ahead nothing is said (s).
const HORIZON_S: f64 = 5.0;
/// A rate counts where it is so many of its standard deviations from zero.
const SURE: f64 = 2.0;

/// The wheel that lifts next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiftOff {
    /// Its index.
    pub wheel: usize,
    /// When (s from now); zero where it has lifted.
    pub in_s: f64,
}

/// Follows the OTF of all wheels.
#[derive(Debug, Clone)]
pub struct LiftOffForecast {
    track: Track,
    shares: Vec<f64>,
}

impl LiftOffForecast {
    /// A forecast that has seen nothing.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        let wheels = machine.wheels().len();
        let model = Model {
            value_variance: NOISE * NOISE,
            rate_variance: 0.0,
            density: AGILITY * AGILITY,
            max_gap_ns: (machine.estimator().max_gap * 1e9) as i64,
        };
        Self {
            track: Track::new(model, wheels, false),
            shares: vec![f64::NAN; wheels],
        }
    }

    /// Takes the OTF of a valid row (N); `None` where no wheel lifts within five seconds, and where
    /// nothing is known. Allocates nothing.
    pub fn row(&mut self, machine: &Machine, time_ns: i64, otf: &[f64]) -> Option<LiftOff> {
        let static_loads = &machine.reference().static_load;
        for ((share, &otf), &load) in self.shares.iter_mut().zip(otf).zip(static_loads) {
            *share = otf / load;
        }
        self.track
            .push(time_ns, &self.shares, None, Doubt::default())
            .ok()?;
        let doubt = SURE * self.track.covariance_at(time_ns)[1][1].max(0.0).sqrt();
        let mut next: Option<LiftOff> = None;
        for (wheel, &share) in self.shares.iter().enumerate() {
            let [_, rate, _] = self.track.at(wheel, time_ns);
            let in_s = if share <= 0.0 { 0.0 } else { -share / rate };
            let is_falling = share <= 0.0 || rate < -doubt;
            let is_ahead = is_falling && (0.0..=HORIZON_S).contains(&in_s);
            if is_ahead && next.is_none_or(|next| in_s < next.in_s) {
                next = Some(LiftOff { wheel, in_s });
            }
        }
        next
    }
}
