//! The evaluation: from a state to wheel loads.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

use crate::closed_form::Moving;
use crate::dynamics::kinematics::{self, BodyMotion, SensorFrame};
use crate::dynamics::newton_euler;
use crate::evaluate::explain::{Explained, explain};
use crate::evaluate::model::{ClosedForm, Model};
use crate::evaluate::outcome::Outcome;
use crate::evaluate::scope::Scope;
use crate::evaluate::workspace::Workspace;
use crate::explain::indicators::overturning;
use crate::geometry::contact_plane::ContactPlane;
use crate::geometry::spatial::Wrench;
use crate::machine::{Edge, Linkage, Machine};
use crate::number::Real;
use crate::state::State;
use crate::wheel_loads::{
    Actuation, DistalSubtrees, GroundForce, Loads, Standing, SupportConfiguration, distal_wrenches,
    spin,
};

/// The support solution that a workspace holds.
macro_rules! configuration {
    ($machine:expr, $w:expr, $plane:expr, $ground:expr) => {
        SupportConfiguration {
            machine: $machine,
            plane: $plane,
            ground: $ground,
            normal_force: $w.outcome.normal_force,
            centres: &$w.wheel_centres,
            radii: &$w.radii,
            motions: &$w.motions,
            distal: &$w.distal,
            actuations: &$w.actuations,
            equations: &$w.equations,
        }
    };
}

/// Wheel loads and stability of `machine` in `state`, with the workspace's model and scope.
///
/// It keeps no state between calls and does not allocate: the same input gives the same bits. Values that
/// cannot be computed are NaN: all of them where an input is NaN or a linkage cannot close, the centre of
/// pressure where the ground does not push, and the whole analytic model without an attitude.
pub fn evaluate<'w, T: Real>(
    machine: &Machine,
    state: &State<T>,
    workspace: &'w mut Workspace<T>,
) -> &'w Outcome<T> {
    let w = workspace;
    let (sensor_frame, tool_wrench) = move_machine(machine, state, w);
    for (wheel, spec) in machine.wheels.iter().enumerate() {
        w.wheel_centres[wheel] = w.motions[spec.body].point(&spec.centre_in_body);
        w.radii[wheel] = T::constant(spec.radius);
    }
    let model = Arc::clone(&w.model);
    if w.scope.needs_groups() || !matches!(*model, Model::WholeBody) {
        w.groups
            .fill(machine, state, &w.motions, &w.wrenches, &tool_wrench);
    }
    let plane = match &*model {
        Model::WholeBody => whole_body(machine, state, w, &tool_wrench),
        Model::ClosedForm(model) => closed_form(machine, state, w, model),
    };
    let out = &mut w.outcome;
    let mut loads = Loads {
        otf: &mut out.otf,
        load: &mut out.load,
        least: &mut out.load_least,
        largest: &mut out.load_largest,
    };
    w.solver
        .find_envelope(machine, &w.equations, &out.itom_full, &mut loads);
    tip_about_lines(machine, w, &plane);
    if w.scope != Scope::LOADS {
        let explained = Explained {
            machine,
            state,
            plane: &plane,
            sensor_frame: &sensor_frame,
            tool_wrench: &tool_wrench,
        };
        explain(&explained, w, &model);
    }
    &w.outcome
}

/// [`evaluate`] of one sample: compiled here, as a whole, and not again in every crate that calls it.
pub fn evaluate_one<'w>(
    machine: &Machine,
    state: &State<f64>,
    workspace: &'w mut Workspace<f64>,
) -> &'w Outcome<f64> {
    evaluate(machine, state, workspace)
}

/// The wrench that the ground exerts, as [`evaluate`] has it, without the loads that it is divided into.
pub(super) fn ground_wrench<T: Real>(
    machine: &Machine,
    state: &State<T>,
    workspace: &mut Workspace<T>,
) -> Wrench<T> {
    let (_, tool_wrench) = move_machine(machine, state, workspace);
    sum_on_ground(workspace, &tool_wrench)
}

fn sum_on_ground<T: Real>(w: &Workspace<T>, tool_wrench: &Wrench<T>) -> Wrench<T> {
    newton_euler::sum(&w.wrenches, |_| true).minus(tool_wrench)
}

