//! The corrections that may explain a contradiction.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::correction::{Correction, JointSet, right_angles, signed_permutations};
use super::estimate::{Estimate, Relation};
use super::evidence::Evidence;
use super::question::Setting;
use super::roles::Role;

/// Whether a correction only leaves a signal out.
pub(super) fn is_omission(correction: &Correction) -> bool {
    matches!(
        correction,
        Correction::WithoutAttitude | Correction::WithoutOdometryTurning
    )
}

/// Everything that may explain a contradiction: right angles, signs, places and usual factors first, then the turn and the
/// factors that the estimates suggest.
pub(super) fn candidates(setting: &Setting<'_>, base: &Evidence) -> Vec<Correction> {
    let mut all: Vec<Correction> = right_angles()
        .into_iter()
        .map(Correction::TurnImu)
        .collect();
    all.extend([1, 2, 3].map(Correction::TurnOdometry));
    all.extend(signed_permutations().into_iter().map(Correction::GyroAxes));
    let degrees = 180.0 / std::f64::consts::PI;
    all.extend([-1.0, 1.0 / degrees, degrees, 0.5, 2.0].map(Correction::ScaleGyro));
    all.extend([-1.0, 9.806_65, 1.0 / 9.806_65, 0.5, 2.0].map(Correction::ScaleForce));
    all.extend(signed_permutations().into_iter().map(Correction::ForceAxes));
    all.extend([0.5, 2.0, 1.0 / 3.6, 3.6, 0.001, 1000.0].map(Correction::ScaleOdometry));
    let movable = setting
        .measured
        .iter()
        .filter(|&&joint| *setting.roles.of(joint) != Role::Constant);
    let movable: Vec<usize> = movable.copied().collect();
    for (place, &joint) in movable.iter().enumerate() {
        let factors = [-1.0, 1.0 / degrees, degrees, 0.5, 2.0, 0.001];
        all.extend(factors.map(|factor| Correction::ScaleJoint(joint, factor)));
        all.extend(
            movable[place + 1..]
                .iter()
                .map(|&other| Correction::SwapJoints(joint.min(other), joint.max(other))),
        );
    }
    let is_steer = |joint: &usize| matches!(setting.roles.of(*joint), Role::Steer { .. });
    let steered: Vec<usize> = movable.iter().copied().filter(is_steer).collect();
    all.extend(JointSet::of(&steered).map(Correction::FlipJoints));
    all.extend(
        [(-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(r, p)| Correction::AttitudeSigns(r, p)),
    );
    all.extend([
        Correction::WithoutAttitude,
        Correction::WithoutOdometryTurning,
    ]);
    let inverse = |relation: Relation| {
        let value = base.of(relation)?.value;
        (value.is_finite() && value.abs() > 1e-3).then(|| 1.0 / value)
    };
    all.extend(inverse(Relation::Gravity).map(Correction::ScaleForce));
    // Specific force per acceleration: an odometry that is twice too fast makes it a half.
    all.extend(
        base.of(Relation::Drive(0, 0))
            .map(|e| e.value)
            .filter(|v| v.is_finite())
            .map(Correction::ScaleOdometry),
    );
    for relation in base.0.iter().map(|e| e.relation) {
        match relation {
            Relation::Turn(_, 2) => all.extend(inverse(relation).map(Correction::ScaleGyro)),
            Relation::Wheel(joint) | Relation::Steer(joint) => {
                all.extend(inverse(relation).map(|factor| Correction::ScaleJoint(joint, factor)));
            }
            _ => {}
        }
    }
    all.extend(small_turns(base).map(Correction::TurnImu));
    all
}

/// Turns of the IMU by the angles that driving in a circle has shown.
fn small_turns(base: &Evidence) -> impl Iterator<Item = Matrix3<f64>> {
    let angle = |relation| base.of(relation).map_or(0.0, |e: &Estimate| e.value);
    let [x, y] = [0, 1].map(|axis| angle(Relation::Mount(axis)).clamp(-1.0, 1.0).asin());
    let z = -angle(Relation::DriveDirection);
    // The IMU turned by R measures R' f; the correction applies R.
    let turns = [
        Vector3::new(x, y, 0.0),
        Vector3::new(0.0, 0.0, z),
        Vector3::new(x, y, z),
    ];
    turns.into_iter().map(|turn| *Rotation3::new(turn).matrix())
}
