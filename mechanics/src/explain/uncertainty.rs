//! Standard deviations of the loads, to first order, from the stated uncertainty of parameters and the
//! noise of the signals.
//!
//! ```text
//!     var N = sum over parameters (dN/dp sigma_p)^2 + sum over signals g' P g + (model share * mean load)^2
//!             + what the measured torques leave undetermined of the load split, A(3)
//!             + (sum over free joints of dN/dtorque s)^2, s of side forces by T(14a)
//! ```
//! where g are the derivatives with respect to value, velocity and acceleration of a signal, and P is their
//! covariance from the estimator. Parameters are treated as independent, except for the elements of one
//! link's inertia tensor, which share one factor, and for parameters that were identified together, whose joint
//! covariance [`Identified`](crate::machine::Identified) states.

use std::ops::Range;

use crate::explain::sensitivity::GroupDerivatives;
use crate::machine::{
    Identified, InertiaElement, MAX_WHEELS, Machine, Parameter, Payload, Unknown,
};
use crate::number::{Real, SURE_SIGMAS, Wheels};
use crate::state::State;

/// Standard deviations of the loads at one instant.
#[derive(Debug, Clone)]
pub struct Uncertainty<T> {
    /// Standard deviation of the OTF, by wheel (N).
    pub otf: Vec<T>,
    /// Standard deviation of the load, by wheel (N). For a lifted wheel it is that of its OTF, which shows how certain the
    /// lift-off is. NaN while the machine tips.
    pub load: Vec<T>,
    /// U = 1 - (OTF - 2 sigma) / static load, of the worst wheel; NaN without a static load.
    pub utilisation: T,
}

impl<T: Real> Uncertainty<T> {
    pub(crate) fn blank(machine: &Machine) -> Self {
        let unknown = T::constant(f64::NAN);
        Self {
            otf: vec![unknown; machine.wheels.len()],
            load: vec![unknown; machine.wheels.len()],
            utilisation: unknown,
        }
    }
}

/// Sums that the variance of a load is collected in.
const PARTIAL_SUMS: usize = 4;

/// Variances of the parameters, prepared for summing up the variance of a load; built once per machine.
#[derive(Debug, Clone)]
pub(crate) struct ParameterSigmas {
    /// Variances of all independently uncertain parameters.
    variances: Vec<Variances>,
    /// Start index of each link's inertia tensor, and the standard deviations of its elements, which share
    /// one factor.
    inertias: Vec<(usize, [f64; 6])>,
    /// Directions in which an identification has reduced these variances.
    identified: Vec<ToldDirection>,
    pub(crate) model_share: f64,
}

/// Variances of consecutive independently uncertain parameters, with the index of the first in the order of
/// [`Parameter::all`].
#[derive(Debug, Clone)]
enum Variances {
    Four(usize, [f64; PARTIAL_SUMS]),
    One(usize, f64),
}

/// A direction that an identification told.
#[derive(Debug, Clone)]
struct ToldDirection {
    /// Share of the variance that the identification removed.
    share: f64,
    /// Index of each parameter, and its weight times its prior standard deviation.
    weights: Vec<(usize, f64)>,
}

impl ParameterSigmas {
    pub(crate) fn of(machine: &Machine) -> Self {
        let parameters = Parameter::all(machine);
        // Those before an identification; the directions remove what it told.
        let prior = |unknown: Unknown| {
            let identified = machine.identified.as_ref();
            let place = identified.and_then(|i| i.unknowns.iter().position(|u| *u == unknown));
            match (identified, place) {
                (Some(identified), Some(place)) if Identified::is_in_bands(unknown) => {
                    identified.prior_sigma[place]
                }
                _ => unknown.stated_sigma(machine),
            }
        };
        let mut inertias = Vec::new();
        for (i, &parameter) in parameters.iter().enumerate() {
            if let Parameter::LinkInertia(link, InertiaElement::Xx) = parameter {
                let element = |e| Parameter::LinkInertia(link, e).nominal(machine);
                let share = prior(Unknown::Inertia(link));
                let sigmas = InertiaElement::ALL.map(|e| share * element(e).unwrap_or(0.0));
                inertias.push((i, sigmas));
            }
        }
        let alone = |&parameter: &Parameter| match parameter {
            Parameter::LinkInertia(..) => 0.0,
            _ => prior(Unknown::Parameter(parameter)).powi(2),
        };
        let alone: Vec<f64> = parameters.iter().map(alone).collect();
        Self {
            variances: consecutive_variances(&alone),
            inertias,
            identified: told_directions(machine, &parameters),
            model_share: machine.uncertainty.model_share,
        }
    }