/// Newton-Euler equations over every body; solved twice for tyres that deflect under load.
fn whole_body<T: Real>(
    machine: &Machine,
    state: &State<T>,
    w: &mut Workspace<T>,
    tool_wrench: &Wrench<T>,
) -> ContactPlane<T> {
    let ground = sum_on_ground(w, tool_wrench);
    distal_wrenches(machine, &w.wrenches, tool_wrench, &mut w.distal);
    Actuation::fill(machine, state, &mut w.actuations);
    let radii_differ = machine.contact.radii_differ;
    let mut plane = ContactPlane::through(&w.wheel_centres, &w.radii, radii_differ);
    stand(machine, state, w, &ground, &plane);
    let derives = w.scope.needs_influences();
    if machine.contact.tyres_deflect {
        if derives {
            let configuration = configuration!(machine, w, &plane, &ground);
            w.adjoints
                .fill_undeflected(&configuration, &w.solver, &w.outcome.load);
        }
        w.pressing.copy_from_slice(&w.outcome.load);
        // A tyre's radius decreases by load over stiffness, so the plane leans towards the heavier side. The
        // lean changes the loads by a few per mille, so one iteration suffices.
        for (wheel, spec) in machine.wheels.iter().enumerate() {
            let compliance = T::constant(spec.stiffness.map_or(0.0, |stiffness| 1.0 / stiffness));
            w.radii[wheel] -= w.outcome.load[wheel] * compliance;
        }
        plane = ContactPlane::through(&w.wheel_centres, &w.radii, true);
        stand(machine, state, w, &ground, &plane);
    }
    if derives {
        let configuration = configuration!(machine, w, &plane, &ground);
        let pressing = machine.contact.tyres_deflect.then_some(&w.pressing[..]);
        let loads = [&w.outcome.otf[..], &w.outcome.load[..]];
        w.adjoints.fill(&configuration, &w.solver, loads, pressing);
        if w.equations.are_measured() {
            share_by_rule(machine, w, &ground, &plane);
        }
    }
    write_torque_residuals(w);
    plane
}

/// Solves with the split rule in addition to the measured torques: the load contributions divide that
/// solution, and the difference due to the torques is a contribution of its own.
fn share_by_rule<T: Real>(
    machine: &Machine,
    w: &mut Workspace<T>,
    ground: &Wrench<T>,
    plane: &ContactPlane<T>,
) {
    w.equations.set_measured_aside();
    // the contributions are those of what the machine states
    let followed = GroundForce::of(&w.equations);
    let computed = GroundForce::in_plane(ground, plane);
    w.equations.set_equilibrium(&computed, &w.contacts);
    let response = w
        .solver
        .solve_by_rule(machine, &w.equations, &mut w.otf_by_rule);
    let configuration = configuration!(machine, w, plane, ground);
    w.adjoints
        .fill_by_rule(&configuration, response, &w.otf_by_rule);
    w.equations.set_equilibrium(&followed, &w.contacts);
    w.equations.take_measured_up();
}

/// Writes the number of torques used and the residual of each: measured minus predicted.
fn write_torque_residuals<T: Real>(w: &mut Workspace<T>) {
    let out = &mut w.outcome;
    out.measured_torques = w.equations.known_torques();
    for (joint, residual) in out.torque_residual.iter_mut().enumerate() {
        *residual = w.equations.residual(joint, &out.load);
    }
}

/// The analytic model: the ground balances its b1, b2, b3 at the platform's own rectangle.
fn closed_form<T: Real>(
    machine: &Machine,
    state: &State<T>,
    w: &mut Workspace<T>,
    model: &ClosedForm,
) -> ContactPlane<T> {
    let placed = model.placed(machine, &w.motions);
    let parts = &w.groups.sets[0];
    let moving = Moving {
        machine,
        motions: &w.motions,
        known: &state.base,
        arm: &parts.tool.minus(&parts.arm.wrench),
    };
    let held = w
        .outcome
        .closed_form
        .fill(&model.parts, &placed, model.input, &moving);
    let plane = placed.contact_plane();
    let below_centre = placed.pose.direction(&placed.pose.centre).xy();
    for (&wheel, contact) in model.parts.wheels().iter().zip(&placed.contacts) {
        w.contacts[wheel] = contact + below_centre;
    }
    let force = GroundForce {
        normal: held.normal,
        moment: held.moment,
    };
    w.equations.set_equilibrium(&force, &w.contacts);
    w.equations.forget_measured();
    write_torque_residuals(w);
    w.outcome.ground_wrench = Wrench {
        force: plane.normal * held.normal,
        moment: plane.forward * held.moment.x + plane.left * held.moment.y,
    };
    load_wheels(machine, w, &force, &plane.normal);
    w.outcome.indicators.set_edge_moments(&held.edge_moments);
    plane
}

/// Motion and wrench of every body with its payloads; returns the IMU's frame and the wrench on the tool.
fn move_machine<T: Real>(
    machine: &Machine,
    state: &State<T>,
    w: &mut Workspace<T>,
) -> (SensorFrame<T>, Wrench<T>) {
    let (sensitivity, coordinates) = (&mut w.sensitivity, &mut w.coordinates);
    w.outcome.linkage_closure = if w.scope.sensitivities {
        let solve = |linkage: &Linkage| sensitivity.solve(linkage, state);
        kinematics::coordinates_by(machine, state, coordinates, solve)
    } else {
        kinematics::coordinates(machine, state, coordinates)
    };
    let sensor_frame = SensorFrame::of(machine, &w.coordinates);
    let base = kinematics::base_motion(machine, &sensor_frame, &state.imu);
    move_bodies(machine, w, base);
    newton_euler::add_payloads(machine, state, &w.motions, &mut w.wrenches);
    let tool_wrench = newton_euler::tool_wrench(machine, state, &w.motions);
    (sensor_frame, tool_wrench)
}

