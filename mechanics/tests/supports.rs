//! A machine on any set of its supports: one set of equations for wheels, outriggers and tracks.

use std::fmt::Write as _;

use nalgebra::Vector3;
use proptest::prelude::*;
use tipwatch_mechanics::estimation::support_configuration::{GroundGap, SupportWatch};
use tipwatch_mechanics::machine::{ForceSource, LogFacts, MachineSpec, SupportId, SupportSetError};
use tipwatch_mechanics::state::{
    MatchedSensors, NumberKind, OtherSensors, Sample, Sensor, Sensors,
};
use tipwatch_mechanics::{Machine, MachineError, Quantity, Scope, State, Workspace, evaluate};

use crate::support::{assert_lanes_equal_scalar, cases};

const FEET: [(&str, f64, f64); 4] = [
    ("OFL", 2.2, 2.4),
    ("OFR", 2.2, -2.4),
    ("ORL", -2.2, 2.4),
    ("ORR", -2.2, -2.4),
];
const WHEELS: [(&str, f64, f64); 4] = [
    ("FL", 1.6, 0.95),
    ("FR", 1.6, -0.95),
    ("RL", -1.6, 0.95),
    ("RR", -1.6, -0.95),
];

fn urdf() -> String {
    let mut text = String::from(
        r#"<robot name="crane"><link name="base_link"><inertial><origin xyz="0.1 0.05 0.6"/><mass value="9000"/>
        <inertia ixx="3000" iyy="16000" izz="17000" ixy="0" ixz="0" iyz="0"/></inertial></link>"#,
    );
    for (name, x, y) in WHEELS {
        let _ = write!(
            text,
            r#"<link name="{name}"><inertial><mass value="150"/><inertia ixx="9" iyy="16" izz="9" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="{name}" type="continuous"><parent link="base_link"/><child link="{name}"/><origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/></joint>"#
        );
    }
    text + "</robot>"
}

/// A machine file with these feet, in the order given.
fn toml(feet: &[(&str, f64, f64)], more: &str) -> String {
    let mut text = String::from("name = \"crane\"\n[imu]\nlink = \"base_link\"\n");
    for (name, ..) in WHEELS {
        let _ = writeln!(
            text,
            "[wheels.{name}]\nlink = \"{name}\"\nradius = 0.5\nraised_by = [{}]",
            feet.iter()
                .map(|(name, ..)| format!("\"{name}\""))
                .collect::<Vec<_>>()
                .join(", ")
        );
    }
    for (name, x, y) in feet {
        let _ = writeln!(
            text,
            "[supports.{name}]\nlink = \"base_link\"\nxyz = [{x}, {y}, -0.5]\n\
            set = {{ topic = \"/set\", field = \"{name}\" }}\nforce = {{ topic = \"/force\", field = \"{name}\" }}\nforce_sigma = 100.0"
        );
    }
    text + more
}

fn checked(text: &str) -> Result<Machine, MachineError> {
    let spec = MachineSpec::from_toml(text, "crane.toml")?;
    spec.check(&urdf(), "crane.urdf", LogFacts::default())
}

fn crane() -> Machine {
    checked(&toml(&FEET, "")).unwrap()
}

/// Supports by name.
fn on(machine: &Machine, names: &[&str]) -> Vec<SupportId> {
    let ids = names.iter().flat_map(|name| machine.supports().named(name));
    ids.collect()
}

fn leaning(machine: &Machine, [x, y]: [f64; 2]) -> State<f64> {
    let mut state = State::zero(machine);
    state.imu.specific_force = Vector3::new(x, y, 9.8);
    state.imu.angular_velocity = Vector3::new(0.02, -0.05, 0.1);
    state
}

/// Loads by name.
fn loads(machine: &Machine, state: &State<f64>) -> Vec<(String, f64)> {
    let mut workspace = Workspace::with_scope(machine, Scope::ALL);
    let outcome = evaluate(machine, state, &mut workspace);
    let names = machine.wheels().iter().map(|wheel| wheel.name.clone());
    names.zip(outcome.load.iter().copied()).collect()
}

