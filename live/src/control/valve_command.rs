//! The command to the valves as the control keeps it.

use tipwatch_suspension::{MAX_ACTUATORS, Status};

use crate::safety_limits::{CLOSING_RATE, HEARTBEAT_NS};
use crate::wire::command::{HoldReason, HoldReasons, Mode, status_number};
use crate::wire::topics::WireCommand;

/// What the valves do now, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ValveCommand {
    pub(super) mode: Mode,
    pub(super) reasons: HoldReasons,
    /// Opening of each valve, -1 to 1.
    pub(super) opening: [f64; MAX_ACTUATORS],
    /// When the openings last changed (ns).
    pub(super) moved_ns: i64,
    /// Where each rod should be now (m), and how fast it should move (m/s); NaN while valves close.
    pub(super) reference: [f64; MAX_ACTUATORS],
    pub(super) velocity: [f64; MAX_ACTUATORS],
    pub(super) solution: Solution,
}

/// The optimiser's last solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Solution {
    /// `None`: it was not asked since the valves last closed.
    pub(super) status: Option<Status>,
    pub(super) cost: f64,
    pub(super) target: [f64; MAX_ACTUATORS],
    pub(super) iterations: usize,
    pub(super) evaluations: usize,
}

impl Solution {
    const NONE: Self = Self {
        status: None,
        cost: f64::NAN,
        target: [f64::NAN; MAX_ACTUATORS],
        iterations: 0,
        evaluations: 0,
    };
}

impl ValveCommand {
    /// Closed valves.
    pub(super) fn closed(now_ns: i64) -> Self {
        let mut reasons = HoldReasons::default();
        reasons.note(HoldReason::NoRow, true);
        Self {
            mode: Mode::Hold,
            reasons,
            opening: [0.0; MAX_ACTUATORS],
            moved_ns: now_ns,
            reference: [f64::NAN; MAX_ACTUATORS],
            velocity: [f64::NAN; MAX_ACTUATORS],
            solution: Solution::NONE,
        }
    }

    pub(super) fn is_closed(&self) -> bool {
        self.opening.iter().all(|&opening| opening == 0.0)
    }

    /// Closes the valves, no faster than [`CLOSING_RATE`].
    pub(super) fn close(&mut self, reasons: HoldReasons, now_ns: i64) {
        // no valve jumps, however long this process was held up
        let elapsed_ns = now_ns.saturating_sub(self.moved_ns).clamp(0, HEARTBEAT_NS);
        let reach = CLOSING_RATE * elapsed_ns as f64 * 1e-9;
        let mut opening = self.opening;
        for opening in &mut opening {
            *opening -= opening.clamp(-reach, reach);
        }
        *self = Self {
            opening,
            reasons,
            ..Self::closed(now_ns)
        };
        if !self.is_closed() {
            self.mode = Mode::Ramp;
        }
    }

    /// Writes the command into a message.
    pub(super) fn write_to(&self, message: &mut WireCommand) {
        message.mode = self.mode as u32;
        message.reasons = self.reasons.bits();
        message.opening = self.opening;
        message.reference = self.reference;
        message.velocity = self.velocity;
        message.status = status_number(self.solution.status);
        message.cost = self.solution.cost;
        message.target = self.solution.target;
        message.iterations = self.solution.iterations as u32;
        message.evaluations = self.solution.evaluations as u32;
    }
}
