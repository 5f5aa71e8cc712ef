//! Random problems of the machine on bogies, for the benchmark and for the comparison with another solver.

use nalgebra::Vector3;
use tipwatch_mechanics::machine::{ControlMode, LogFacts, MachineSpec, SuspensionControl};
use tipwatch_mechanics::{Machine, Motion, State};
use tipwatch_suspension::SuspensionOptimiser;

/// The joints in its logs.
const MEASURED: [&str; 10] = [
    "slew",
    "lift",
    "tilt",
    "extension",
    "suspension_right",
    "suspension_left",
    "wheel_fl",
    "wheel_fr",
    "wheel_rl",
    "wheel_rr",
];

/// Time step of one-step mode here (s): at least 1.5 T* in every sampled posture.
pub(crate) const LITERAL_STEP: f64 = 2.0;

/// The machine on bogies, its rods measured.
pub(crate) fn machine() -> Machine {
    let spec = MachineSpec::from_toml(include_str!("../../../tests/data/bogie.toml"), "bogie.toml")
        .expect("a valid machine file");
    let names = MEASURED.map(String::from);
    let facts = LogFacts {
        joint_names: Some(&names),
        ..LogFacts::default()
    };
    spec.check(
        include_str!("../../../tests/data/bogie.urdf"),
        "bogie.urdf",
        facts,
    )
    .expect("a valid machine")
}

/// Control settings for a mode with one or two variables.
pub(crate) fn control(mode: ControlMode, independent: bool) -> SuspensionControl {
    SuspensionControl {
        mode,
        independent,
        rate: match mode {
            ControlMode::LookAhead => 50.0,
            ControlMode::OneStep => 1.0 / LITERAL_STEP,
        },
        ..SuspensionControl::default()
    }
}

/// The suspension optimiser with these settings.
pub(crate) fn optimiser(machine: &Machine, control: &SuspensionControl) -> SuspensionOptimiser {
    let posture: Vec<f64> = machine
        .joints()
        .iter()
        .map(|joint| middle(&joint.name).0)
        .collect();
    SuspensionOptimiser::new(machine, control, &posture).expect("a machine with a suspension")
}

/// Random numbers: SplitMix64 (Steele, Lea and Flood).
#[derive(Debug, Clone)]
pub(crate) struct Draws(pub(crate) u64);

impl Draws {
    /// Uniform between -1 and 1.
    pub(crate) fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self, x: f64, y: f64, z: f64) -> Vector3<f64> {
        Vector3::new(self.signed() * x, self.signed() * y, self.signed() * z)
    }
}

/// Centre and half width of the range from which a joint's position is sampled.
fn middle(name: &str) -> (f64, f64) {
    match name {
        "slew" => (0.0, 3.1),
        "lift" => (-1.4, 0.25),
        "tilt" => (-1.5, 0.4),
        "extension" => (0.35, 0.35),
        "suspension_right" | "suspension_left" => (-0.1, 0.09),
        _ => (0.0, 3.0),
    }
}

/// A problem.
#[derive(Debug, Clone)]
pub(crate) struct Problem {
    pub(crate) state: State<f64>,
    pub(crate) x: [f64; 2],
    pub(crate) v: [f64; 2],
}

impl Problem {
    /// The arm at work, the machine driving and turning on a slope, the rods within their limits, in common or
    /// individually.
    pub(crate) fn draw(
        draws: &mut Draws,
        machine: &Machine,
        optimiser: &SuspensionOptimiser,
        alike: bool,
    ) -> Self {
        let mut state = State::zero(machine);
        for (motion, joint) in state.joints.iter_mut().zip(machine.joints()) {
            let (centre, half) = middle(&joint.name);
            *motion = Motion {
                position: centre + half * draws.signed(),
                rate: 0.3 * draws.signed(),
                acceleration: 0.5 * draws.signed(),
            };
        }
        let up = (Vector3::z() + draws.vector(0.1, 0.1, 0.0)).normalize();
        state.base.up = up;
        state.imu.specific_force = up * machine.gravity() + draws.vector(0.5, 0.3, 0.2);
        state.imu.angular_velocity = draws.vector(0.03, 0.03, 0.3);
        state.imu.angular_acceleration = draws.vector(0.05, 0.05, 0.2);
        let (mut x, mut v) = ([0.0; 2], [0.0; 2]);
        for k in 0..2 {
            let rod = ["suspension_right", "suspension_left"][k];
            let index = machine.joints().iter().position(|joint| joint.name == rod);
            let motion = &mut state.joints[index.expect("a rod")];
            motion.position = -0.1 + 0.09 * draws.signed();
            let [least, greatest] = optimiser.velocity_limits(motion.position);
            let share = 0.5 + 0.45 * draws.signed();
            motion.rate = least + (greatest - least) * share;
            (x[k], v[k]) = (motion.position, motion.rate);
        }
        if alike {
            (x[1], v[1]) = (x[0], v[0]);
            let [right, left] = ["suspension_right", "suspension_left"]
                .map(|name| machine.joints().iter().position(|joint| joint.name == name));
            state.joints[left.expect("a rod")] = state.joints[right.expect("a rod")];
        }
        Self { state, x, v }
    }
}