#[test]
fn without_set_supports_the_machine_is_on_its_wheels() {
    let machine = crane();
    let names: Vec<&str> = machine.wheels().iter().map(|w| w.name.as_str()).collect();
    assert_eq!(names, ["FL", "FR", "RL", "RR"]);
    assert!(machine.supports().vary());
    assert_eq!(machine.supports().all.len(), 8);
    // the same loads, to the bit, as without a support in the machine file
    let alone = checked(&toml(&[], "")).unwrap();
    let state = leaning(&alone, [0.7, -0.4]);
    let of_crane = leaning(&machine, [0.7, -0.4]);
    assert_eq!(loads(&machine, &of_crane), loads(&alone, &state));
}

proptest! {
    #![proptest_config(cases(64))]

    /// Whatever stands on the ground carries the weight, its moments are those of the centre of pressure, and the
    /// overturning moments about its edges follow from its OTF.
    #[test]
    fn loads_of_any_set_balance_the_weight(
        set in 0_usize..256,
        x in -1.5_f64..1.5,
        y in -1.5_f64..1.5,
    ) {
        let whole = crane();
        let ids = whole.supports().ids();
        let indices: Vec<SupportId> = ids.filter(|id| set >> id.index() & 1 == 1).collect();
        let machine = match whole.standing_on(&indices) {
            Ok(machine) => machine,
            Err(SupportSetError::Count(count)) => {
                prop_assert!(count < 3);
                return Ok(());
            }
            Err(error) => {
                prop_assert!(indices.len() < 5, "{error}");
                return Ok(());
            }
        };
        let state = leaning(&machine, [x, y]);
        let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
        let outcome = evaluate(&machine, &state, &mut workspace);
        prop_assert_eq!(outcome.load.len(), indices.len());
        let weight = outcome.normal_force;
        let close = |a: f64, b: f64| (a - b).abs() < 1e-6 * weight;
        prop_assert!(close(outcome.load.iter().sum(), weight));
        prop_assert!(close(outcome.otf.iter().sum(), weight));
        for (edge, &moment) in machine.polygon().edges().iter().zip(&outcome.itom_full) {
            let place = |wheel: usize| {
                let wheel = &machine.wheels()[wheel];
                wheel.centre_at_zero - outcome.contact_normal * wheel.radius
            };
            let along = (place(edge.to) - place(edge.from)).normalize();
            let inwards = outcome.contact_normal.cross(&along);
            let held: f64 = (0..indices.len())
                .map(|wheel| outcome.otf[wheel] * inwards.dot(&(place(wheel) - place(edge.from))))
                .sum();
            prop_assert!((moment + held).abs() < 1e-5 * weight, "{}: {moment} {held}", edge.name);
        }
        for wheel in 0..indices.len() {
            let (least, largest) = (outcome.load_least[wheel], outcome.load_largest[wheel]);
            if least.is_finite() {
                let load = outcome.load[wheel];
                prop_assert!(least - 1e-6 * weight <= load && load <= largest + 1e-6 * weight);
            }
        }
    }

    /// Three supports are statically determinate: the loads are those of the lever rule.
    #[test]
    fn three_supports_follow_the_lever_rule(left_out in 0_usize..4, x in -0.6_f64..0.6, y in -0.6_f64..0.6) {
        let whole = crane();
        let feet: Vec<&str> = FEET.iter().map(|(name, ..)| *name).collect();
        let three: Vec<&str> = feet.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, n)| *n).collect();
        let machine = whole.standing_on(&on(&whole, &three)).unwrap();
        let mut state = State::zero(&machine);
        state.imu.specific_force = Vector3::new(x, y, 9.8);
        let mut workspace = Workspace::with_scope(&machine, Scope::LOADS);
        let outcome = evaluate(&machine, &state, &mut workspace);
        let points: Vec<_> = machine.wheels().iter().map(|w| w.centre_at_zero.xy()).collect();
        let pressure = nalgebra::Vector2::new(outcome.zmp_x, outcome.zmp_y);
        let area = |a: usize, b: usize| (points[b] - points[a]).perp(&(pressure - points[a]));
        let whole_area = (points[1] - points[0]).perp(&(points[2] - points[0]));
        for wheel in 0..3 {
            let share = area((wheel + 1) % 3, (wheel + 2) % 3) / whole_area;
            let expected = share * outcome.normal_force;
            prop_assert!((outcome.otf[wheel] - expected).abs() < 1e-6 * outcome.normal_force);
            // inside the triangle
            if outcome.otf.iter().all(|otf| *otf > 0.0) {
                prop_assert!((outcome.load_least[wheel] - expected.max(0.0)).abs() < 1e-5 * outcome.normal_force);
            }
        }
    }

    /// The order of the tables in the machine file changes nothing.
    #[test]
    fn the_order_of_supports_changes_nothing(shift in 1_usize..4, x in -1.0_f64..1.0) {
        let mut feet = FEET;
        feet.rotate_left(shift);
        let (a, b) = (crane(), checked(&toml(&feet, "")).unwrap());
        let names = ["OFL", "OFR", "ORL", "ORR"];
        let a = a.standing_on(&on(&a, &names)).unwrap();
        let mut reversed = on(&b, &names);
        reversed.reverse();
        let b = b.standing_on(&reversed).unwrap();
        prop_assert_eq!(loads(&a, &leaning(&a, [x, 0.3])), loads(&b, &leaning(&b, [x, 0.3])));
    }

    /// Where measured loads agree with equilibrium, they are the loads of the supports, whatever springs would say.
    #[test]
    fn measured_loads_decide_the_split(warp in -9000.0_f64..9000.0, x in -0.5_f64..0.5) {
        let whole = crane();
        let machine = whole.standing_on(&on(&whole, &["OFL", "OFR", "ORL", "ORR"])).unwrap();
        let mut state = leaning(&machine, [x, 0.0]);
        let by_springs = loads(&machine, &state);
        // OFL and ORR lose what OFR and ORL gain: no moment, no force
        let sign = [1.0, -1.0, -1.0, 1.0];
        let truth: Vec<f64> = by_springs.iter().zip(sign).map(|((_, n), s)| n + s * warp).collect();
        prop_assume!(truth.iter().all(|load| *load > 1000.0));
        for (joint, force) in machine.contact().actuated_joints.iter().zip(&mut state.actuator_force) {
            let ForceSource::Support { wheel: Some(wheel), .. } = joint.source else {
                panic!("{joint:?}");
            };
            *force = truth[wheel];
        }
        for ((name, load), expected) in loads(&machine, &state).iter().zip(&truth) {
            prop_assert!((load - expected).abs() < 0.01 * expected.abs() + 100.0, "{name}: {load} {expected}");
        }
    }
}

