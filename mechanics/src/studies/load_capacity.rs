//! Largest load of a machine at rest before it tips, or before a wheel is lighter than a limit.
//!
//! Nothing is solved anew: the loads of [`static_outcome`](super::static_posture::static_outcome) are evaluated with a point
//! mass on a link, and the mass is sought at which the smallest margin is zero.

use nalgebra::Vector3;

use crate::evaluate::outcome::Outcome;
use crate::evaluate::scope::Scope;
use crate::evaluate::workspace::Workspace;
use crate::machine::{LoadOnTool, Machine};
use crate::state::State;
use crate::studies::static_posture::{AtRest, at_rest, evaluate_at_rest};

/// Largest load that counts as a limit of the machine, as a multiple of its mass.
const MOST_MASSES: f64 = 20.0;
/// The mass is sought to this share of the machine's mass.
const EXACT_SHARE: f64 = 1e-9;
/// Most evaluations of a search; a secant needs some five.
const MOST_STEPS: usize = 80;

/// A machine at rest on level ground in one posture, with any load at one place.
#[derive(Debug)]
pub struct LadenMachine {
    machine: Machine,
    state: State<f64>,
    workspace: Workspace<f64>,
    load: LoadOnTool,
    /// Mass of the machine without the load (kg).
    mass: f64,
}

/// A load that a machine just carries.
#[derive(Debug, Clone, PartialEq)]
pub struct Carried {
    /// Its mass (kg): zero if the machine does not even carry itself.
    pub mass_kg: f64,
    /// The edge that the machine tips over, or the wheel that is lighter than its limit.
    pub by: String,
}

impl LadenMachine {
    /// The machine with these joint positions (rad or m) in the order of [`Machine::joints`] and a load at this place;
    /// `None` where it cannot be computed, such as where a linkage cannot close.
    #[must_use]
    pub fn new(machine: &Machine, joint_positions: &[f64], load: LoadOnTool) -> Option<Self> {
        // of one kilogram: its share in the state is the mass
        let laden = machine.with_load(load.body, load.place, 1.0);
        let mass = machine.mass();
        let AtRest {
            machine,
            state,
            workspace,
        } = at_rest(&laden, joint_positions, Scope::LOADS);
        let loads = &workspace.outcome().load;
        let is_known = loads.iter().all(|load| load.is_finite());
        is_known.then_some(Self {
            machine,
            state,
            workspace,
            load,
            mass,
        })
    }

    /// Loads and margins with a load of this mass (kg).
    pub fn with(&mut self, mass_kg: f64) -> &Outcome<f64> {
        if let Some(share) = self.state.payload_share.last_mut() {
            *share = mass_kg;
        }
        evaluate_at_rest(&self.machine, &mut self.state, &mut self.workspace)
    }

    /// Returns the place of the load in the base frame (m).
    #[must_use]
    pub fn place(&self) -> Vector3<f64> {
        self.workspace.point(self.load.body, &self.load.place)
    }

    /// A point of a body, in the base frame (m).
    #[must_use]
    pub fn point(&self, body: usize, in_body: &Vector3<f64>) -> Vector3<f64> {
        self.workspace.point(body, in_body)
    }

    /// Height of a point of the base frame above the ground (m), as the machine stood last.
    #[must_use]
    pub fn height(&self, point: &Vector3<f64>) -> f64 {
        let normal = self.workspace.outcome().contact_normal;
        let centres = self.workspace.wheel_centres().iter();
        let ground = centres.zip(self.workspace.radii());
        let heights = ground.map(|(centre, radius)| normal.dot(centre) - radius);
        let (sum, count) = heights.fold((0.0, 0.0), |(sum, count), h| (sum + h, count + 1.0));
        normal.dot(point) - sum / count
    }

    /// The load with which the machine begins to tip over an edge of its support polygon; `None` if no load does that.
    pub fn tipping(&mut self) -> Option<Carried> {
        let edges = self.machine.polygon().edges.iter();
        let names: Vec<String> = edges.map(|edge| edge.name.clone()).collect();
        self.least(&names, |outcome, edge| -outcome.itom_full[edge])
    }