    /// Variance due to the parameters of a number with these derivatives.
    pub(crate) fn variance<T: Real>(&self, derivatives: &[T]) -> T {
        // One sum would wait for itself at every parameter.
        let mut sums = [T::zero(); PARTIAL_SUMS];
        for variances in &self.variances {
            match variances {
                Variances::Four(first, own) => {
                    if let Some(by) = derivatives[*first..].first_chunk() {
                        add_squares::<T, PARTIAL_SUMS>(&mut sums, by, own);
                    }
                }
                Variances::One(first, own) => {
                    add_squares(&mut sums, &[derivatives[*first]], &[*own]);
                }
            }
        }
        let mut variance = sums.into_iter().fold(T::zero(), T::add);
        for (first, sigmas) in &self.inertias {
            let Some(by) = derivatives[*first..].first_chunk::<6>() else {
                continue;
            };
            let mut together = T::zero();
            for k in 0..6 {
                together += by[k] * T::constant(sigmas[k]);
            }
            variance += together * together;
        }
        if self.identified.is_empty() {
            return variance;
        }
        for direction in &self.identified {
            let mut along = T::zero();
            for &(place, weight) in &direction.weights {
                along += derivatives[place] * T::constant(weight);
            }
            variance -= along * along * T::constant(direction.share);
        }
        // Rounding may leave less than nothing, and NaN stays.
        T::select(variance.lt(T::zero()), T::zero(), variance)
    }
}

/// Returns those of the variances that are not zero, in groups of consecutive ones.
fn consecutive_variances(variances: &[f64]) -> Vec<Variances> {
    let mut found = Vec::new();
    let mut first = 0;
    while first < variances.len() {
        let run = variances[first..].iter().take_while(|&&v| v > 0.0).count();
        let (fours, ones) = variances[first..][..run].as_chunks();
        for four in fours {
            found.push(Variances::Four(first, *four));
            first += PARTIAL_SUMS;
        }
        for one in ones {
            found.push(Variances::One(first, *one));
            first += 1;
        }
        first += usize::from(run == 0);
    }
    found
}

/// The directions that an identification told, by the indices of [`Parameter::all`].
fn told_directions(machine: &Machine, parameters: &[Parameter]) -> Vec<ToldDirection> {
    let Some(identified) = &machine.identified else {
        return Vec::new();
    };
    let place = |wanted| parameters.iter().position(|&parameter| parameter == wanted);
    let directions = identified.directions.iter().map(|direction| {
        let mut weights = Vec::new();
        let unknowns = identified.unknowns.iter().enumerate();
        for (i, unknown) in unknowns.filter(|(_, unknown)| Identified::is_in_bands(**unknown)) {
            let weight = direction.weights[i] * identified.prior_sigma[i];
            let changes = unknown.changes(machine, weight).into_iter();
            weights.extend(changes.filter_map(|(parameter, by)| Some((place(parameter)?, by))));
        }
        weights.retain(|(_, weight)| *weight != 0.0);
        ToldDirection {
            share: direction.share,
            weights,
        }
    });
    directions.collect()
}