/// The crane on its feet with these measured loads, which its own loads follow.
fn following(measured: &[f64; 4]) -> (Machine, State<f64>) {
    let whole = crane();
    let machine = whole
        .standing_on(&on(&whole, &["OFL", "OFR", "ORL", "ORR"]))
        .unwrap();
    let mut state = leaning(&machine, [0.3, -0.2]);
    state.follows_supports = 1.0;
    state.actuator_force.copy_from_slice(measured);
    (machine, state)
}

#[test]
fn loads_that_follow_the_supports_include_a_load_that_nobody_stated() {
    // 2.5 t more than the machine weighs, beside the front left foot
    let measured = [47_000.0, 31_000.0, 24_000.0, 18_000.0];
    let (machine, mut state) = following(&measured);
    let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
    let outcome = evaluate(&machine, &state, &mut workspace);
    for wheel in 0..4 {
        assert!(
            (outcome.load[wheel] - measured[wheel]).abs() < 50.0,
            "{:?}",
            outcome.load
        );
        // as uncertain as the sensor, whatever the masses are
        let of_sensor = 100.0_f64.hypot(0.03 * measured[wheel]);
        let sigma = of_sensor.hypot(0.003 * 30_000.0);
        assert!(
            (outcome.uncertainty.load[wheel] - sigma).abs() < 0.02 * sigma,
            "{:?}",
            outcome.uncertainty
        );
        assert!(outcome.load_least[wheel] > measured[wheel] - 2.1 * of_sensor);
        assert!(outcome.load_largest[wheel] < measured[wheel] + 2.1 * of_sensor);
    }
    let total: f64 = measured.iter().sum();
    assert!((outcome.normal_force - total).abs() < 1.0);
    assert!((outcome.ground_wrench.force.dot(&outcome.contact_normal) - total).abs() < 1.0);
    let y = 2.4 * (measured[0] - measured[1] + measured[2] - measured[3]) / total;
    assert!((outcome.zmp_y - y).abs() < 1e-3, "{} {y}", outcome.zmp_y);
    // one load that is missing leaves the machine as it is stated
    state.actuator_force[2] = f64::NAN;
    let missing = evaluate(&machine, &state, &mut workspace).normal_force;
    state.follows_supports = 0.0;
    let stated = evaluate(&machine, &state, &mut workspace).normal_force;
    assert!((missing - stated).abs() < 1.0, "{missing} {stated}");
    assert!((stated / machine.mass() - 9.8).abs() < 0.01, "{stated}");
}

