//! Widens the bands of rows by the changes that motion between them may have made.

use std::sync::OnceLock;

use tipwatch_mechanics::estimation::quasi_static::{MotionRange, UnobservedMotion};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::number::SURE_SIGMAS;
use tipwatch_mechanics::studies::unobserved::UnobservedLoads;
use tipwatch_mechanics::{Quantity, State, largest_utilisation};

use super::motion_loads::MotionLoads;
use crate::base::rows::Rows;
use crate::base::widening::Widening;
use crate::load::SharedSignal;

/// The static rows of a log.
#[derive(Debug)]
pub(crate) struct StaticRows {
    motion: UnobservedMotion<SharedSignal>,
    failure: OnceLock<String>,
}

impl StaticRows {
    pub(super) fn new(motion: UnobservedMotion<SharedSignal>) -> Self {
        Self {
            motion,
            failure: OnceLock::new(),
        }
    }
}

impl StaticRows {
    /// Returns the change that unobserved motion may have made to the loads at a time; `None` where all of it was observed.
    pub(in crate::analysis) fn loads(
        &self,
        machine: &Machine,
        state: &State<f64>,
        time_ns: i64,
    ) -> Option<MotionLoads> {
        let mut at = MotionRange::of(machine);
        let mut memory = self.motion.memory();
        let read = (self.motion).between(time_ns, time_ns, state, &mut memory, &mut at);
        if read.is_err() {
            return Some(MotionLoads::unbounded());
        }
        let by_signal = (at.is_unobserved)
            .then(|| UnobservedLoads::new(machine).by_signal(machine, state, &at))?;
        Some(MotionLoads::of(by_signal))
    }
}

impl Widening for StaticRows {
    fn widen(&self, machine: &Machine, rows: &mut Rows, next_ns: Option<i64>) {
        let places = Places::of(machine, rows);
        let mut memory = self.motion.memory();
        let mut loads = UnobservedLoads::new(machine);
        let mut state = State::zero(machine);
        let (mut at, mut until) = (MotionRange::of(machine), MotionRange::of(machine));
        for row in 0..rows.len() {
            let time_ns = rows.times_ns[row];
            let next_ns = rows.times_ns.get(row + 1).copied().or(next_ns);
            rows.states.get(row, &mut state);
            let read = self
                .motion
                .between(time_ns, time_ns, &state, &mut memory, &mut at);
            let read = read.and_then(|()| {
                let next_ns = next_ns.unwrap_or(time_ns);
                self.motion
                    .between(time_ns, next_ns, &state, &mut memory, &mut until)
            });
            if let Err(error) = read {
                // unknown ranges exclude nothing
                let _ = self.failure.set(error.to_string());
                (until.is_unobserved, until.is_bounded) = (true, false);
            }
            let is_unobserved = at.is_unobserved || until.is_unobserved;
            let columns = &mut rows.outcomes.columns;
            columns[places.is_static][row] = f64::from(u8::from(is_unobserved));
            columns[places.held_age][row] = at.held_s;
            if !is_unobserved || !rows.reasons[row].leave_loads() {
                continue;
            }
            let mut sigmas: Vec<f64> = (places.wheels.iter())
                .map(|wheel| columns[wheel.otf_sigma][row])
                .collect();
            if at.is_unobserved {
                let variances = loads.variances(machine, &state, &at);
                for (wheel, [otf, load]) in places.wheels.iter().zip(variances) {
                    for (column, variance) in [(wheel.otf_sigma, otf), (wheel.load_sigma, load)] {
                        let sigma = &mut columns[column][row];
                        *sigma = (*sigma * *sigma + variance).sqrt();
                    }
                }
            }
            // measured forces are those of the row: from there to the next one the split rule divides the load
            let is_measured = (state.actuator_force.iter()).any(|force| force.is_finite())
                && state.follows_supports <= 0.0;
            if is_measured {
                state.actuator_force.fill(f64::NAN);
                sigmas = loads.sigmas(machine, &state);
            }
            let is_bounded = at.is_bounded && until.is_bounded;
            let reach = is_bounded.then(|| loads.reach(machine, &state, &until));
            for (wheel, reach) in reach.iter().flatten().enumerate() {
                let (place, two_sigma) = (&places.wheels[wheel], SURE_SIGMAS * sigmas[wheel]);
                let mut band = [reach.least_otf - two_sigma, reach.largest_otf + two_sigma];
                if is_measured {
                    let two_sigma = SURE_SIGMAS * columns[place.otf_sigma][row];
                    let otf = columns[place.otf][row];
                    band = around(band, [otf - two_sigma, otf + two_sigma]);
                }
                [columns[place.least][row], columns[place.largest][row]] = band;
            }
            let utilisation = largest_utilisation(machine, |wheel| {
                let place = &places.wheels[wheel];
                match is_bounded {
                    true => columns[place.least][row],
                    false => columns[place.otf][row] - SURE_SIGMAS * columns[place.otf_sigma][row],
                }
            });
            columns[places.utilisation][row] = utilisation;
        }
    }

    fn failure(&self) -> Option<String> {
        self.failure.get().cloned()
    }
}

/// The band that contains two bands (N). Where one of them is unknown, so is it.
fn around(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    let are_known = one.iter().chain(&other).all(|end| !end.is_nan());
    match are_known {
        true => [one[0].min(other[0]), one[1].max(other[1])],
        false => [f64::NAN; 2],
    }
}

/// Positions of the columns.
struct Places {
    is_static: usize,
    held_age: usize,
    utilisation: usize,
    wheels: Vec<WheelPlaces>,
}

struct WheelPlaces {
    otf: usize,
    otf_sigma: usize,
    load_sigma: usize,
    least: usize,
    largest: usize,
}

impl Places {
    /// The table of a sparse log has all of them.
    fn of(machine: &Machine, rows: &Rows) -> Self {
        let at = |quantity: Quantity| {
            let found = rows.outcomes.place(quantity);
            found.unwrap_or_else(|| unreachable!("no column of {quantity:?}"))
        };
        let wheels = 0..machine.wheels().len();
        Self {
            is_static: at(Quantity::Static),
            held_age: at(Quantity::HeldAge),
            utilisation: at(Quantity::Utilisation),
            wheels: wheels
                .map(|wheel| WheelPlaces {
                    otf: at(Quantity::Otf(wheel)),
                    otf_sigma: at(Quantity::OtfSigma(wheel)),
                    load_sigma: at(Quantity::LoadSigma(wheel)),
                    least: at(Quantity::OtfBetweenLeast(wheel)),
                    largest: at(Quantity::OtfBetweenLargest(wheel)),
                })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_unknown_of_one_band_stays_unknown() {
        assert_eq!(around([-1.0, 2.0], [0.0, 3.0]), [-1.0, 3.0]);
        for unknown in [[f64::NAN; 2], [f64::NAN, 1.0], [0.0, f64::NAN]] {
            for band in [around(unknown, [0.0, 3.0]), around([0.0, 3.0], unknown)] {
                assert!(band.iter().all(|end| end.is_nan()), "{band:?}");
            }
        }
    }
}
