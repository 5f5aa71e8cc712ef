//! Ground that gives way under a machine that stands: seen by how the platform turns, it leaves the split of the loads open.
//!
//! The split rule holds on ground that stays as it is. Where the platform turns farther than its arm and its tyres explain,
//! the ground under some wheel has sunk, and by how much more than under the others nothing measures. A wheel may then
//! carry anything that equilibrium allows, from `load_min` to `load_max`, of which the share `w` is open:
//! ```text
//!     turned = |n x u - n0 x u0|,     n: normal of the contact plane, u: up, both in base axes; 0: since the machine stands
//!     moved = max(turned - T - G W |c - c0| / (k sum d^2), 0),     c: centre of mass, k: stiffness of a tyre
//!     w = min(G moved L n k / W, 1),     L: the wheels' distance, n: their number
//!     sigma^2 += w^2 ((max - N)^3 + (N - min)^3) / (3 (max - min))
//! ```

use nalgebra::Vector2;
use tipwatch_language::say;
use tipwatch_mechanics::machine::{Machine, Wheel};
use tipwatch_mechanics::{Placement, Quantity, State, largest_utilisation};

use crate::base::rows::{Rows, last_until};
use crate::base::table::Table;
use crate::base::widening::Widening;
use crate::events::drives;

/// Largest turn of the platform that needs no ground giving way: noise and drift of the attitude (rad).
const LEAST: f64 = 0.12 * std::f64::consts::PI / 180.0;
/// Factor by which the ground under a wheel, its tyre and the frame may together be softer or stiffer than the tyre.
const GIVES: f64 = 4.0;
/// Time between the states that are looked at, and for which a machine must have stood before they count (ns).
const STEP_NS: i64 = 200_000_000;
const STOOD_NS: i64 = 1_000_000_000;
/// Time constant over which turn and centre of mass are averaged (s): of one moment both, or an arm that moves turns the ground.
const AVERAGED_S: f64 = 0.5;

/// Movement of the ground under a machine, by time.
#[derive(Debug)]
pub(super) struct MovedGround {
    /// Times (ns) with the share of the split that the moved ground leaves open from then on; increasing.
    open: Vec<(i64, f64)>,
}

impl MovedGround {
    /// `None` where it never moved as far as can be told. While the platform is `rotating` about an edge (first and last
    /// times, ns), no ground turns it.
    pub(super) fn of(machine: &Machine, table: &Table, rotating: &[[i64; 2]]) -> Option<Self> {
        if machine.supports().vary() {
            return None;
        }
        let tyres = Tyres::of(machine)?;
        let (mut placement, mut state) = (Placement::new(machine), State::zero(machine));
        let mut standing: Option<StandingSpell> = None;
        let mut open: Vec<(i64, f64)> = Vec::new();
        let mut next_ns = i64::MIN;
        for (row, &time_ns) in table.times_ns.iter().enumerate() {
            if time_ns < next_ns {
                continue;
            }
            next_ns = time_ns.saturating_add(STEP_NS);
            let falls =
                (rotating.iter()).any(|[from_ns, to_ns]| (*from_ns..=*to_ns).contains(&time_ns));
            table.state(row, &mut state);
            if falls || drives(machine, &state) {
                standing = None;
            } else {
                placement.place(&state);
                let turned = placement.normal.cross(&state.base.up).xy();
                let centre = placement.centre_of_mass.xy();
                if turned.iter().chain(centre.iter()).all(|c| c.is_finite()) {
                    standing
                        .get_or_insert_with(|| StandingSpell::new(time_ns, turned, centre))
                        .take(time_ns, turned, centre);
                }
            }
            let moved = standing.as_ref().map_or(0.0, |it| it.moved(&tyres));
            let share = (moved * tyres.per_turn).min(1.0);
            if open.last().map_or(0.0, |(_, last)| *last) != share {
                open.push((time_ns, share));
            }
        }
        open.iter()
            .any(|(_, share)| *share > 0.0)
            .then_some(Self { open })
    }