/// Adds each of these squared derivatives, times its variance, to a sum of its own.
#[inline(always)]
fn add_squares<T: Real, const N: usize>(
    sums: &mut [T; PARTIAL_SUMS],
    by: &[T; N],
    variances: &[f64; N],
) {
    for k in 0..N {
        sums[k] += by[k] * by[k] * T::constant(variances[k]);
    }
}

/// Inputs of the standard deviations of the loads, other than the derivatives.
pub(crate) struct LoadSigmas<'a, T: Real> {
    sigmas: &'a ParameterSigmas,
    state: &'a State<T>,
    signals: SignalPlaces,
    /// Variance of the model (N^2).
    model: T,
    load: &'a [T],
    /// Variances of OTF and load that the load split leaves (N^2).
    split_variances: [[T; MAX_WHEELS]; 2],
}

impl<'a, T: Real> LoadSigmas<'a, T> {
    /// Inputs for the loads `load`, with the variances of OTF and load that the load split leaves.
    pub(crate) fn new(
        machine: &Machine,
        sigmas: &'a ParameterSigmas,
        state: &'a State<T>,
        (normal_force, load): (T, &'a [T]),
        split_variances: [[T; MAX_WHEELS]; 2],
    ) -> Self {
        let wheels = machine.wheels.len() as f64;
        let mean_load = normal_force * T::constant(sigmas.model_share / wheels);
        Self {
            sigmas,
            state,
            signals: SignalPlaces::of(machine),
            model: mean_load * mean_load,
            load,
            split_variances,
        }
    }

    /// Fills the standard deviations of a group of wheels; returns those of the loads.
    #[inline(always)]
    pub(crate) fn fill(
        &self,
        derivatives: &GroupDerivatives<'_, T::Wheels>,
        out: &mut Uncertainty<T>,
    ) -> T::Wheels {
        let [otf_split, load_split] = &self.split_variances;
        let first = derivatives.group * T::Wheels::COUNT;
        let otf = self.of(derivatives.otf, &otf_split[first..]);
        let load = derivatives.load;
        let load = load.map(|load| self.of(load, &load_split[first..]));
        for (place, wheel) in (first..self.load.len()).take(T::Wheels::COUNT).enumerate() {
            let otf = otf.wheel(place);
            out.otf[wheel] = otf;
            out.load[wheel] = otf;
            if let Some(load) = load {
                let carries = T::zero().lt(self.load[wheel]);
                let load = load.wheel(place);
                // NaN in either makes both NaN.
                let unknown = load * T::zero();
                out.load[wheel] = T::select(carries, load, otf + unknown);
            }
        }
        T::Wheels::of(&out.load[first..])
    }

    fn of(&self, derivatives: &[T::Wheels], split: &[T]) -> T::Wheels {
        let variance = self.sigmas.variance(derivatives)
            + self.signals.variance(derivatives, self.state)
            + T::Wheels::each(self.model)
            + T::Wheels::of(split);
        variance.sqrt()
    }
}

/// U of the worst wheel, from OTF and its standard deviation by wheel (N).
pub(crate) fn utilisation<T: Real>(machine: &Machine, otf: &[T], otf_sigma: &[T]) -> T {
    largest_utilisation(machine, |wheel| {
        otf[wheel] - otf_sigma[wheel] * T::constant(SURE_SIGMAS)
    })
}

/// Returns U of the worst wheel, from a lower bound of each wheel's OTF (N): OTF - 2 sigma, or the least that is possible.
pub fn largest_utilisation<T: Real>(machine: &Machine, sure: impl Fn(usize) -> T) -> T {
    let mut worst = T::constant(f64::NEG_INFINITY);
    for (wheel, &static_load) in machine.reference.static_load.iter().enumerate() {
        let used = T::one() - sure(wheel) / T::constant(static_load);
        // In the opposite order a NaN would be ignored.
        worst = T::select(used.lt(worst), worst, used);
    }
    worst
}

/// Indices of the signals in a gradient.
pub(crate) struct SignalPlaces {
    joints: usize,
    tool: bool,
    /// The masses of the payloads, if some are estimated row by row.
    weighed: Range<usize>,
}

impl SignalPlaces {
    pub(crate) fn of(machine: &Machine) -> Self {
        Self {
            joints: machine.joints.len(),
            tool: machine.tool.is_some(),
            weighed: match machine.payloads.iter().any(Payload::is_weighed) {
                true => {
                    let first = Parameter::first_payload(machine);
                    first..first + machine.payloads.len()
                }
                false => 0..0,
            },
        }
    }

