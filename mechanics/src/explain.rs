//! Results beyond the loads: derivatives, uncertainty, indicators, load contributions.

use crate::attribution::{Cause, Circumstances, attribute, attribute_links};
use crate::contact_plane::ContactPlane;
use crate::indicators::{self, Balance};
use crate::kinematics::ImuSeat;
use crate::machine::Machine;
use crate::model::Model;
use crate::number::Real;
use crate::sensitivity::SensedMotion;
use crate::spatial::Wrench;
use crate::state::State;
use crate::uncertainty;
use crate::workspace::Workspace;

/// An evaluation after the loads are computed.
pub(crate) struct Explained<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) state: &'a State<T>,
    pub(crate) plane: &'a ContactPlane<T>,
    pub(crate) seat: &'a ImuSeat<T>,
    pub(crate) tool_wrench: &'a Wrench<T>,
}

/// Computes what the scope requests. The analytic model gets only indicators: its own terms are its load
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
            whole: &w.groups.sets[0],
            motions: &w.motions,
            sensitivity: w.scope.sensitivities.then_some(&w.sensitivity),
        };
        if whole_body {
            indicators::fill(&balance, &mut w.outcome);
        } else {
            indicators::fill_what_needs_no_wrench(&balance, &mut w.outcome);
        }
    }
    if whole_body && w.scope.causes {
        find_causes(it, w);
    }
    if whole_body && w.scope.parts {
        let (influences, out) = (w.influences.by_rule(), &mut w.outcome);
        attribute_links(it.machine, &w.motions, influences, &mut out.parts);
    }
}

fn derive<T: Real>(it: &Explained<'_, T>, w: &mut Workspace<T>) {
    let motion = SensedMotion {
        machine: it.machine,
        state: it.state,
        seat: it.seat,
        coordinates: &w.coordinates,
        motions: &w.motions,
        wrenches: &w.wrenches,
        groups: &w.groups,
        actuations: &w.actuations,
        tool_wrench: it.tool_wrench,
        centres: &w.wheel_centres,
    };
    w.sensitivity.fill(&motion, &w.influences);
    let noise = &it.state.noise;
    let measured = w.solver.measured_variances(&w.equations);
    let out = &mut w.outcome;
    uncertainty::fill(it.machine, &w.sigmas, noise, &w.sensitivity, measured, out);
}

fn find_causes<T: Real>(it: &Explained<'_, T>, w: &mut Workspace<T>) {
    let circumstances = Circumstances {
        machine: it.machine,
        base: &w.motions[0],
        known: &it.state.base,
        normal: &it.plane.normal,
    };
    let (influences, out) = (w.influences.by_rule(), &mut w.outcome);
    attribute(
        &circumstances,
        &w.groups,
        &w.motions,
        influences,
        &mut out.causes,
    );
    let by_rule = w.solver.rule_or_otf_response(&w.equations);
    for (wheel, causes) in out.causes.iter_mut().enumerate() {
        let mut warp = by_rule.by_heights(&w.equations, wheel);
        if w.equations.are_measured() {
            warp += out.otf[wheel] - w.otf_by_rule[wheel];
        }
        causes[Cause::Warp as usize] = warp;
        causes[Cause::LiftOff as usize] = out.load[wheel] - out.otf[wheel];
    }
}
