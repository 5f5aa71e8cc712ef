//! Estimates and explanations as phrases.

use super::estimate::{Estimate, Relation};
use tipwatch_mechanics::machine::Machine;

/// "likely A, or B".
pub(super) fn likely(explanations: &[String]) -> String {
    match explanations {
        [one] => format!("likely {one}"),
        all => format!("either {}", all.join(", or ")),
    }
}

pub(super) fn list(texts: &[String]) -> String {
    const MOST: usize = 4;
    match texts.len() {
        0..=MOST => texts.join("; "),
        more => format!("{}; and {} more", texts[..MOST].join("; "), more - MOST),
    }
}

/// An estimate as a phrase.
pub(super) fn describe(machine: &Machine, estimate: &Estimate) -> String {
    let name = |joint: usize| &machine.joints()[joint].name;
    let axis = |k: usize| ["x", "y", "z"][k];
    let Estimate {
        value,
        sigma,
        expected,
        ..
    } = *estimate;
    let plain = |what: String| format!("{what} {value:.3} ± {sigma:.3}, expected {expected}");
    let degrees = |what: &str| {
        format!(
            "{what} {:.1} ± {:.1} degrees, expected 0",
            value.to_degrees(),
            sigma.to_degrees()
        )
    };
    match estimate.relation {
        Relation::Gravity => plain("specific force at rest, over gravity:".into()),
        Relation::Up => degrees("specific force at rest against the machine's up direction:"),
        Relation::Drive(row, column) => plain(format!(
            "specific force {} per acceleration {} by the travel:",
            ["forward", "to the left"][row],
            ["forward", "to the left"][column]
        )),
        Relation::DriveDirection => {
            degrees("direction of the specific force against the acceleration by the travel:")
        }
        Relation::Mount(k) => degrees(&format!(
            "tilt of the IMU about {}, apart from the slope:",
            axis(k)
        )),
        Relation::AttitudeTilt(k) => plain(format!(
            "tilt by the specific force per tilt by the orientation, along {}:",
            axis(k)
        )),
        Relation::AttitudeUp => {
            degrees("up by the orientation against the specific force at rest:")
        }
        Relation::Turn(source, k) => plain(format!(
            "angular velocity about {} per yaw rate by {}:",
            axis(k),
            source.words()
        )),
        Relation::Rocking(row, column) => plain(format!(
            "{} rate by the orientation per {} rate:",
            ["roll", "pitch"][row],
            ["roll", "pitch"][column]
        )),
        Relation::WheelOrder(a, b) => plain(format!(
            "how much faster {} than {} rolls in curves, over what their paths require:",
            name(a),
            name(b)
        )),
        Relation::Wheel(joint) => plain(format!("rotation of {} per travel:", name(joint))),
        Relation::WheelSide(joint) => plain(format!(
            "rotation of {} in a curve, by the side that it is on:",
            name(joint)
        )),
        Relation::WheelCurve(joint) => plain(format!(
            "rotation of {} off its path in curves, as a share:",
            name(joint)
        )),
        Relation::Steer(joint) => plain(format!(
            "angle of {} per angle at which its wheel does not slip:",
            name(joint)
        )),
        Relation::SteerOff(joint) => plain(format!(
            "angle of {} off that at which its wheel does not slip, as a share:",
            name(joint)
        )),
        Relation::Lean(joint) if value < -1.2 => format!(
            "the platform does not lean as the motion of {} should make it",
            name(joint)
        ),
        Relation::Lean(joint) if value > 10.0 => format!(
            "the positions of {} are impossible: a linkage cannot close",
            name(joint)
        ),
        Relation::Lean(joint) => format!(
            "lean of the platform per lean by the motion of {}: {:.2} ± {:.2}, expected 1",
            name(joint),
            value.exp(),
            value.exp() * sigma
        ),
        Relation::LeanUnexplained(joint) => format!(
            "{:.0} ± {:.0} % of the platform's lean do not follow {}",
            value * 100.0,
            sigma * 100.0,
            name(joint)
        ),
        Relation::Still(joint) => format!(
            "the platform leans by {:.2} mrad as if {} moved",
            value * 1e3,
            name(joint)
        ),
        Relation::Rate(joint) => plain(format!(
            "velocity of {} per change of its position:",
            name(joint)
        )),
        Relation::Range(joint) => format!(
            "{} goes beyond its limits by {:.0} % of their span",
            name(joint),
            value * 100.0
        ),
    }
}
