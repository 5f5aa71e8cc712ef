//! How the platform of a machine that stands leans on its tyres while the loads say that a wheel lifts.
//!
//! The ground force turns the platform as it changes. With the lean a that the computed force causes on tyres of stated stiffness
//! and the turn b that the gyro measures, about x and y and both without what changes evenly in time, as a bias of the gyro does,
//! the platform shows the share
//! ```text
//!     s = sum a.b / sum a.a
//! ```
//! of the lean. Loads that it does not show are wrong: those by an encoder that slips, for example.

use nalgebra::Vector2;
use tipwatch_mechanics::estimation::plausibility::{LeanOnTyres, lean_shows_loads};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Placement, Scope, State, Workspace, evaluate};

use super::episodes::{Episode, MERGED_NS};
use super::pages::Pages;
use super::tipping::drives;

/// Time from the start of a lift that counts, and time before and after it in which the platform is looked at (s).
const FIRST_S: f64 = 0.5;
const AROUND_S: f64 = 0.5;
/// Fewest rows that show anything.
const FEWEST: usize = 10;
/// Error of the sums of a rate that does not change (rad).
const STUCK_RAD: f64 = 1e-9;

/// Lean by the loads and turn of the platform (rad), by time (s).
#[derive(Debug, Default)]
struct Leaning {
    times_s: Vec<f64>,
    leans: Vec<Vector2<f64>>,
    turns: Vec<Vector2<f64>>,
}

/// Returns the probability that the loads of an episode by loads alone are right, by how the platform leans in rows up to
/// `last`; `None` where that cannot be told.
pub(super) fn loads_are_right(
    machine: &Machine,
    rows: &Pages<'_>,
    episode: Episode,
    last: usize,
) -> Option<f64> {
    // how the platform moved belongs to what was recorded, and only a gyro shows a lean
    if rows.is_supposed() || !rows.has_gyro() {
        return None;
    }
    let on_tyres = LeanOnTyres::of(machine).filter(LeanOnTyres::stiffness_is_stated)?;
    let (first_s, last_s) = (rows.seconds(episode.first), rows.seconds(episode.last));
    let until_s = last_s.min(first_s + FIRST_S) + AROUND_S;
    let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
    let mut placement = Placement::new(machine);
    let mut state = State::zero(machine);
    let mut leaning = Leaning::default();
    let mut turned = Vector2::zeros();
    let mut before: Option<(f64, Vector2<f64>)> = None;
    let mut carried: Option<Vec<f64>> = None;
    for row in rows.row_from(first_s - AROUND_S)..=last {
        let at_s = rows.seconds(row);
        if at_s > until_s {
            break;
        }
        if !rows.is_meaningful(row) {
            continue;
        }
        rows.state(row, &mut state);
        // a load is taken up about when the machine file says so
        let carries = carried.get_or_insert_with(|| state.payload_share.clone());
        if drives(machine, &state) || *carries != state.payload_share {
            return None;
        }
        placement.place(&state);
        let rate = placement.angular_velocity.xy();
        if let Some((before_s, before)) = before {
            let step_s = at_s - before_s;
            if step_s > MERGED_NS as f64 * 1e-9 {
                return None;
            }
            turned += (before + rate) * (0.5 * step_s);
        }
        before = Some((at_s, rate));
        let ground = &evaluate(machine, &state, &mut workspace).ground_wrench;
        leaning.times_s.push(at_s);
        leaning.leans.push(on_tyres.lean(ground));
        leaning.turns.push(turned);
    }
    leaning.loads_are_right()
}

impl Leaning {
    fn loads_are_right(&self) -> Option<f64> {
        let count = self.times_s.len();
        if count < FEWEST {
            return None;
        }
        let [leans, turns] = [&self.leans, &self.turns].map(|values| self.without_trend(values));
        // a gyro that works has noise
        if turns.iter().all(|turn| turn.norm() < STUCK_RAD) {
            return None;
        }
        let pairs = || leans.iter().zip(&turns);
        let squares = pairs().map(|(lean, _)| lean.dot(lean)).sum::<f64>();
        let share = pairs().map(|(lean, turn)| lean.dot(turn)).sum::<f64>() / squares;
        let rest = pairs()
            .map(|(lean, turn)| (turn - lean * share).norm_squared())
            .sum::<f64>();
        let mean = |squares: f64| (squares / count as f64).sqrt();
        lean_shows_loads(share, [mean(squares), mean(rest)])
    }

    /// Values without their mean, and without what changes evenly in time.
    fn without_trend(&self, values: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        let count = self.times_s.len() as f64;
        let middle_s = self.times_s.iter().sum::<f64>() / count;
        let mean = values.iter().copied().sum::<Vector2<f64>>() / count;
        let (mut slope, mut squares) = (Vector2::zeros(), 0.0);
        for (time_s, value) in self.times_s.iter().zip(values) {
            slope += (value - mean) * (time_s - middle_s);
            squares += (time_s - middle_s).powi(2);
        }
        slope /= squares;
        let each = self.times_s.iter().zip(values);
        each.map(|(time_s, value)| value - mean - slope * (time_s - middle_s))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lean to both sides within half a second, of which the platform shows a share, by a gyro with a bias (rad/s) and noise.
    fn leaning(largest: f64, share: f64, bias: f64) -> Leaning {
        let mut leaning = Leaning::default();
        for step in 0..100 {
            let at_s = f64::from(step) * 0.01;
            let lean = match (0.25..0.75).contains(&at_s) {
                true => largest * ((at_s - 0.25) * 4.0 * std::f64::consts::PI).sin(),
                false => 0.0,
            };
            leaning.times_s.push(at_s);
            leaning.leans.push(Vector2::new(lean, 0.1 * lean));
            let turn = Vector2::new(share * lean, 0.1 * share * lean);
            let noise = Vector2::new(1e-5, 0.0) * (311.0 * at_s).sin();
            leaning
                .turns
                .push(turn + noise + Vector2::new(bias, -bias) * at_s);
        }
        leaning
    }

    #[test]
    fn loads_that_the_platform_does_not_show_are_wrong() {
        for bias in [0.0, 0.02] {
            let right = |share: f64| leaning(0.015, share, bias).loads_are_right();
            assert!(right(0.0).unwrap() < 0.5, "{bias} rad/s: {:?}", right(0.0));
            // on tyres that are stiffer, and on soft ground
            assert!(right(0.6).unwrap() > 0.98, "{bias} rad/s: {:?}", right(0.6));
            assert!(right(1.5).unwrap() > 0.99, "{bias} rad/s: {:?}", right(1.5));
        }
        // hardly any lean tells nothing, and neither does a platform that turns in another way
        assert_eq!(leaning(0.001, 0.0, 0.0).loads_are_right(), None);
        let mut turns = leaning(0.015, 0.0, 0.0);
        for (turn, time_s) in turns.turns.iter_mut().zip(&turns.times_s) {
            turn.y = 0.02 * (8.0 * time_s).sin();
        }
        assert_eq!(turns.loads_are_right(), None);
    }

    #[test]
    fn a_gyro_that_sticks_shows_no_lean() {
        for bias in [0.0, 0.02] {
            let mut leaning = leaning(0.015, 0.0, bias);
            for (turn, time_s) in leaning.turns.iter_mut().zip(&leaning.times_s) {
                *turn = Vector2::new(bias, -bias) * *time_s;
            }
            assert_eq!(leaning.loads_are_right(), None, "{bias} rad/s");
        }
    }
}
