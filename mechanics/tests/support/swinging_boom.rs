//! A boom that swings with a load, and the force that the sensor of its cylinder shows.

use nalgebra::Vector3;
use tipwatch_mechanics::estimation::Estimate;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec, SessionProofs};
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::{
    Machine, Scope, State, Workspace, actuator_force, evaluate_one, resting_state,
};

use super::set_joint;

const STEP_NS: i64 = 20_000_000;
const FORCE_SIGMA_N: f64 = 500.0;
pub(crate) const FRICTION_SHARE: f64 = 0.05;

/// Returns a machine whose lift cylinder has a measured force and carries a load of this mass (kg); the lines of its URDF are edited
/// by `edit`.
pub(crate) fn with_load(mass: &str, edit: impl Fn(&str) -> String) -> Machine {
    with_linkage("", mass, edit)
}

/// The same with more text in the lift linkage.
pub(crate) fn with_linkage(more: &str, mass: &str, edit: impl Fn(&str) -> String) -> Machine {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let bound = "name = \"lift\"\nforce = { topic = \"/lift\", field = \"force\" }\nforce_sigma = 500.0\nfriction_share = 0.05\n";
    let bound = format!("{bound}{more}");
    let text = read("lift_payload.toml").replacen("name = \"lift\"\n", &bound, 1)
        + "[[payload]]\nlink = \"tool\"\ncom = [0.405, -0.4313, -0.0134]\nmass = "
        + mass;
    let urdf = read("lift_payload.urdf");
    let urdf = urdf.lines().map(edit).collect::<Vec<_>>().join("\n");
    let spec = MachineSpec::from_toml(&text, "machine.toml").unwrap();
    spec.check(&urdf, "machine.urdf", LogFacts::default())
        .unwrap()
}

/// Rows of a boom that swings (rad) with a share of its load by time (s): time, estimate, and the force that the sensor of the lift
/// cylinder shows (N); `friction` is that of the cylinder by the direction of its rod, as a share of the force.
pub(crate) fn swinging(
    machine: &Machine,
    swing: f64,
    seconds: f64,
    share: impl Fn(f64) -> f64,
    friction: impl Fn(f64) -> f64,
) -> impl Iterator<Item = (f64, Estimate, f64)> {
    let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
    let posture = machine.reference().posture.positions.clone();
    let lift = (machine.joints().iter())
        .position(|joint| joint.name == "lift")
        .unwrap();
    let rows = (seconds * 1e9) as i64 / STEP_NS;
    (0..rows).map(move |row| {
        let time_s = (row * STEP_NS) as f64 * 1e-9;
        let mut state: State<f64> = resting_state(machine, &posture);
        state.imu.specific_force = Vector3::z() * machine.gravity();
        state.payload_share[0] = share(time_s);
        let (sin, cos) = (1.5 * time_s).sin_cos();
        let motion = [
            posture[lift] + swing * sin,
            1.5 * swing * cos,
            -2.25 * swing * sin,
        ];
        set_joint(machine, &mut state, "lift", motion);
        evaluate_one(machine, &state, &mut workspace);
        let force = actuator_force(machine, &state, &workspace, 0);
        // of a standard deviation of one, and not periodic
        let noise = 1.4 * (row as f64 * row as f64 * 0.37).sin();
        let shown = force + FORCE_SIGMA_N * noise + force.abs() * friction(swing * cos);
        let estimate = Estimate {
            time_ns: row * STEP_NS,
            state,
            reasons: Reasons::NONE,
            rotates: false,
            shown: SessionProofs::NONE,
            stands_on: None,
            measured_loads: Vec::new(),
            commands: Vec::new(),
            lift_forces: vec![f64::NAN],
            arm_forces: Vec::new(),
        };
        (time_s, estimate, shown)
    })
}