/// Motion and wrench of every body, parents first.
fn move_bodies<T: Real>(machine: &Machine, w: &mut Workspace<T>, base: BodyMotion<T>) {
    w.motions[0] = base;
    for (i, body) in machine.bodies.iter().enumerate() {
        if i > 0 {
            w.motions[i] = w.motions[body.parent].carry(body, &w.coordinates[i]);
        }
        w.wrenches[i] = newton_euler::body_wrench(&body.inertia, &w.motions[i]);
    }
}

/// Determines the plane through the contact points and solves for the loads.
fn stand<T: Real>(
    machine: &Machine,
    state: &State<T>,
    w: &mut Workspace<T>,
    ground: &Wrench<T>,
    plane: &ContactPlane<T>,
) {
    for (contact, centre) in w.contacts.iter_mut().zip(&w.wheel_centres) {
        *contact = plane.coordinates(centre);
    }
    let computed = GroundForce::in_plane(ground, plane);
    let force = w.equations.ground_force(
        machine,
        state.follows_supports,
        &w.actuations,
        &w.contacts,
        computed,
    );
    w.outcome.ground_wrench = match w.equations.follow_supports() {
        true => force.replacing(&computed, ground, plane),
        false => *ground,
    };
    w.equations.set_equilibrium(&force, &w.contacts);
    w.equations.set_offsets(machine, plane, &w.wheel_centres);
    if !w.distal.is_empty() || w.equations.are_measured() {
        let distal = DistalSubtrees {
            motions: &w.motions,
            wrenches: &w.distal,
            plane,
            centres: &w.wheel_centres,
            radii: &w.radii,
            force_per_load: ground.force / computed.normal,
            spin: spin(ground, plane),
        };
        w.equations.set_free_joints(machine, &distal);
        w.equations
            .set_actuated_joints(machine, &distal, &w.actuations);
    }
    load_wheels(machine, w, &force, &plane.normal);
}

/// Solves for the wheel loads by the support configuration whose equations are set.
fn load_wheels<T: Real>(
    machine: &Machine,
    w: &mut Workspace<T>,
    force: &GroundForce<T>,
    normal: &Vector3<T>,
) {
    let out = &mut w.outcome;
    out.contact_normal = *normal;
    out.normal_force = force.normal;
    stability(machine, force, out, |edge| {
        [w.contacts[edge.from], w.contacts[edge.to]]
    });
    let mut loads = Loads {
        otf: &mut out.otf,
        load: &mut out.load,
        least: &mut out.load_least,
        largest: &mut out.load_largest,
    };
    w.solver.solve(
        machine,
        &w.equations,
        &w.contacts,
        &out.itom_full,
        &mut loads,
    );
}

/// Stability about the lines about which the machine tips, where these are not the edges.
fn tip_about_lines<T: Real>(machine: &Machine, w: &mut Workspace<T>, plane: &ContactPlane<T>) {
    let edges = &machine.polygon.edges;
    w.tipping_lines.clear();
    if !edges
        .iter()
        .any(|edge| machine.axles_astride(edge).next().is_some())
    {
        return;
    }
    let standing = Standing {
        machine,
        motions: &w.motions,
        plane,
        contacts: &w.contacts,
        otf: &w.outcome.otf,
    };
    let lines = edges.iter().map(|edge| standing.line(edge));
    w.tipping_lines.extend(lines);
    let force = GroundForce::of(&w.equations);
    let mut lines = w.tipping_lines.iter();
    stability(machine, &force, &mut w.outcome, |edge| {
        let line = lines.next().map(|line| line.on_ground);
        line.unwrap_or_else(|| [w.contacts[edge.from], w.contacts[edge.to]])
    });
}

/// Centre of pressure, and overturning moments about a line on the ground for each edge.
fn stability<T: Real>(
    machine: &Machine,
    force: &GroundForce<T>,
    out: &mut Outcome<T>,
    mut line: impl FnMut(&Edge) -> [Vector2<T>; 2],
) {
    let unknown = T::constant(f64::NAN);
    let pushes = T::zero().lt(force.normal);
    let pressure = force.centre_of_pressure();
    out.zmp_x = T::select(pushes, pressure.x, unknown);
    out.zmp_y = T::select(pushes, pressure.y, unknown);
    let mut margin = T::constant(f64::INFINITY);
    for (edge, moment) in machine.polygon.edges.iter().zip(&mut out.itom_full) {
        *moment = overturning(force, line(edge));
        margin = (-*moment / force.normal).min(margin);
    }
    out.zmp_margin = T::select(pushes, margin, unknown);
}
