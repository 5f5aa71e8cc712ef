//! The platform on its tyres: the normal of the ground that the evaluation gives for the joints' positions.

use nalgebra::Vector3;

use super::moved::MovedAlone;
use super::signals::View;
use tipwatch_mechanics::Scope;
use tipwatch_mechanics::Workspace;
use tipwatch_mechanics::evaluate;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::State;

/// Standard deviation of the logarithm of the tyres' stiffness where the machine file states it, and where it does not.
const STATED: f64 = 0.35;
const UNSTATED: f64 = 1.2;
/// Deflection of the mean tyre where its stiffness is not stated (m).
const DEFLECTION: f64 = 0.015;

/// The platform on its tyres.
#[derive(Debug)]
pub(super) struct Platform {
    pub(super) machine: Machine,
    pub(super) stiffness_sigma: f64,
}

impl Platform {
    pub(super) fn new(machine: &Machine) -> Self {
        let mut resting = machine.with_imu_at_base();
        let is_stated = resting.complete_tyre_stiffness(DEFLECTION);
        resting.leave_out_actuator_forces();
        Self {
            machine: resting,
            stiffness_sigma: if is_stated { STATED } else { UNSTATED },
        }
    }

    /// Normal of the ground in base axes on level ground, with the joints at the medians of their positions.
    pub(super) fn level_normal(&self, view: &View) -> Vector3<f64> {
        let mut state = State::<f64>::zero(&self.machine);
        for (columns, motion) in view.joints.iter().zip(&mut state.joints) {
            let mut known: Vec<f64> = columns
                .position
                .iter()
                .copied()
                .filter(|p| p.is_finite())
                .collect();
            known.sort_by(f64::total_cmp);
            if let Some(&median) = known.get(known.len() / 2) {
                motion.position = median;
            }
        }
        state.imu.specific_force = Vector3::z() * self.machine.gravity();
        let mut workspace = Workspace::with_scope(&self.machine, Scope::LOADS);
        let normal = evaluate(&self.machine, &state, &mut workspace).contact_normal;
        let is_known = normal.iter().all(|x| x.is_finite());
        if is_known { normal } else { Vector3::z() }
    }

    /// The normals that the joints' motions predict.
    pub(super) fn predict(&self, view: &View, moved: &[MovedAlone]) -> Predicted {
        let of_run = |run: &std::ops::Range<usize>| self.normals(view, widened(run, view.bins));
        let of_joint = |moved: &MovedAlone| moved.runs.iter().map(of_run).collect();
        Predicted(moved.iter().map(of_joint).collect())
    }

    /// The normal in these bins, x and y, and the share of the bins in which the linkages cannot close.
    fn normals(&self, view: &View, bins: std::ops::Range<usize>) -> ([Vec<f64>; 2], f64) {
        let mut state = State::<f64>::zero(&self.machine);
        let mut workspace = Workspace::with_scope(&self.machine, Scope::LOADS);
        let mut normals = [Vec::new(), Vec::new()];
        let mut impossible = 0;
        let count = bins.len();
        for bin in bins {
            view.set_joints(bin, &mut state);
            state.imu.specific_force = view.force[bin];
            let outcome = evaluate(&self.machine, &state, &mut workspace);
            impossible += usize::from(outcome.linkage_closure < 0.0);
            normals[0].push(outcome.contact_normal.x);
            normals[1].push(outcome.contact_normal.y);
        }
        (normals, impossible as f64 / count.max(1) as f64)
    }
}

/// Predicted normals: by joint that moved alone and by run, x and y in each bin, and the share of bins with a posture in
/// which the linkages cannot close.
#[derive(Debug, Clone)]
pub(super) struct Predicted(pub(super) Vec<Vec<([Vec<f64>; 2], f64)>>);

/// A run with the bins around it that filters need.
pub(super) fn widened(run: &std::ops::Range<usize>, bins: usize) -> std::ops::Range<usize> {
    run.start.saturating_sub(2)..(run.end + 2).min(bins)
}
