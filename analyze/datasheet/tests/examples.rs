//! Every template's worked example weighs as much as its sheet states.

use strum::IntoEnumIterator;
use tipwatch_datasheet::{Machine, Sheet, Template};
use tipwatch_mechanics::RestingMachine;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};

/// Loads of all wheels at rest in the posture of the sheet (N), by name, and the machine's mass (kg).
pub(crate) fn weigh(machine: &Machine) -> (Vec<(String, f64)>, f64) {
    let text = machine.machine_file("machine.urdf", None);
    let spec =
        MachineSpec::from_toml(&text, "machine.toml").unwrap_or_else(|e| panic!("{e}\n{text}"));
    let urdf = machine.urdf();
    let checked = spec
        .check(&urdf, "machine.urdf", LogFacts::default())
        .unwrap_or_else(|e| panic!("{e}\n{text}\n{urdf}"));
    let resting = RestingMachine::new(&checked, &checked.reference().posture.positions);
    let loads = &resting.outcome().load;
    let named = checked.wheels().iter().zip(loads);
    (
        named.map(|(w, load)| (w.name.clone(), *load)).collect(),
        resting.whole().mass,
    )
}

/// Axle loads by the equations of mechanics (kg).
pub(crate) fn axle_loads(machine: &Machine) -> Vec<f64> {
    let (loads, _) = weigh(machine);
    let axles = machine.wheels.iter().map(|w| w.axle).max().unwrap() + 1;
    (0..axles)
        .map(|axle| {
            let of_axle = machine.wheels.iter().filter(|w| w.axle == axle);
            let load = |name: &str| loads.iter().find(|(n, _)| n == name).unwrap().1;
            of_axle.map(|w| load(&w.name)).sum::<f64>() / 9.806_65
        })
        .collect()
}

fn example(template: Template) -> (Sheet, Machine) {
    let sheet = Sheet::from_toml(template.example(), &format!("{template}.toml"))
        .unwrap_or_else(|e| panic!("{e}"));
    let machine = sheet.machine().unwrap_or_else(|e| panic!("{e}"));
    (sheet, machine)
}

#[test]
fn val_examples_weigh_what_their_sheets_say() {
    for template in Template::iter() {
        let (sheet, machine) = example(template);
        let (_, mass) = weigh(&machine);
        assert!(
            (mass / machine.mass - 1.0).abs() < 1e-9,
            "{template}: {mass} kg"
        );
        assert!(
            (mass / sheet.mass.si - 1.0).abs() < 0.01,
            "{template}: {mass} kg"
        );
        let found = axle_loads(&machine);
        if let Some(stated) = machine.stated_axle_loads() {
            for (a, b) in found.iter().zip(&stated) {
                assert!(
                    (a / b - 1.0).abs() < 1e-6,
                    "{template}: {found:?} kg, sheet {stated:?} kg"
                );
            }
        }
        let total: f64 = found.iter().sum();
        assert!(
            (total / mass - 1.0).abs() < 1e-9,
            "{template}: {total} {mass}"
        );
    }
}

#[test]
fn val_examples_reach_as_far_as_their_sheets_say() {
    for template in Template::iter() {
        let (sheet, machine) = example(template);
        let Some(stated) = sheet.arm.reach else {
            continue;
        };
        let ratio = machine.reach / stated.si;
        assert!(
            (0.98..1.12).contains(&ratio),
            "{template}: {} m, sheet {} m",
            machine.reach,
            stated.si
        );
    }
}

/// tan(tilt angle) = half track / height of the centre of mass.
#[test]
fn val_a_tilt_angle_gives_the_height_of_the_centre_of_mass() {
    let text = Template::Telehandler.example();
    let is_pendulum = |line: &&str| line.starts_with("pendulum");
    assert!(text.lines().any(|line| is_pendulum(&line)));
    let rigid: Vec<&str> = text.lines().filter(|line| !is_pendulum(line)).collect();
    let weighed = rigid
        .join("\n")
        .replace("[[axles]]", "[[axles]]\nload = 3665");
    let with = |line: &str| {
        let text = weighed.replace("template =", &format!("{line}\ntemplate ="));
        Sheet::from_toml(&text, "telehandler")
            .unwrap()
            .machine()
            .unwrap()
    };
    let machine = with("tilt_angle = 38");
    let height = 0.925 / 38.0_f64.to_radians().tan();
    assert!(
        (machine.centre_of_mass[2] - height).abs() < 1e-9,
        "{:?}",
        machine.centre_of_mass
    );
    let machine = with("centre_of_mass_height = 1.05");
    assert!((machine.centre_of_mass[2] - 1.05).abs() < 1e-9);
    for load in axle_loads(&machine) {
        assert!((load / 3665.0 - 1.0).abs() < 1e-6, "{load}");
    }
}

