//! Plausibility checks: detection of sensor values that cannot be true.
//!
//! [`Plausibility`] checks the raw samples one by one, before they are processed. It keeps a few numbers per
//! signal and does not allocate in a step, so the same checks serve a whole log and a live monitor. A fault is
//! reported as a [`Finding`]; the policy in the machine file decides whether rows that depend on it are
//! invalidated, widened or merely reported. [`FaultSpans`] merges the findings of a log.
//!
//! | fault | of | criterion |
//! |---|---|---|
//! | `not_finite` | every signal | NaN or infinity; a velocity or attitude that was never given is absent, not faulty |
//! | `out_of_range` | vectors | norm beyond the range of such a sensor or machine |
//! | `out_of_range` | specific force | its mean length over two seconds is that of no machine |
//! | `joint_limit` | joints | position beyond the URDF's limits and a margin |
//! | `impossible_rate` | joints, angular velocity, odometry | change since the last credible sample too fast; measured velocity too large |
//! | `saturated` | vectors | an axis repeats its largest or least value although the other axes are shaken |
//! | `outlier` | vectors, joints, attitudes | one sample far from those around it: it is left out, and rows stay valid |
//! | `frozen` | every signal | identical bits repeat: after noise, during motion detected elsewhere, or at a joint with velocity; one axis while the others are shaken |
//! | `not_unit` | attitudes | non-unit quaternion |
//! | `disagreement` | joints | the change of position differs from the integral of the velocity |
//! | `disagreement` | attitude of the IMU | gravity according to the attitude differs from the specific force |
//! | `contradiction` | joints | the position jumped and stays: before or since then it is wrong |
//! | `contradiction` | joints | it froze in motion and goes on from there: it has lost counts |
//! | `contradiction` | specific force | it stepped and stays, and no velocity changes as that requires |
//! | `contradiction` | attitude of the IMU | the inclination jumped and stays, and the gyro did not turn |
//! | `contradiction` | arm and gyro | the platform does not lean on its tyres as the motion of the arm requires |
//! | `contradiction` | gyro and attitude | the attitude turns otherwise than the angular velocity |
//! | `contradiction` | gyro and odometry, wheels, steering | the machine turns otherwise about the vertical |
//! | `contradiction` | specific force and wheels | one speeds up while the other slows down |
//! | `contradiction` | odometry and wheels | they go in opposite directions |
//! | `contradiction` | specific force | differs from that by attitude, angular velocity and odometry |
//! | `contradiction` | attitudes | IMU and odometry measure different inclinations |

mod attitude;
mod axes;
mod checks;
mod explanation;
mod false_alarms;
mod fault;
mod flicker;
mod freeze;
mod gravity;
mod joint;
mod notice;
mod outliers;
mod pace;
mod relations;
mod signal_doubt;
mod signals;
mod spans;
mod treatment;
mod turning;
mod vector;
mod weight;

pub use checks::Plausibility;
pub(super) use checks::room_for_findings;
pub use explanation::{Explanation, SpeedUnit};
pub use fault::{Amount, Component, Finding, Part, YawBy};
pub use freeze::are_shown_to_be_measured;
pub(super) use relations::Relations;
pub use relations::{Excitation, LeanOnTyres, Unshown, lean_shows_loads, student};
pub use signal_doubt::{Inherited, KnownPosition, SignalDoubt};
pub(super) use signals::{SignalChecks, Sound};
pub(crate) use spans::SpanWalk;
pub use spans::{FaultSpan, FaultSpans};
pub use treatment::Judgement;
pub(crate) use treatment::{RowEffect, Treatment};