#[test]
fn derivatives_by_measured_loads_are_differences() {
    let whole = crane();
    let machine = whole
        .standing_on(&on(&whole, &["OFL", "OFR", "ORL", "ORR"]))
        .unwrap();
    let mut state = leaning(&machine, [0.3, -0.2]);
    // nearly what equilibrium and springs give: weights of the rows then hardly matter
    let by_springs = loads(&machine, &state);
    for ((force, (_, load)), off) in (state.actuator_force.iter_mut())
        .zip(&by_springs)
        .zip([40.0, -40.0, -40.0, 40.0])
    {
        *force = load + off;
    }
    let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
    evaluate(&machine, &state, &mut workspace);
    let parameters = tipwatch_mechanics::Parameter::all(&machine);
    for (joint, step) in [(0, 10.0), (3, 10.0)] {
        let parameter = tipwatch_mechanics::Parameter::ActuatorForce(joint);
        let place = parameters.iter().position(|p| *p == parameter).unwrap();
        for wheel in 0..4 {
            let derivative = workspace
                .sensitivity()
                .otf(wheel)
                .into_iter()
                .nth(place)
                .unwrap();
            let at = |amount: f64| {
                let mut state = state.clone();
                state.actuator_force[joint] += amount;
                let mut workspace = Workspace::with_scope(&machine, Scope::LOADS);
                evaluate(&machine, &state, &mut workspace).otf[wheel]
            };
            let difference = (at(step) - at(-step)) / (2.0 * step);
            // the compliance of the row follows the force too, through its friction
            assert!(
                (derivative - difference).abs() < 0.03,
                "{wheel}: {derivative} {difference}"
            );
        }
    }
}

#[test]
fn wheels_are_off_the_ground_where_what_raises_them_is_always_set() {
    let text = toml(&FEET, "");
    let constant = |line: &str| match line.starts_with("set =") {
        true => "set = true".to_owned(),
        false => line.to_owned(),
    };
    let unmeasured = text.lines().filter(|line| !line.starts_with("force"));
    let text: Vec<String> = unmeasured.map(constant).collect();
    let machine = checked(&text.join("\n")).unwrap();
    assert!(!machine.supports().vary());
    assert_eq!(machine.supports().not_constant(), None);
    let names: Vec<&str> = machine.wheels().iter().map(|w| w.name.as_str()).collect();
    assert_eq!(names, FEET.map(|(name, ..)| name));
}

#[test]
fn a_track_stands_along_its_length() {
    let tracks = "[tracks.LEFT]\nlink = \"base_link\"\nfrom = [-1.4, 1.1, -0.5]\nto = [1.4, 1.1, -0.5]\npoints = 4\n\
                  [tracks.RIGHT]\nlink = \"base_link\"\nfrom = [-1.4, -1.1, -0.5]\nto = [1.4, -1.1, -0.5]\npoints = 4\n";
    let text = format!("name = \"excavator\"\n[imu]\nlink = \"base_link\"\n{tracks}");
    let wheels = WHEELS.map(|(name, ..)| format!("[signals.joints.{name}]\nposition = 0.0\n"));
    let machine = checked(&(text + &wheels.concat())).unwrap();
    assert_eq!(machine.wheels().len(), 8);
    assert_eq!(machine.polygon().edges().len(), 4);
    assert!(!machine.supports().vary());
    let state = leaning(&machine, [0.0, 0.5]);
    let sum: f64 = loads(&machine, &state).iter().map(|(_, load)| load).sum();
    let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
    let weight = evaluate(&machine, &state, &mut workspace).get(Quantity::NormalForce);
    assert!((sum - weight).abs() < 1e-6 * weight);
}

