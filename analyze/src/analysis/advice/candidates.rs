//! The changes to try, with the largest amount of each that is within limits and the range seen in the log.

use tipwatch_language::word;
use tipwatch_mechanics::machine::{Machine, Payload};
use tipwatch_mechanics::{Parameter, State};

use super::change::Change;
use super::window::Window;

/// A joint with a range up to this did not move (rad or m).
const SMALLEST_RANGE: f64 = 1e-3;
/// Most by which a motion or a force may become smaller, as a share.
const MOST_REDUCTION: f64 = 0.9;
/// Most by which the mass of a link may become smaller: the rest is the tool itself.
const MOST_LINK_SHARE: f64 = 0.5;
/// Joints that move more slowly than this need not move more slowly (rad/s or m/s).
const SMALLEST_RATE: f64 = 0.02;
/// Accelerations of the base (m/s^2) up to this are negligible.
const SMALLEST_ACCELERATION: f64 = 0.2;
/// A machine that moves more slowly (m/s) stands.
const SMALLEST_SPEED: f64 = 0.05;
/// The base rests if it turns more slowly (rad/s) and its specific force varies less (m/s^2).
const RESTING: [f64; 2] = [0.1, 0.5];
/// Forces (N) and moments (N m) on the tool up to this are negligible.
const SMALLEST_WRENCH: f64 = 1.0;

/// A change to try.
#[derive(Debug)]
pub(super) struct Candidate {
    /// The change.
    pub(super) change: Change,
    /// The largest amount, with its sign.
    pub(super) bound: f64,
    /// The amount of an effort of 100 %.
    pub(super) whole: f64,
    /// Quantity to which the effort is compared.
    pub(super) effort_of: &'static str,
    /// The amount by the first derivative, if there is one.
    pub(super) first_order: Option<f64>,
}

/// All changes to try. `positions` are the smallest and the largest position of each joint in the log; `first_order` gives the change of a parameter by the first derivative.
pub(super) fn candidates(
    machine: &Machine,
    positions: &[[f64; 2]],
    window: &Window,
    first_order: impl Fn(Parameter) -> Option<f64>,
) -> Vec<Candidate> {
    let seen = WindowMotion::of(window);
    let mut found = joint_offsets(machine, positions, &seen);
    let mut share = |change: Change, effort_of: &'static str| {
        found.push(Candidate {
            change,
            bound: MOST_REDUCTION,
            whole: 1.0,
            effort_of,
            first_order: None,
        });
    };
    if seen.joint_rate > SMALLEST_RATE && seen.base_rests {
        share(Change::SlowerArm, word!("its speed"));
    }
    if seen.speed > SMALLEST_SPEED && !seen.base_rests {
        share(Change::SlowerManoeuvre, word!("its speed"));
    }
    if seen.forward_acceleration > SMALLEST_ACCELERATION {
        share(Change::LessForwardAcceleration, word!("its value"));
    }
    if seen.cornering > SMALLEST_ACCELERATION {
        share(Change::WiderCurve, word!("its value"));
    }
    if machine.tool().is_some() && seen.tool_wrench > SMALLEST_WRENCH {
        share(Change::LessToolForce, word!("its value"));
    }
    found.extend(masses(machine, &seen));
    for candidate in &mut found {
        let change = candidate.change.parameter().and_then(&first_order);
        let amount = change.map(|change| change * candidate.change.sign());
        // of the two directions of an offset it belongs to one
        candidate.first_order = amount.filter(|amount| amount * candidate.bound > 0.0);
    }
    found
}

/// Whether the base neither drives nor rocks nor turns in the window.
pub(super) fn base_rests(window: &Window) -> bool {
    WindowMotion::of(window).base_rests
}

/// Observations in the window.
struct WindowMotion {
    /// Smallest and largest position of each joint.
    positions: Vec<[f64; 2]>,
    joint_rate: f64,
    speed: f64,
    forward_acceleration: f64,
    cornering: f64,
    tool_wrench: f64,
    base_rests: bool,
    /// Flags of the payloads that are attached at some time.
    attached: Vec<bool>,
}

