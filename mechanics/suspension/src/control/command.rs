//! The result of a step of the suspension optimiser.

use crate::condensed::MAX_ACTUATORS;

/// The next motion of the suspension's rods, in the order of its linkages; entries beyond the machine's
/// actuators are zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Number of actuators.
    pub actuators: usize,
    /// Acceleration during the step (m/s^2): xdd of (31).
    pub acceleration: [f64; MAX_ACTUATORS],
    /// Velocity at the end of the step (m/s): xd.
    pub velocity: [f64; MAX_ACTUATORS],
    /// Stroke at the end of the step (m): x, the reference x_r of the valve law (36).
    pub position: [f64; MAX_ACTUATORS],
    /// Outcome of the optimisation.
    pub status: Status,
    /// Whether the valves should close instead of following the position, because no meaningful reference exists.
    pub hold: bool,
    /// Cost (30) of the best point found; NaN if no problem was solved.
    pub cost: f64,
    /// The optimum in the problem's variables: in look-ahead mode the target strokes (m), in one-step mode the
    /// accelerations (m/s^2); NaN if no problem was solved.
    pub target: [f64; MAX_ACTUATORS],
    /// Number of iterations.
    pub iterations: usize,
    /// Number of evaluations of the machine.
    pub evaluations: usize,
}

tipwatch_mechanics::named! {
    /// Outcome of the optimisation, from best to worst.
    #[derive(PartialOrd, Ord)]
    pub enum Status {
        /// The optimum was found.
        Optimal,
        /// The best point found within the bounded number of evaluations; all margins are met.
        WorkLimit,
        /// No motion within the limits meets all load and angle margins: the smallest margin is maximised. Raises an
        /// alarm.
        MarginLost,
        /// One-step mode: in the present arm posture the step would move the rods the wrong way; the rods stop.
        StepTooShort,
        /// A rod is outside its position or velocity limits and brakes. Raises an alarm.
        OutsideLimits,
        /// A value of the state is missing or not finite: the rods stop, and hold from the second such step on. Raises
        /// an alarm.
        NoSolution,
        /// A position or velocity of a rod is not finite: hold. Raises an alarm.
        PositionUnknown,
        /// The motion was restrained to what every wheel can afford: it, or the braking that ends it, would have taken
        /// load from a wheel that has none to spare.
        Restrained,
        /// A measured rod is outside the stroke of the machine file: hold. Raises an alarm.
        PositionImplausible,
        /// A rod does not obey its valve: hold. Raises an alarm.
        NotFollowing,
    }
}

impl Status {
    /// Whether the operator must be alerted.
    #[must_use]
    pub fn is_alarm(self) -> bool {
        self >= Self::MarginLost && self != Self::Restrained
    }
}

impl Command {
    pub(crate) fn blank(actuators: usize, status: Status) -> Self {
        let none = [0.0; MAX_ACTUATORS];
        Self {
            actuators,
            acceleration: none,
            velocity: none,
            position: none,
            status,
            hold: false,
            cost: f64::NAN,
            target: [f64::NAN; MAX_ACTUATORS],
            iterations: 0,
            evaluations: 0,
        }
    }
}