#[test]
fn a_track_is_off_the_ground_where_what_raises_it_is_always_set() {
    let track = |name: &str, y: f64| {
        format!(
            "[tracks.{name}]\nlink = \"base_link\"\nfrom = [-1.4, {y}, -0.5]\nto = [1.4, {y}, -0.5]\nraised_by = [\"A\", \"B\", \"C\"]\n"
        )
    };
    let foot = |(name, x, y, set): (&str, f64, f64, &str)| {
        format!("[supports.{name}]\nlink = \"base_link\"\nxyz = [{x}, {y}, -0.6]\nset = {set}\n")
    };
    let wheels = WHEELS.map(|(name, ..)| format!("[signals.joints.{name}]\nposition = 0.0\n"));
    let stands_on = |set: &str| {
        let feet = [
            ("A", 2.0, 1.5, "true"),
            ("B", 2.0, -1.5, "true"),
            ("C", -2.0, 0.0, set),
        ];
        let text = format!(
            "name = \"excavator\"\n[imu]\nlink = \"base_link\"\n{}{}{}{}",
            track("LEFT", 1.1),
            track("RIGHT", -1.1),
            feet.map(foot).concat(),
            wheels.concat()
        );
        let machine = checked(&text).unwrap();
        let names: Vec<String> = machine.wheels().iter().map(|w| w.name.clone()).collect();
        (names.join(" "), machine.supports().vary())
    };
    assert_eq!(stands_on("true"), ("A B C".into(), false));
    let tracks = "LEFT_1 LEFT_2 LEFT_3 RIGHT_1 RIGHT_2 RIGHT_3";
    assert_eq!(stands_on("false"), (format!("A B {tracks}"), false));
    assert_eq!(stands_on("[[1.0, 5.0]]"), (format!("A B {tracks}"), true));
}

#[test]
fn impossible_supports_are_refused_with_a_reason() {
    let refused = |text: String| checked(&text).unwrap_err().to_string();
    let neither = toml(&[], "[supports.A]\nlink = \"base_link\"\n");
    assert!(
        refused(neither).contains("supports.A"),
        "neither set nor force"
    );
    let twice = toml(&[], "[supports.FL]\nlink = \"base_link\"\nset = true\n");
    assert!(refused(twice).contains("\"FL\" twice"));
    let unknown = toml(&FEET, "").replace("raised_by = [\"OFL\"", "raised_by = [\"OXX\"");
    assert!(refused(unknown).contains("wheels.FL.raised_by"));
    let order = toml(
        &[],
        "[supports.A]\nlink = \"base_link\"\nxyz = [0.0, 0.0, -0.5]\nset = [[5.0, 3.0]]\n",
    );
    assert!(refused(order).contains("rising order"));
    let text = toml(&[], "[supports.A]\nlink = \"base_link\"\nset = \"yes\"\n");
    assert!(refused(text).contains("a list of spans"));
    let stiffness = toml(&FEET, "[contact]\ntyre_stiffness = 8e5\n");
    assert!(refused(stiffness).contains("supports.OFL.stiffness"));
    let points = toml(
        &[],
        "[tracks.T]\nlink = \"base_link\"\nfrom = [0.0, 0.0, 0.0]\nto = [1.0, 0.0, 0.0]\npoints = 1\n",
    );
    assert!(refused(points).contains("2 to 6 points"));
    let machine = crane();
    let in_line = machine.standing_on(&on(&machine, &["FL", "FR"]));
    assert_eq!(in_line.unwrap_err(), SupportSetError::Count(2));
}

/// A support watch of the crane, with its machine, which the tests feed sample by sample.
struct Told {
    machine: Machine,
    watch: SupportWatch,
}

const S: i64 = 1_000_000_000;

