//! Angles that start anew after each turn, at pi or at two pi: a wheel and a slewing joint turn on, and so do their filters.

use std::f64::consts::{PI, TAU};

use super::kalman_filter::KalmanFilter;
use crate::machine::Machine;
use crate::state::Sensors;

/// Rounding of an angle within a turn (rad).
const ROUNDING: f64 = 1e-3;

/// Returns the step the shorter way round (rad): a position may have begun a new turn.
pub(in crate::estimation) fn shorter_way(step: f64) -> f64 {
    match step.abs() > PI {
        true => step - TAU * (step / TAU).round(),
        false => step,
    }
}

/// The joints that may turn without end.
#[derive(Debug, Clone, Default)]
pub(super) struct Turns {
    /// By stream: whether each of its joints may turn a whole turn.
    may_turn: Vec<Vec<bool>>,
    /// Positions of one sample.
    counted: Vec<f64>,
}

impl Turns {
    pub(super) fn new(machine: &Machine, sensors: &Sensors) -> Self {
        let streams = sensors.joints.iter();
        let may_turn: Vec<Vec<bool>> = streams
            .map(|stream| {
                (stream.joints.iter())
                    .map(|&joint| machine.joint_turns(joint))
                    .collect()
            })
            .collect();
        let most = may_turn.iter().map(Vec::len).max().unwrap_or(0);
        Self {
            may_turn,
            counted: Vec::with_capacity(most),
        }
    }

    /// The positions with the turns that their filter has counted: an angle within one turn is moved by whole turns next to
    /// where the filter expects it. Others stay as they are, to the bit.
    pub(super) fn counted<'p>(
        &'p mut self,
        stream: usize,
        stamp_ns: i64,
        positions: &'p [f64],
        filter: &KalmanFilter,
    ) -> &'p [f64] {
        let may_turn = &self.may_turn[stream];
        let turns = |channel: usize| match may_turn[channel] {
            true => turns(positions[channel], filter.expected(channel, stamp_ns)?),
            false => None,
        };
        if (0..positions.len()).all(|channel| turns(channel).is_none()) {
            return positions;
        }
        self.counted.clear();
        let counted = positions.iter().enumerate();
        let counted = counted.map(|(channel, &position)| {
            turns(channel).map_or(position, |turns| position + TAU * turns)
        });
        self.counted.extend(counted);
        &self.counted
    }
}

/// The whole turns between an angle within one turn and that which is expected; `None` if there are none.
fn turns(angle: f64, expected: f64) -> Option<f64> {
    let is_within_a_turn = (-PI - ROUNDING..=TAU + ROUNDING).contains(&angle);
    let turns = ((expected - angle) / TAU).round();
    (is_within_a_turn && turns != 0.0 && turns.is_finite()).then_some(turns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_that_start_anew_turn_on() {
        for start in [-PI, 0.0] {
            let mut counted = 0.0;
            for k in 0..2000 {
                let true_angle = 0.37 * f64::from(k) - 5.0;
                let logged = (true_angle - start).rem_euclid(TAU) + start;
                // the first one is where it is
                let expected = if k == 0 { logged } else { counted + 0.37 };
                counted = logged + TAU * turns(logged, expected).unwrap_or(0.0);
                let apart = (counted - true_angle) / TAU;
                assert!((apart - apart.round()).abs() < 1e-9);
                if k > 0 {
                    assert!((counted - expected).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn angles_that_count_their_turns_are_left_alone() {
        assert_eq!(turns(700.0, 690.0), None);
        assert_eq!(turns(0.5, 3.6), None);
        assert_eq!(turns(0.5, f64::NAN), None);
        assert_eq!(turns(f64::NAN, 0.5), None);
    }
}
