//! Time until a wheel lifts off, extrapolated from the present rate of change of its load.
//!
//! ```text
//!     t = OTF / -(dOTF/dt),   for the wheel with the smallest t
//! ```
//! The OTF, as fractions of the static loads, are filtered by the same Kalman filter as every signal. The
//! extrapolation is linear: if the load falls at an increasing rate, the wheel lifts sooner. Rates within the
//! noise give no forecast, and a forecast is announced only at a level that says that a wheel has lost load
//! ([`Level::announces_lift_off`](super::Level::announces_lift_off)): far from the limit, the rate says nothing
//! about where the motion will end.

use crate::estimation::{Doubt, FilterModel, KalmanFilter};
use crate::machine::Machine;

/// Standard deviation of the OTF due to noise, as a fraction of the static load.
const NOISE: f64 = 0.003;
/// Process noise: standard deviation of the change of its second derivative in one second (1/s^2).
const PROCESS_NOISE: f64 = 10.0;
/// Forecast horizon (s).
const HORIZON_S: f64 = 5.0;
/// Number of standard deviations by which a rate must differ from zero.
const SURE: f64 = 3.0;
/// Time over which the deviations of the OTF from the filter are averaged (s).
const AVERAGED_S: f64 = 1.0;

/// The wheel predicted to lift next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiftOff {
    /// Index of the wheel.
    pub wheel: usize,
    /// Time until lift-off (s); zero if it has lifted.
    pub in_s: f64,
}

/// Forecasts lift-off from the OTF of all wheels.
#[derive(Debug, Clone)]
pub struct LiftOffForecast {
    filter: KalmanFilter,
    shares: Vec<f64>,
    /// Mean square of the deviations of the shares from the filter, by wheel.
    mean_squares: Vec<f64>,
    before_ns: Option<i64>,
}

impl LiftOffForecast {
    /// A forecast before its first row.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        let wheels = machine.wheels().len();
        let model = FilterModel {
            value_variance: NOISE * NOISE,
            rate_variance: 0.0,
            density: PROCESS_NOISE * PROCESS_NOISE,
            max_gap_ns: (machine.estimator().max_gap * 1e9) as i64,
        };
        Self {
            filter: KalmanFilter::new(model, wheels, false),
            shares: vec![f64::NAN; wheels],
            mean_squares: vec![NOISE * NOISE; wheels],
            before_ns: None,
        }
    }

    /// Updates with the OTF of a valid row (N); `None` if no wheel is predicted to lift within five seconds or
    /// nothing is known. Does not allocate.
    pub fn row(&mut self, machine: &Machine, time_ns: i64, otf: &[f64]) -> Option<LiftOff> {
        let static_loads = &machine.reference().static_load;
        for ((share, &otf), &load) in self.shares.iter_mut().zip(otf).zip(static_loads) {
            *share = otf / load;
        }
        self.filter
            .push(time_ns, &self.shares, None, Doubt::default())
            .ok()?;
        let elapsed_s = (self.before_ns).map_or(0.0, |before| {
            time_ns.saturating_sub(before).max(0) as f64 * 1e-9
        });
        self.before_ns = Some(time_ns);
        let renewed = elapsed_s / (elapsed_s + AVERAGED_S);
        let rate_sigma = self.filter.covariance_at(time_ns)[1][1].max(0.0).sqrt();
        let mut next: Option<LiftOff> = None;
        for (wheel, &share) in self.shares.iter().enumerate() {
            let [filtered, rate, _] = self.filter.at(wheel, time_ns);
            // What the filter leaves is noise. Where it is larger than stated, so is the doubt in the rate.
            let mean_square = &mut self.mean_squares[wheel];
            *mean_square += renewed * ((share - filtered).powi(2) - *mean_square);
            let doubt = SURE * rate_sigma * (mean_square.sqrt() / NOISE).max(1.0);
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