impl Told {
    fn new(text: &str) -> Self {
        let machine = checked(text).unwrap();
        let others = OtherSensors::default();
        let joints: Vec<String> = WHEELS.iter().map(|(name, ..)| name.to_string()).collect();
        let matched = MatchedSensors::new(&machine, &[("joints", &joints)], others).unwrap();
        let sensors = Sensors {
            actuators: machine.contact().actuator_signals(|_| true),
            ..matched.sensors
        };
        let watch = SupportWatch::new(&machine, &sensors).unwrap();
        Self { machine, watch }
    }

    /// Takes a value of these sensors at a time (s).
    fn take(&mut self, at_s: f64, sensors: &[Sensor], value: f64) {
        let values = &[value];
        for &sensor in sensors {
            let sample = Sample::new(sensor, (at_s * 1e9) as i64, values);
            let _ = self.watch.take(&self.machine, &sample);
        }
    }

    fn at(&mut self, at_s: f64) -> Result<String, GroundGap> {
        let set = self.watch.at(&self.machine, (at_s * 1e9) as i64)?;
        let supports = self.machine.supports();
        Ok(supports.names(&set.list(supports)))
    }

    fn id(&self, name: &str) -> SupportId {
        self.machine.supports().named(name)[0]
    }
}

const SWITCHES: [Sensor; 4] = [
    Sensor::Number(NumberKind::Switch, 0),
    Sensor::Number(NumberKind::Switch, 1),
    Sensor::Number(NumberKind::Switch, 2),
    Sensor::Number(NumberKind::Switch, 3),
];
const LOADS: [Sensor; 4] = [
    Sensor::Number(NumberKind::Actuator, 0),
    Sensor::Number(NumberKind::Actuator, 1),
    Sensor::Number(NumberKind::Actuator, 2),
    Sensor::Number(NumberKind::Actuator, 3),
];
const ON_WHEELS: &str = "FL, FR, RL, RR";
const ON_FEET: &str = "OFL, OFR, ORL, ORR";

/// The crane whose switches alone tell.
fn without_loads() -> String {
    let text = toml(&FEET, "[contact]\ntransition = 0.5\n");
    let kept = text.lines().filter(|line| !line.starts_with("force"));
    kept.collect::<Vec<_>>().join("\n")
}

#[test]
fn supports_are_known_from_past_samples_only() {
    let mut told = Told::new(&without_loads());
    let first = told.id("OFL");
    assert_eq!(told.at(0.0), Err(GroundGap::Missing(first)));
    told.take(1.0, &SWITCHES, 0.0);
    // the first set that is known follows no other
    assert_eq!(told.at(1.0).as_deref(), Ok(ON_WHEELS));
    told.take(2.0, &SWITCHES, 1.0);
    // the feet take the weight, which were in the air
    assert_eq!(told.at(2.4), Err(GroundGap::Taken));
    assert_eq!(told.at(2.5).as_deref(), Ok(ON_FEET));
    // a change that is over before the next row is a change, and a foot that is back takes nothing that it did not carry
    told.take(3.0, &SWITCHES[..1], 0.0);
    // a foot alone leaves the ground: whatever carries beside the others then, it may be a fall
    assert_eq!(told.at(3.05), Err(GroundGap::Transition));
    told.take(3.1, &SWITCHES[..1], 1.0);
    assert_eq!(told.at(3.5), Err(GroundGap::Transition));
    assert_eq!(told.at(3.6).as_deref(), Ok(ON_FEET));
    // of the others nothing was heard for their greatest age
    assert_eq!(told.at(4.0), Err(GroundGap::Missing(told.id("OFR"))));
    told.take(4.5, &SWITCHES, 1.0);
    assert_eq!(told.at(4.5).as_deref(), Ok(ON_FEET));
    // a number that is none tells nothing, and one that is not later neither
    told.take(5.0, &SWITCHES[..1], f64::NAN);
    assert_eq!(told.at(5.0), Err(GroundGap::Missing(first)));
    told.take(4.8, &SWITCHES[..1], 1.0);
    assert_eq!(told.at(5.1), Err(GroundGap::Missing(first)));
    told.take(5.2, &SWITCHES[..1], 1.0);
    assert_eq!(told.at(5.3).as_deref(), Ok(ON_FEET));
    // all are retracted, one after the other: the wheels take the weight
    told.take(5.4, &SWITCHES[..3], 0.0);
    assert_eq!(told.at(5.45), Err(GroundGap::Transition));
    told.take(5.5, &SWITCHES[3..], 0.0);
    assert_eq!(told.at(5.9), Err(GroundGap::Taken));
    assert_eq!(told.at(6.0).as_deref(), Ok(ON_WHEELS));
}

