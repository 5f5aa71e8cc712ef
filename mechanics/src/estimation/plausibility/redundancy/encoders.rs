//! Encoders that may have stopped: their positions repeat bit for bit while another joint's do not.
//!
//! By itself this is no fault: a joint at rest may report the same number again and again.

use crate::machine::Machine;

/// Time for which a position must repeat (s).
const STILL_S: f64 = 0.5;
/// Time within which another position must have changed (s).
const ALIVE_S: f64 = 0.1;

/// Last change of each joint but the wheels'.
#[derive(Debug, Clone)]
pub(super) struct Encoders {
    /// Last position, and the stamp at which it was new; `None` before the first one.
    last: Vec<Option<(f64, i64)>>,
    spins: Vec<bool>,
}

impl Encoders {
    pub(super) fn new(machine: &Machine) -> Self {
        let spins = machine.joints().iter().map(|j| j.spins_wheel.is_some());
        Self {
            last: vec![None; machine.joints().len()],
            spins: spins.collect(),
        }
    }

    /// Takes a position of a joint.
    pub(super) fn take(&mut self, stamp_ns: i64, joint: usize, position: f64) {
        let last = &mut self.last[joint];
        if last.is_none_or(|(before, _)| before.to_bits() != position.to_bits()) {
            *last = Some((position, stamp_ns));
        }
    }

    /// Whether one may have stopped.
    pub(super) fn one_may_have_stopped(&self, stamp_ns: i64) -> bool {
        let ages = self.last.iter().zip(&self.spins);
        let ages = ages.filter(|(_, spins)| !**spins).filter_map(|(last, _)| {
            let (_, since_ns) = (*last)?;
            Some(stamp_ns.saturating_sub(since_ns) as f64 * 1e-9)
        });
        let (mut still, mut alive) = (false, false);
        for age_s in ages {
            still |= age_s > STILL_S;
            alive |= age_s < ALIVE_S;
        }
        still && alive
    }
}
