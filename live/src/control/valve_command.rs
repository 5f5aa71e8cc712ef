//! The command to the valves as the control keeps it.

use tipwatch_suspension::{MAX_ACTUATORS, Status};

use crate::safety_limits::{CLOSING_RATE, HEARTBEAT_NS};
use crate::wire::command::{HoldReason, HoldReasons, Mode, status_number};
use crate::wire::topics::WireCommand;

/// Current command to the valves, with its reasons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ValveCommand {
    pub(super) mode: Mode,
    pub(super) reasons: HoldReasons,
    /// Opening of each valve, -1 to 1.
    pub(super) opening: [f64; MAX_ACTUATORS],
    /// Time of the last change of the openings (ns).
    pub(super) moved_ns: i64,
    /// Reference stroke (m) and velocity (m/s) of each rod; NaN while valves close.
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

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn open(opening: f64) -> ValveCommand {
        let mut command = ValveCommand {
            mode: Mode::Follow,
            reasons: HoldReasons::default(),
            ..ValveCommand::closed(0)
        };
        command.opening[0] = opening;
        command
    }

    fn fault() -> HoldReasons {
        let mut reasons = HoldReasons::default();
        reasons.note(HoldReason::Input, true);
        reasons
    }

    #[test]
    fn valves_close_at_their_rate_from_either_side() {
        for (opening, after_ns, expected) in [
            (0.5, 10 * MS, 0.46),
            (-0.5, 10 * MS, -0.46),
            // no further than closed
            (0.03, 10 * MS, 0.0),
            (-0.03, 10 * MS, 0.0),
            // neither back in time nor by a jump after a pause
            (0.5, -10 * MS, 0.5),
            (0.5, HEARTBEAT_NS, 0.42),
            (0.5, HEARTBEAT_NS + MS, 0.42),
        ] {
            let mut command = open(opening);
            command.close(fault(), after_ns);
            assert!((command.opening[0] - expected).abs() < 1e-12, "{command:?}");
            assert_eq!(command.opening[1..], [0.0; MAX_ACTUATORS - 1]);
            assert_eq!(command.reasons, fault());
            assert_eq!(command.moved_ns, after_ns);
            let is_closed = expected == 0.0;
            assert_eq!(command.is_closed(), is_closed);
            let mode = if is_closed { Mode::Hold } else { Mode::Ramp };
            assert_eq!(command.mode, mode);
            assert_eq!(command.solution.status, None);
            assert!(command.reference.iter().all(|number| number.is_nan()));
        }
    }

    #[test]
    fn messages_carry_the_whole_command() {
        let mut command = open(0.25);
        command.reference[0] = -0.1;
        command.velocity[0] = 0.02;
        command.solution = Solution {
            status: Some(Status::Optimal),
            cost: 5.0,
            target: [-0.05; MAX_ACTUATORS],
            iterations: 6,
            evaluations: 7,
        };
        let mut message = WireCommand::closed();
        command.write_to(&mut message);
        assert_eq!(message.mode(), Mode::Follow);
        assert!(message.reasons().is_empty());
        assert_eq!(message.opening, command.opening);
        assert_eq!((message.reference[0], message.velocity[0]), (-0.1, 0.02));
        assert_eq!(message.status(), Some(Status::Optimal));
        assert_eq!(
            (message.cost, message.target),
            (5.0, [-0.05; MAX_ACTUATORS])
        );
        assert_eq!((message.iterations, message.evaluations), (6, 7));
    }
}