#[test]
fn a_support_that_carries_although_it_is_told_to_be_off_leaves_the_set_unknown() {
    let mut told = Told::new(&toml(&FEET, ""));
    told.take(1.0, &SWITCHES, 0.0);
    told.take(1.0, &LOADS, 100.0);
    assert_eq!(told.at(1.0).as_deref(), Ok(ON_WHEELS));
    told.take(1.5, &LOADS[2..3], 20_000.0);
    assert_eq!(told.at(1.5), Err(GroundGap::Carries(told.id("ORL"))));
    // the load is too old to say so
    told.take(2.9, &SWITCHES, 0.0);
    assert_eq!(told.at(3.6).as_deref(), Ok(ON_WHEELS));
}

#[test]
fn a_foot_by_its_load_stays_set_while_another_one_stands() {
    let text = toml(&FEET, "[contact]\ntransition = 0.0\n");
    let text: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with("set"))
        .collect();
    let mut told = Told::new(&text.join("\n"));
    told.take(1.0, &LOADS, 9_000.0);
    assert_eq!(told.at(1.0).as_deref(), Ok(ON_FEET));
    told.take(2.0, &LOADS[..3], 9_000.0);
    told.take(2.0, &LOADS[3..], 0.0);
    assert_eq!(told.at(2.0).as_deref(), Ok(ON_FEET), "it is lifted");
    told.take(3.0, &LOADS, 0.0);
    assert_eq!(told.at(3.0).as_deref(), Ok(ON_WHEELS), "all are taken back");
    // one that comes back is the only one that is set: the others were taken back
    told.take(4.0, &LOADS, 0.0);
    told.take(4.1, &LOADS[..1], 9_000.0);
    assert_eq!(told.at(4.1).as_deref(), Ok("FL, FR, OFL, RL, RR"));
}

#[test]
fn spans_count_from_the_first_sample() {
    let text = toml(&FEET, "[contact]\ntransition = 0.0\n");
    let text: Vec<String> = (text.lines().filter(|line| !line.starts_with("force")))
        .map(|line| match line.starts_with("set =") {
            true => "set = [[1.0, 2.0]]".to_owned(),
            false => line.to_owned(),
        })
        .collect();
    let mut told = Told::new(&text.join("\n"));
    assert_eq!(told.at(10.0), Err(GroundGap::Missing(told.id("OFL"))));
    told.watch.count_spans_from(10 * S);
    assert_eq!(told.at(10.9).as_deref(), Ok(ON_WHEELS));
    assert_eq!(told.at(11.0).as_deref(), Ok(ON_FEET));
    assert_eq!(told.at(12.0).as_deref(), Ok(ON_WHEELS));
}

proptest! {
    #![proptest_config(cases(60))]

    /// With measured loads that lift a foot in some of the rows, or barely do not.
    #[test]
    fn measured_loads_in_lanes_equal_those_one_by_one(
        leans in prop::array::uniform8([-0.6_f64..0.6, -0.6_f64..0.6]),
        forces in prop::array::uniform24(0.0_f64..50_000.0),
        lifted in prop::array::uniform8(prop_oneof![3 => -600.0_f64..100.0, 1 => 0.0_f64..30_000.0]),
    ) {
        let whole = checked(&toml(&FEET, "[uncertainty]\nwheel_position = 0.02\n")).unwrap();
        let machine = whole.standing_on(&on(&whole, &FEET.map(|(name, ..)| name))).unwrap();
        let mut states = Vec::new();
        for (row, (lean, forces)) in leans.into_iter().zip(forces.chunks_exact(3)).enumerate() {
            let mut state = leaning(&machine, lean);
            state.actuator_force[..3].copy_from_slice(forces);
            state.actuator_force[3] = lifted[row];
            states.push(state);
        }
        let model = std::sync::Arc::new(tipwatch_mechanics::Model::WholeBody);
        assert_lanes_equal_scalar(&machine, &mut states, Scope::ALL, &model);
    }
}
