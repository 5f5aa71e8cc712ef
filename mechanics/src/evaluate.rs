//! The one entry: a state in, wheel loads out.

use nalgebra::Vector2;

use crate::attribution::{Cause, Circumstances, attribute, attribute_links};
use crate::contact_plane::ContactPlane;
use crate::indicators::{self, Balance, overturning};
use crate::kinematics::{self, BodyMotion, ImuSeat};
use crate::machine::Machine;
use crate::newton_euler;
use crate::number::Real;
use crate::outcome::Outcome;
use crate::scope::Scope;
use crate::sensitivity::SensedMotion;
use crate::spatial::Wrench;
use crate::state::State;
use crate::uncertainty;
use crate::wheel_loads::{Beyond, GroundForce, Loads, Stance, beyond_free_joints};
use crate::workspace::Workspace;

/// The solution that a workspace holds.
macro_rules! stance {
    ($machine:expr, $w:expr, $plane:expr, $ground:expr) => {
        Stance {
            machine: $machine,
            plane: $plane,
            ground: $ground,
            normal_force: $w.outcome.normal_force,
            centres: &$w.wheel_centres,
            radii: &$w.radii,
            motions: &$w.motions,
            beyond: &$w.beyond,
            equations: &$w.equations,
        }
    };
}

/// Wheel loads and stability of `machine` in `state` (model `whole-body`).
///
/// It remembers nothing and allocates nothing: the same state gives the same bits. What cannot be
/// computed is NaN: everything where an input is NaN or a linkage cannot close, positions of the
/// centre of pressure where the ground does not push.
pub fn evaluate<'w, T: Real>(
    machine: &Machine,
    state: &State<T>,
    workspace: &'w mut Workspace<T>,
) -> &'w Outcome<T> {
    let w = workspace;
    w.outcome.linkage_closure = kinematics::coordinates(machine, state, &mut w.coordinates);
    let seat = ImuSeat::of(machine, &w.coordinates);
    let base = kinematics::base_motion(machine, &seat, &state.imu);
    move_bodies(machine, w, base);
    newton_euler::add_payloads(machine, state, &w.motions, &mut w.wrenches);
    let tool_wrench = newton_euler::tool_wrench(machine, state, &w.motions);
    let ground = newton_euler::sum(&w.wrenches, |_| true).minus(&tool_wrench);
    for (wheel, spec) in machine.wheels.iter().enumerate() {
        w.wheel_centres[wheel] = w.motions[spec.body].point(&spec.centre_in_body);
        w.radii[wheel] = T::constant(spec.radius);
    }
    beyond_free_joints(machine, &w.wrenches, &tool_wrench, &mut w.beyond);
    let radii_differ = machine.contact.radii_differ;
    let mut plane = ContactPlane::through(&w.wheel_centres, &w.radii, radii_differ);
    stand(machine, w, &ground, &plane);
    let derives = w.scope.needs_influences();
    if machine.contact.tyres_deflect {
        if derives {
            let stance = stance!(machine, w, &plane, &ground);
            w.influences
                .fill_undeflected(&stance, &w.solver, &w.outcome.load);
        }
        w.pressing.copy_from_slice(&w.outcome.load);
        // A tyre is shorter by its load over its stiffness. The plane then leans towards the heavy
        // side; its lean changes the loads by some per mille, so that once is enough.
        for (wheel, spec) in machine.wheels.iter().enumerate() {
            let compliance = T::constant(spec.stiffness.map_or(0.0, |stiffness| 1.0 / stiffness));
            w.radii[wheel] -= w.outcome.load[wheel] * compliance;
        }
        plane = ContactPlane::through(&w.wheel_centres, &w.radii, true);
        stand(machine, w, &ground, &plane);
    }
    if derives {
        let stance = stance!(machine, w, &plane, &ground);
        let pressing = machine.contact.tyres_deflect.then_some(&w.pressing[..]);
        let loads = [&w.outcome.otf[..], &w.outcome.load[..]];
        w.influences.fill(&stance, &w.solver, loads, pressing);
    }
    let out = &mut w.outcome;
    out.ground_wrench = ground;
    let mut loads = Loads {
        otf: &mut out.otf,
        load: &mut out.load,
        least: &mut out.load_least,
        largest: &mut out.load_largest,
    };
    w.solver
        .find_envelope(machine, &w.equations, &out.itom_full, &mut loads);
    if w.scope != Scope::LOADS {
        explain(machine, state, w, &plane, &seat, &tool_wrench);
    }
    &w.outcome
}