    /// Describes since when the ground has moved.
    pub(super) fn note(&self, start_ns: i64) -> Option<String> {
        let mut open = self.open.iter();
        let (since_ns, _) = open.find(|(_, share)| *share > 0.0)?;
        let since_s = (since_ns - start_ns) as f64 * 1e-9;
        Some(say!(
            "From t = {since_s:.1} s on the platform turned farther than its arm and tyres explain while the machine stood: the \
             ground gave way under it, or a position of the arm is wrong. How the wheels share the load on it is open there, and in the bands."
        ))
    }

    fn share_at(&self, time_ns: i64) -> f64 {
        last_until(&self.open, time_ns).map_or(0.0, |(_, share)| *share)
    }
}

/// Compliance of the tyres.
struct Tyres {
    /// Lean by a shift of the centre of mass (rad/m).
    per_shift: f64,
    /// Share of the split that the ground leaves open per turn of the platform (1/rad).
    per_turn: f64,
}

impl Tyres {
    /// `None` where the wheels stand on one line.
    fn of(machine: &Machine) -> Option<Self> {
        let wheels = machine.wheels();
        let weight = machine.mass() * machine.gravity();
        let count = wheels.len() as f64;
        let mean = Wheel::stiffnesses(wheels, weight).iter().sum::<f64>() / count;
        let places = wheels.iter().map(|wheel| wheel.centre_at_zero.xy());
        let centre = places.clone().sum::<Vector2<f64>>() / count;
        let squares = places.fold(Vector2::zeros(), |sum: Vector2<f64>, place| {
            let from_centre = place - centre;
            sum + from_centre.component_mul(&from_centre)
        });
        let least = squares.min();
        let tyres = Self {
            per_shift: weight / (mean * least),
            per_turn: GIVES * 2.0 * (least / count).sqrt() * count * mean / weight,
        };
        (tyres.per_shift.is_finite() && tyres.per_turn.is_finite()).then_some(tyres)
    }
}

/// A machine that stands.
struct StandingSpell {
    since_ns: i64,
    last_ns: i64,
    /// Turn of the platform and centre of mass, averaged.
    turned: Vector2<f64>,
    centre: Vector2<f64>,
    /// Turn and centre of mass of the platform when the machine had stood for a while.
    first: Option<[Vector2<f64>; 2]>,
}

impl StandingSpell {
    fn new(now_ns: i64, turned: Vector2<f64>, centre: Vector2<f64>) -> Self {
        Self {
            since_ns: now_ns,
            last_ns: now_ns,
            turned,
            centre,
            first: None,
        }
    }

    fn take(&mut self, now_ns: i64, turned: Vector2<f64>, centre: Vector2<f64>) {
        let step_s = now_ns.saturating_sub(self.last_ns) as f64 * 1e-9;
        self.last_ns = now_ns;
        let share = 1.0 - (-step_s / AVERAGED_S).exp();
        self.turned += (turned - self.turned) * share;
        self.centre += (centre - self.centre) * share;
        if self.first.is_none() && now_ns.saturating_sub(self.since_ns) >= STOOD_NS {
            self.first = Some([self.turned, self.centre]);
        }
    }

    /// Returns the angle by which the ground has turned the platform (rad).
    fn moved(&self, tyres: &Tyres) -> f64 {
        self.first.map_or(0.0, |[turned, centre]| {
            let by_tyres = GIVES * tyres.per_shift * (self.centre - centre).norm();
            ((self.turned - turned).norm() - LEAST - by_tyres).max(0.0)
        })
    }
}

/// Variance of a load about its computed value where equilibrium allows it from `least` to `largest` (N^2).
fn open_variance(load: f64, [least, largest]: [f64; 2]) -> f64 {
    let range = largest - least;
    if !(range > 0.0) {
        return 0.0;
    }
    ((largest - load).powi(3) + (load - least).powi(3)).max(0.0) / (3.0 * range)
}