    /// Error due to the lag of the signals, with its sign: all that lags belongs to one motion.
    #[inline(always)]
    pub(crate) fn behind<T: Real>(&self, derivatives: &[T::Wheels], state: &State<T>) -> T::Wheels {
        let (covariance, lag) = (&state.noise.joint, &state.lag);
        let each = T::Wheels::each;
        let (joints, rest) = derivatives.split_at(3 * self.joints);
        let [p02, p12, p22] =
            [covariance.value[2], covariance.first[1], covariance.second].map(each);
        let is_noisy = T::zero().lt(covariance.second);
        let precision = T::select(is_noisy, T::one() / covariance.second, T::zero());
        let mut behind = T::Wheels::constant(0.0);
        for (by, &lag) in joints.chunks_exact(3).zip(&lag.joints) {
            let (g0, g1, g2) = (by[0], by[1], by[2]);
            behind += (g0 * p02 + g1 * p12 + g2 * p22) * each(lag * precision);
        }
        for axis in 0..3 {
            let (f, by_w, by_alpha) = (rest[axis], rest[3 + axis], rest[6 + axis]);
            behind += f * each(lag.specific_force[axis])
                + by_w * each(lag.angular_velocity[axis])
                + by_alpha * each(lag.angular_acceleration[axis]);
        }
        behind
    }

    /// Variance due to the noise of the signals and their lag, and the change of that due to the accelerometer's bias where
    /// signals have narrowed it down. All that lags belongs to one motion: its errors add up with their signs.
    pub(crate) fn variance<T: Real>(
        &self,
        derivatives: &[T::Wheels],
        state: &State<T>,
    ) -> T::Wheels {
        let noise = &state.noise;
        let each = T::Wheels::each;
        let two = T::Wheels::constant(2.0);
        let (joints, rest) = derivatives.split_at(3 * self.joints);
        let mut variance = T::Wheels::constant(0.0);
        let [p00, p01, p02] = noise.joint.value.map(each);
        let [p11, p12] = noise.joint.first.map(each);
        let p22 = each(noise.joint.second);
        for by in joints.chunks_exact(3) {
            let (g0, g1, g2) = (by[0], by[1], by[2]);
            variance += g0 * g0 * p00
                + g1 * g1 * p11
                + g2 * g2 * p22
                + two * (g0 * (g1 * p01 + g2 * p02) + g1 * g2 * p12);
        }
        let [w, w_alpha, alpha] = noise.turning.map(each);
        let specific_force = each(noise.specific_force);
        for axis in 0..3 {
            let (f, by_w, by_alpha) = (rest[axis], rest[3 + axis], rest[6 + axis]);
            variance += f * f * specific_force
                + by_w * by_w * w
                + by_alpha * by_alpha * alpha
                + two * by_w * by_alpha * w_alpha;
        }
        let behind = self.behind(derivatives, state);
        variance += behind * behind;
        let (x, y, z) = (rest[0], rest[1], rest[2]);
        let [xx, yy, zz, xy, xz, yz] = noise.accelerometer_bias.covariance_change.map(each);
        variance +=
            x * x * xx + y * y * yy + z * z * zz + two * (x * (y * xy + z * xz) + y * z * yz);
        if self.tool {
            for &by in &rest[9..15] {
                variance += by * by * each(noise.tool_wrench);
            }
        }
        // of others on the same machine as well, rather than less
        for &by in &derivatives[self.weighed.clone()] {
            variance += by * by * each(noise.payload_mass);
        }
        variance
    }
}