/// What the scope asks for beyond the loads.
fn explain<T: Real>(
    machine: &Machine,
    state: &State<T>,
    w: &mut Workspace<T>,
    plane: &ContactPlane<T>,
    seat: &ImuSeat<T>,
    tool_wrench: &Wrench<T>,
) {
    w.groups.fill(machine, state, &w.motions, tool_wrench);
    let scope = w.scope;
    if scope.sensitivities {
        let motion = SensedMotion {
            machine,
            state,
            seat,
            coordinates: &w.coordinates,
            motions: &w.motions,
            wrenches: &w.wrenches,
            groups: &w.groups,
            tool_wrench,
            centres: &w.wheel_centres,
        };
        w.sensitivity.fill(&motion, &w.influences);
        let noise = &state.noise;
        uncertainty::fill(machine, &w.sigmas, noise, &w.sensitivity, &mut w.outcome);
    }
    if scope.indicators {
        let balance = Balance {
            machine,
            state,
            plane,
            contacts: &w.contacts,
            whole: &w.groups.sets[0],
            motions: &w.motions,
            sensitivity: scope.sensitivities.then_some(&w.sensitivity),
        };
        indicators::fill(&balance, &mut w.outcome);
    }
    if scope.causes {
        let circumstances = Circumstances {
            machine,
            base: &w.motions[0],
            known: &state.base,
            normal: &plane.normal,
        };
        let (influences, out) = (&w.influences.otf, &mut w.outcome);
        attribute(
            &circumstances,
            &w.groups,
            &w.motions,
            influences,
            &mut out.causes,
        );
        for (wheel, causes) in out.causes.iter_mut().enumerate() {
            causes[Cause::LiftOff as usize] = out.load[wheel] - out.otf[wheel];
        }
    }
    if scope.parts {
        attribute_links(machine, &w.motions, &w.influences.otf, &mut w.outcome.parts);
    }
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

/// Puts the machine on the plane that its wheels touch, and loads them.
fn stand<T: Real>(
    machine: &Machine,
    w: &mut Workspace<T>,
    ground: &Wrench<T>,
    plane: &ContactPlane<T>,
) {
    for (contact, centre) in w.contacts.iter_mut().zip(&w.wheel_centres) {
        *contact = plane.coordinates(centre);
    }
    let force = GroundForce::in_plane(ground, plane);
    w.equations.set_equilibrium(&force, &w.contacts);
    if !machine.contact.free_joints.is_empty() {
        let beyond = Beyond {
            motions: &w.motions,
            wrenches: &w.beyond,
            plane,
            centres: &w.wheel_centres,
            radii: &w.radii,
            force_per_load: ground.force / force.normal,
        };
        w.equations.set_free_joints(machine, &beyond);
    }
    let out = &mut w.outcome;
    out.contact_normal = plane.normal;
    out.normal_force = force.normal;
    stability(machine, &force, &w.contacts, out);
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

/// Centre of pressure and overturning moments.
fn stability<T: Real>(
    machine: &Machine,
    force: &GroundForce<T>,
    contacts: &[Vector2<T>],
    out: &mut Outcome<T>,
) {
    let unknown = T::constant(f64::NAN);
    let pushes = T::zero().lt(force.normal);
    let pressure = force.centre_of_pressure();
    out.zmp_x = T::select(pushes, pressure.x, unknown);
    out.zmp_y = T::select(pushes, pressure.y, unknown);
    let mut margin = T::constant(f64::INFINITY);
    for (edge, moment) in machine.polygon.edges.iter().zip(&mut out.itom_full) {
        *moment = overturning(force, edge, contacts);
        margin = (-*moment / force.normal).min(margin);
    }
    out.zmp_margin = T::select(pushes, margin, unknown);
}