impl Widening for MovedGround {
    fn widen(&self, machine: &Machine, rows: &mut Rows, _next_ns: Option<i64>) {
        let wheels = 0..machine.wheels().len();
        let outcomes = &mut rows.outcomes;
        let place = |quantity: Quantity| outcomes.place(quantity);
        let columns: Option<Vec<[usize; 6]>> = wheels
            .map(|wheel| {
                Some([
                    place(Quantity::Load(wheel))?,
                    place(Quantity::LoadLeast(wheel))?,
                    place(Quantity::LoadLargest(wheel))?,
                    place(Quantity::Otf(wheel))?,
                    place(Quantity::LoadSigma(wheel))?,
                    place(Quantity::OtfSigma(wheel))?,
                ])
            })
            .collect();
        // without bands there is nothing to widen
        let (Some(columns), Some(utilisation)) = (columns, place(Quantity::Utilisation)) else {
            return;
        };
        for row in 0..rows.times_ns.len() {
            let share = self.share_at(rows.times_ns[row]);
            let at = |column: usize| outcomes.columns[column][row];
            // of a wheel off the ground the split is known
            let stands = columns.iter().all(|[load, ..]| at(*load) > 0.0);
            if share == 0.0 || !stands {
                continue;
            }
            for &[load, least, largest, _, load_sigma, otf_sigma] in &columns {
                let columns = &mut outcomes.columns;
                let range = [columns[least][row], columns[largest][row]];
                let variance = share * share * open_variance(columns[load][row], range);
                for sigma in [load_sigma, otf_sigma] {
                    let sigma = &mut columns[sigma][row];
                    *sigma = (*sigma * *sigma + variance).sqrt();
                }
            }
            let at = |column: usize| outcomes.columns[column][row];
            let used = largest_utilisation(machine, |wheel| {
                let [_, _, _, otf, _, otf_sigma] = columns[wheel];
                at(otf) - 2.0 * at(otf_sigma)
            });
            outcomes.columns[utilisation][row] = used;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_standard_deviations_reach_both_ends_of_what_equilibrium_allows() {
        for load in [0.0, 1000.0, 3000.0, 5500.0, 6000.0] {
            let two_sigma = 2.0 * open_variance(load, [0.0, 6000.0]).sqrt();
            assert!(load - two_sigma <= 0.0, "{load}: {two_sigma}");
            assert!(load + two_sigma >= 6000.0, "{load}: {two_sigma}");
        }
        assert_eq!(open_variance(100.0, [100.0, 100.0]), 0.0);
        assert_eq!(open_variance(100.0, [f64::NAN, 100.0]), 0.0);
    }

    #[test]
    fn ground_moves_where_the_platform_turns_beyond_its_arm() {
        let tyres = Tyres {
            per_shift: 0.02,
            per_turn: 100.0,
        };
        let moved = |turn: f64, shift: f64| {
            let mut standing = StandingSpell::new(0, Vector2::zeros(), Vector2::zeros());
            for step in 0..100 {
                let share = f64::from(step) / 100.0;
                let turned = Vector2::new(turn, 0.0) * share;
                standing.take(
                    i64::from(step) * STEP_NS,
                    turned,
                    Vector2::new(0.0, shift) * share,
                );
            }
            standing.moved(&tyres)
        };
        assert_eq!(moved(0.02, 0.4), 0.0, "tyres lean under the arm");
        assert!(moved(0.02, 0.0) > 0.01);
        assert_eq!(moved(0.002, 0.0), 0.0);
    }

    #[test]
    fn an_arm_that_moves_while_the_account_begins_moves_no_ground() {
        let tyres = Tyres {
            per_shift: 0.02,
            per_turn: 100.0,
        };
        // it moves at 1 m/s for two seconds, and the tyres lean nearly as much as they may
        let at = |step: i64| {
            let shift = 1.0 - (step.min(10) as f64 * STEP_NS as f64 * 1e-9);
            [
                Vector2::new(3.6 * tyres.per_shift * shift, 0.0),
                Vector2::new(0.0, shift),
            ]
        };
        let [turned, centre] = at(0);
        let mut standing = StandingSpell::new(0, turned, centre);
        for step in 0..50 {
            let [turned, centre] = at(step);
            standing.take(step * STEP_NS, turned, centre);
            assert_eq!(standing.moved(&tyres), 0.0, "{step}");
        }
    }
}