impl WindowMotion {
    fn of(window: &Window) -> Self {
        let machine = window.machine();
        let mut found = Self {
            positions: vec![[f64::INFINITY, f64::NEG_INFINITY]; machine.joints().len()],
            joint_rate: 0.0,
            speed: 0.0,
            forward_acceleration: 0.0,
            cornering: 0.0,
            tool_wrench: 0.0,
            base_rests: true,
            attached: vec![false; machine.payloads().len()],
        };
        let mut force = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        let mut odometry_is_known = true;
        window.for_each_state(|state| {
            widen(&mut found.positions, state);
            let arm = state.joints.iter().enumerate();
            for (_, motion) in arm.filter(|(joint, _)| !machine.joint_spins_wheel(*joint)) {
                found.joint_rate = found.joint_rate.max(motion.rate.abs());
            }
            let (base, w) = (&state.base, &state.imu.angular_velocity);
            odometry_is_known &= (base.velocity + base.velocity_rate)
                .iter()
                .all(|v| v.is_finite());
            found.speed = found.speed.max(base.velocity.norm());
            let forward = base.velocity_rate.x.abs();
            found.forward_acceleration = found.forward_acceleration.max(forward);
            let cornering = (w.z * base.velocity.x).abs();
            found.cornering = found.cornering.max(cornering);
            let tool = &state.tool_wrench;
            let wrench = tool.force.norm().max(tool.moment.norm());
            found.tool_wrench = found.tool_wrench.max(wrench);
            found.base_rests &= w.norm() < RESTING[0];
            for (range, f) in force.iter_mut().zip(state.imu.specific_force.iter()) {
                *range = [range[0].min(*f), range[1].max(*f)];
            }
            for (attached, share) in found.attached.iter_mut().zip(&state.payload_share) {
                *attached |= *share > 0.0;
            }
        });
        found.base_rests &= force.iter().all(|[low, high]| high - low < RESTING[1]);
        if odometry_is_known {
            found.base_rests &= found.speed <= SMALLEST_SPEED;
        } else {
            // nothing is known of the speed: no change of it can be simulated
            (found.speed, found.forward_acceleration, found.cornering) = (0.0, 0.0, 0.0);
        }
        found
    }
}

/// Offsets of the joints that moved, in both directions. Joints that carry or spin wheels are left out: the measured
/// attitude of the base would change with them.
fn joint_offsets(machine: &Machine, log: &[[f64; 2]], seen: &WindowMotion) -> Vec<Candidate> {
    let mut found = Vec::new();
    for (joint, measured) in machine.joints().iter().enumerate() {
        let range = log[joint][1] - log[joint][0];
        if !(range > SMALLEST_RANGE) || machine.joint_carries_support(joint) {
            continue;
        }
        // a position seen beyond a limit of the URDF is possible
        let limits = measured
            .limits
            .map_or([f64::NEG_INFINITY, f64::INFINITY], |limits| {
                [limits[0].min(log[joint][0]), limits[1].max(log[joint][1])]
            });
        let up = range.min(limits[1] - seen.positions[joint][1]);
        let down = range.min(seen.positions[joint][0] - limits[0]);
        let bounds = [up, -down];
        found.extend(
            bounds
                .into_iter()
                .filter(|bound| bound.abs() > SMALLEST_RANGE)
                .map(|bound| Candidate {
                    change: Change::JointOffset(joint),
                    bound,
                    whole: range,
                    effort_of: word!("its range in this log"),
                    first_order: None,
                }),
        );
    }
    found
}

/// Lighter loads: the payloads, or else the end of the arm.
fn masses(machine: &Machine, seen: &WindowMotion) -> Vec<Candidate> {
    let lighter = |change: Change, mass: f64, share: f64| Candidate {
        change,
        bound: mass * share,
        whole: mass,
        effort_of: word!("its mass"),
        first_order: None,
    };
    let payloads = machine.payloads().iter().enumerate();
    // a mass that is known by row alone is not that of the payload as stated
    let is_stated = |spec: &Payload| !spec.is_by_row && spec.inertia.mass > 0.0;
    let attached = payloads.filter(|(payload, spec)| seen.attached[*payload] && is_stated(spec));
    let of_payloads: Vec<Candidate> = attached
        .map(|(payload, spec)| lighter(Change::LessPayload(payload), spec.inertia.mass, 1.0))
        .collect();
    if !of_payloads.is_empty() {
        return of_payloads;
    }
    let end = machine.load_on_tool().map(|load| load.link);
    let mass = |link: &usize| machine.links()[*link].inertia.mass;
    let end = end.filter(|link| mass(link) > 0.0);
    let lighter_end = |link| lighter(Change::LessLinkMass(link), mass(&link), MOST_LINK_SHARE);
    end.map(lighter_end).into_iter().collect()
}

fn widen(ranges: &mut [[f64; 2]], state: &State<f64>) {
    for (range, joint) in ranges.iter_mut().zip(&state.joints) {
        *range = [range[0].min(joint.position), range[1].max(joint.position)];
    }
}