/// A forklift with a single wheel in the middle of the rear.
#[test]
fn three_wheels_weigh_what_the_sheet_says() {
    let text = Template::Forklift.example();
    let three = text.replace("track = \"830 mm\"                # [1] 3.7\n", "");
    let three = three.replace(
        "pendulum = 3                    # [ours] the steered axle hangs on a pivot\n",
        "",
    );
    let machine = Sheet::from_toml(&three, "three")
        .unwrap()
        .machine()
        .unwrap();
    let names: Vec<&str> = machine.wheels.iter().map(|w| w.name.as_str()).collect();
    assert_eq!(names, ["FL", "FR", "RC"]);
    for (a, b) in axle_loads(&machine).iter().zip([1489.0, 1817.0]) {
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    }
}

/// Values that are not on the sheet have a standard deviation and a line; values on the sheet have none.
#[test]
fn every_assumption_is_told_with_its_reason() {
    for template in Template::iter() {
        let (_, machine) = example(template);
        let text = machine.machine_file("machine.urdf", None);
        let joined = text.replace("\n# ", " ");
        for assumption in &machine.assumptions {
            assert!(
                joined.contains(&assumption.to_string()),
                "{template}: {assumption}\n{text}"
            );
            assert!(machine.summary().contains(&assumption.to_string()));
        }
        assert!(
            machine
                .assumptions
                .iter()
                .any(|a| a.what.contains("height of the centre of mass"))
        );
        for link in machine.links.iter().filter(|link| link.mass > 0.0) {
            assert!(link.mass_sigma > 0.0, "{template}: {}", link.name);
            assert!(
                link.com_sigma.iter().all(|s| *s > 0.0),
                "{template}: {}",
                link.name
            );
        }
    }
}

#[test]
fn a_crane_whose_sheet_says_that_its_outriggers_are_set_stands_on_them() {
    let text = Template::MobileCrane.example();
    let on = text.replace("[[outriggers]]", "[[outriggers]]\nset = true");
    let machine = Sheet::from_toml(&on, "crane.toml")
        .unwrap()
        .machine()
        .unwrap();
    let (loads, mass) = weigh(&machine);
    let names: Vec<&str> = loads.iter().map(|(name, _)| name.as_str()).collect();
    let pads = [
        "OUTRIGGER_FL",
        "OUTRIGGER_FR",
        "OUTRIGGER_RL",
        "OUTRIGGER_RR",
    ];
    assert_eq!(names, pads);
    let total: f64 = loads.iter().map(|(_, load)| load).sum();
    assert!((total / (9.806_65 * mass) - 1.0).abs() < 1e-9, "{loads:?}");
    assert!(loads.iter().all(|(_, load)| *load > 0.0), "{loads:?}");
}

/// Stabilisers in front of a telehandler lift its front wheels, not the rear ones.
#[test]
fn one_pair_of_outriggers_lifts_the_axle_next_to_it() {
    let machine = |set: &str| {
        let pair = format!("\n[[outriggers]]\nbehind = -0.3\nbase = 2.2\n{set}");
        let text = Template::Telehandler.example().to_owned() + &pair;
        Sheet::from_toml(&text, "telehandler.toml")
            .unwrap()
            .machine()
            .unwrap()
    };
    let stands = machine("set = true\n");
    let file = stands.machine_file("machine.urdf", None);
    let spec = MachineSpec::from_toml(&file, "machine.toml").unwrap();
    let checked = spec
        .check(&stands.urdf(), "machine.urdf", LogFacts::default())
        .unwrap();
    let names: Vec<&str> = checked.wheels().iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, ["OUTRIGGER_FL", "OUTRIGGER_FR", "RL", "RR"]);
    let open = machine("").machine_file("machine.urdf", None);
    assert!(
        open.contains("in [wheels.FL] and [wheels.FR]: raised_by"),
        "{open}"
    );
}

#[test]
fn signals_of_outriggers_become_supports_that_come_and_go() {
    let text = Template::MobileCrane.example();
    let set = "[[outriggers]]\nset = { left = { topic = \"/pads\", field = \"left\" }, \
               right = { topic = \"/pads\", field = \"right\", above = 0.9 } }";
    let text = text.replace("[[outriggers]]", set);
    let machine = Sheet::from_toml(&text, "crane.toml")
        .unwrap()
        .machine()
        .unwrap();
    let file = machine.machine_file("machine.urdf", None);
    let spec = MachineSpec::from_toml(&file, "machine.toml").unwrap();
    let checked = spec
        .check(&machine.urdf(), "machine.urdf", LogFacts::default())
        .unwrap();
    let supports = checked.supports();
    assert!(supports.vary());
    assert_eq!(supports.all.len(), 12);
    assert!(file.contains("above = 0.9"), "{file}");
    assert_eq!(file.matches("raised_by = [").count(), 8, "{file}");
}