    /// The load with which the overturning force of a wheel falls to its limit (N), by wheel; `None` if no load does that.
    pub fn wheel_limit(&mut self, limits_n: &[f64]) -> Option<Carried> {
        let wheels = self.machine.wheels().iter();
        let names: Vec<String> = wheels.map(|wheel| wheel.name.clone()).collect();
        self.least(&names, |outcome, wheel| {
            outcome.otf[wheel] - limits_n[wheel]
        })
    }

    /// The smallest load with which a margin is zero.
    fn least(
        &mut self,
        names: &[String],
        margin: impl Fn(&Outcome<f64>, usize) -> f64,
    ) -> Option<Carried> {
        let own_mass = self.mass;
        let mut smallest = |mass: f64| {
            let outcome = self.with(mass);
            let margins = (0..names.len()).map(|index| (index, margin(outcome, index)));
            margins.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let carried = |mass_kg: f64, index: usize| {
            Some(Carried {
                mass_kg,
                by: names[index].clone(),
            })
        };
        let (own, at_zero) = smallest(0.0)?;
        if !(at_zero > 0.0) {
            return carried(0.0, own);
        }
        let (mut low, mut at_low) = (0.0, at_zero);
        let mut high = 0.1 * own_mass;
        let mut by;
        let mut at_high;
        loop {
            (by, at_high) = smallest(high)?;
            if !(at_high > 0.0) {
                break;
            }
            (low, at_low) = (high, at_high);
            high *= 2.0;
            if high > MOST_MASSES * own_mass {
                return None;
            }
        }
        // regula falsi that halves the weight of an end that stays (Illinois): margins are nearly linear in the mass
        let mut last = 0;
        for _ in 0..MOST_STEPS {
            if high - low < EXACT_SHARE * own_mass {
                break;
            }
            let between = low + (high - low) * at_low / (at_low - at_high);
            let (index, here) = smallest(between)?;
            if here > 0.0 {
                (low, at_low) = (between, here);
                at_high *= if last == 1 { 0.5 } else { 1.0 };
                last = 1;
            } else {
                (high, at_high, by) = (between, here, index);
                at_low *= if last == -1 { 0.5 } else { 1.0 };
                last = -1;
                if here == 0.0 {
                    break;
                }
            }
        }
        carried(high, by)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::of_tests::rigid;

    /// The machine that the search leaves and one set up anew agree on which load tips it, in any posture and after any load.
    #[test]
    fn a_load_below_the_limit_stands_and_one_above_it_tips() {
        let machine = rigid();
        let load = machine.load_on_tool().unwrap();
        let mut found = 0;
        for place in 0..400_u32 {
            // joints anywhere within their limits, by the digits of golden ratios
            let position = |(joint, of): (usize, &crate::machine::MeasuredJoint)| {
                let share = (f64::from(place) * (0.618_034 + 0.13 * joint as f64)).fract();
                let [least, greatest] = of.limits.unwrap_or([-3.0, 3.0]);
                least + (greatest - least) * share
            };
            let positions: Vec<f64> = machine.joints().iter().enumerate().map(position).collect();
            let anew = || LadenMachine::new(&machine, &positions, load);
            let Some(carried) = anew().and_then(|mut laden| laden.tipping()) else {
                continue;
            };
            if carried.mass_kg == 0.0 {
                continue;
            }
            found += 1;
            let margin = |share: f64| {
                let mut laden = anew().unwrap();
                let outcome = laden.with(share * carried.mass_kg);
                let margins = outcome.itom_full.iter().map(|itom| -itom);
                margins.fold(f64::INFINITY, f64::min)
            };
            assert!(margin(0.999) > 0.0, "{positions:?}: {carried:?}");
            assert!(margin(1.001) < 0.0, "{positions:?}: {carried:?}");
        }
        assert!(found > 200, "{found}");
    }
}
