//! What a step of the stabiliser gives.

use crate::suspended_machine::MAX_ACTUATORS;

/// The next motion of the suspension's rods, in the order of its linkages; zero for actuators that the
/// machine does not have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// How many actuators the machine has.
    pub actuators: usize,
    /// Acceleration over the step (m/s^2): xdd of (31).
    pub acceleration: [f64; MAX_ACTUATORS],
    /// Velocity at its end (m/s): xd.
    pub velocity: [f64; MAX_ACTUATORS],
    /// Position at its end (m): x, the reference x_r of the valve law (36).
    pub position: [f64; MAX_ACTUATORS],
    /// How it was found.
    pub status: Status,
    /// Whether the valves should close instead of following the position: nothing is known that is worth
    /// following.
    pub hold: bool,
    /// Cost (30) of the best point found; NaN where no problem was solved.
    pub cost: f64,
    /// The optimum in the problem's variables: in look-ahead mode where the rods are led (m), in literal
    /// mode their acceleration (m/s^2); NaN where no problem was solved.
    pub target: [f64; MAX_ACTUATORS],
    /// Iterations of the search.
    pub iterations: usize,
    /// How many motions of the suspension were looked at.
    pub evaluations: usize,
}

/// How a command was found, from best to worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Status {
    /// The optimum.
    Optimal,
    /// The best point seen when the bounded work was done; all margins are kept.
    WorkLimit,
    /// No motion within the limits keeps all loads and angles: the smallest margin is made as large as it
    /// can be. An alarm.
    MarginLost,
    /// Literal mode: the arm's posture now makes the step steer the wrong way; the rods stop.
    StepTooShort,
    /// The rods are where, or as fast as, they should not be: they brake. An alarm.
    OutsideLimits,
    /// A number of the state is missing or no number: the rods stop, and hold from the second such step
    /// on. An alarm.
    NoSolution,
    /// A position or velocity of a rod is no number: hold. An alarm.
    PositionUnknown,
}

impl Status {
    /// Whether somebody has to be told.
    #[must_use]
    pub fn is_alarm(self) -> bool {
        self >= Self::MarginLost
    }

    /// Its name in logs.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Optimal => "optimal",
            Self::WorkLimit => "work_limit",
            Self::MarginLost => "margin_lost",
            Self::StepTooShort => "step_too_short",
            Self::OutsideLimits => "outside_limits",
            Self::NoSolution => "no_solution",
            Self::PositionUnknown => "position_unknown",
        }
    }
}

impl Command {
    pub(super) fn blank(actuators: usize, status: Status) -> Self {
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
