//! Results beyond the loads: derivatives, uncertainty, indicators, load contributions.

use crate::dynamics::kinematics::SensorFrame;
use crate::evaluate::model::Model;
use crate::evaluate::workspace::Workspace;
use crate::explain::attribution::{Circumstances, Contribution, attribute, attribute_links};
use crate::explain::indicators::{self, Balance};
use crate::explain::sensitivity::SensedMotion;
use crate::explain::uncertainty::{LoadSigmas, utilisation};
use crate::geometry::contact_plane::ContactPlane;
use crate::geometry::spatial::Wrench;
use crate::machine::Machine;
use crate::number::Real;
use crate::state::State;

/// An evaluation after the loads are computed.
pub(crate) struct Explained<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) state: &'a State<T>,
    pub(crate) plane: &'a ContactPlane<T>,
    pub(crate) sensor_frame: &'a SensorFrame<T>,
    pub(crate) tool_wrench: &'a Wrench<T>,
}

/// Computes the quantities that the scope requests. The analytic model gets only indicators: its own terms are its load
/// contributions.
pub(crate) fn explain<T: Real>(it: &Explained<'_, T>, w: &mut Workspace<T>, model: &Model) {
    let whole_body = matches!(model, Model::WholeBody);
    if whole_body && w.scope.sensitivities {
        derive(it, w);
    }
    if w.scope.indicators {
        let balance = Balance {
            machine: it.machine,
            state: it.state,
            plane: it.plane,
            contacts: &w.contacts,
            tipping_lines: &w.tipping_lines,
            whole: &w.groups.sets[0],
            motions: &w.motions,
            ground_wrench: &w.outcome.ground_wrench,
            otf: &w.outcome.otf,
            load: &w.outcome.load,
            sensitivity: w.scope.sensitivities.then_some(&w.sensitivity),
        };
        if whole_body {
            indicators::fill(&balance, &mut w.outcome.indicators);
        } else {
            indicators::fill_wrench_free(&balance, &mut w.outcome.indicators);
        }
    }
    if whole_body && w.scope.contributions {
        find_causes(it, w);
    }
    if whole_body && w.scope.parts {
        let (adjoints, out) = (w.adjoints.by_rule(), &mut w.outcome);
        attribute_links(it.machine, &w.motions, adjoints, &mut out.parts);
    }
}

fn derive<T: Real>(it: &Explained<'_, T>, w: &mut Workspace<T>) {
    w.sensitivity.take_moments(&mut w.groups.bodies);
    let motion = SensedMotion {
        machine: it.machine,
        state: it.state,
        sensor_frame: it.sensor_frame,
        coordinates: &w.coordinates,
        motions: &w.motions,
        wrenches: &w.wrenches,
        groups: &w.groups,
        actuations: &w.actuations,
        tool_wrench: it.tool_wrench,
        centres: &w.wheel_centres,
    };
    let split = w.solver.split_variances(&w.equations);
    let out = &mut w.outcome;
    let (otf, loads) = (&out.otf, (out.normal_force, &out.load[..]));
    let sigmas = LoadSigmas::new(it.machine, &w.sigmas, it.state, loads, split);
    let (out, squares) = (&mut out.uncertainty, &mut w.squares);
    w.sensitivity.fill(&motion, &w.adjoints, |derivatives| {
        let load_sigma = sigmas.fill(derivatives, out);
        if let Some(squares) = squares {
            squares.add(derivatives, load_sigma);
        }
    });
    out.utilisation = utilisation(it.machine, otf, &out.otf);
}

fn find_causes<T: Real>(it: &Explained<'_, T>, w: &mut Workspace<T>) {
    let circumstances = Circumstances {
        machine: it.machine,
        base: &w.motions[0],
        known: &it.state.base,
        normal: &it.plane.normal,
    };
    let (adjoints, out) = (w.adjoints.by_rule(), &mut w.outcome);
    attribute(
        &circumstances,
        &w.groups,
        &w.motions,
        adjoints,
        &mut out.contributions,
    );
    let by_rule = w.solver.rule_or_otf_response(&w.equations);
    for (wheel, contributions) in out.contributions.iter_mut().enumerate() {
        let mut warp = by_rule.by_heights(&w.equations, wheel);
        if w.equations.are_measured() {
            warp += out.otf[wheel] - w.otf_by_rule[wheel];
        }
        contributions[Contribution::Warp as usize] = warp;
        contributions[Contribution::LiftOff as usize] = out.load[wheel] - out.otf[wheel];
    }
}
