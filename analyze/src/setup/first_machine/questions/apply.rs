//! Puts an answer into the draft.

use super::answer::Answer;
use super::open_value::Subject;
use crate::setup::first_machine::draft::Draft;
use crate::setup::first_machine::guesses::StatedPosition;

/// Puts an answer into the draft. A standard deviation is asked as two of them.
pub(super) fn apply(draft: &mut Draft, subject: &Subject, answer: Answer) {
    match answer {
        Answer::Numbers(numbers) => apply_numbers(draft, subject, &numbers),
        Answer::Names(names) => {
            let stated = &mut draft.stated;
            match subject {
                Subject::Supports => stated.supports = names,
                Subject::Raised => stated.raised = names,
                _ => stated.free_joints = names,
            }
        }
        Answer::Signal(table) => {
            if let (Some(guesses), Subject::JointPosition(joint)) = (&mut draft.guesses, subject) {
                let stated = StatedPosition::Signal(table);
                guesses.stated.insert(joint.clone(), stated);
            }
        }
    }
}

fn apply_numbers(draft: &mut Draft, subject: &Subject, numbers: &[f64]) {
    let (stated, guesses) = (&mut draft.stated, &mut draft.guesses);
    match (subject, numbers) {
        (Subject::ImuPosition, &[x, y, z]) => stated.imu_xyz = Some([x, y, z]),
        (Subject::ImuOrientation, &[roll, pitch, yaw]) => {
            stated.imu_rpy = Some([roll, pitch, yaw]);
        }
        (Subject::Payload, &[mass]) => stated.payload = Some(mass),
        (Subject::TyreStiffness, &[stiffness]) => stated.tyre_stiffness = Some(stiffness),
        (Subject::RollMomentDistribution, &[share]) => {
            stated.roll_moment_distribution = Some(share);
        }
        (Subject::ToolMass(_), &[twice]) => stated.tool_mass_sigma = Some(0.5 * twice),
        (Subject::OtherMasses(_), &[twice]) => {
            stated.uncertainty.push(("mass_share", 0.5 * twice));
        }
        (Subject::CentresOfMass, &[twice]) => stated.uncertainty.push(("com", 0.5 * twice)),
        (Subject::WheelPositions, &[twice]) => {
            stated.uncertainty.push(("wheel_position", 0.5 * twice));
        }
        _ => {}
    }
    let Some(guesses) = guesses else {
        return;
    };
    match (subject, numbers) {
        (Subject::WheelRadius(name), &[radius]) => {
            for wheel in guesses
                .wheels
                .iter_mut()
                .filter(|wheel| wheel.name == *name)
            {
                wheel.radius = Some((radius, "stated at the terminal".into()));
                wheel.is_doubtful = false;
            }
        }
        (Subject::Eyes { linkage, .. }, &[x, y, z, u, v, w]) => {
            guesses.release(linkage, [[x, y, z], [u, v, w]]);
        }
        (Subject::JointField(name), &[scale, offset]) => {
            for guess in guesses
                .joints
                .iter_mut()
                .filter(|guess| guess.joint == *name)
            {
                guess.confirm(scale, offset);
            }
        }
        (Subject::JointPosition(name), &[position]) => {
            let stated = StatedPosition::Constant(position);
            guesses.stated.insert(name.clone(), stated);
        }
        (Subject::ImuPosition | Subject::ImuOrientation, _) => {
            let (xyz, rpy) = (draft.stated.imu_xyz, draft.stated.imu_rpy);
            draft.imu.state(&guesses.outline.base_link, xyz, rpy);
        }
        _ => {}
    }
}
