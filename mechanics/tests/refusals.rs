//! Invalid machine descriptions are rejected with what was expected, what was found and where.

use crate::support;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::{Machine, MachineError};

fn refusal(result: Result<Machine, MachineError>) -> String {
    result.expect_err("an invalid machine").to_string()
}

/// Error for the rigid machine with one replacement in its machine file.
fn of_file(from: &str, to: &str) -> String {
    refusal(support::edited("rigid", |text| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    }))
}

/// Error for the rigid machine with one replacement in its URDF.
fn of_urdf(from: &str, to: &str) -> String {
    let urdf = support::data("rigid.urdf");
    assert!(urdf.contains(from), "{from}");
    let spec = MachineSpec::from_toml(&support::data("rigid.toml"), "machine.toml").unwrap();
    refusal(spec.check(&urdf.replace(from, to), "machine.urdf", LogFacts::default()))
}

fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "\"{part}\" is not in: {message}");
    }
}

#[test]
fn names_missing_from_the_urdf_are_rejected() {
    assert_says(
        &of_file("link = \"wheel_fl\"", "link = \"wheel_FLX\""),
        &[
            "machine.toml",
            "wheels.FL.link",
            "wheel_FLX",
            "machine.urdf",
        ],
    );
    assert_says(
        &of_file("pivot = \"lift\"", "pivot = \"lifft\""),
        &["linkage.lift.pivot", "lifft", "joint"],
    );
    assert_says(
        &of_file("root = \"arm_slew\"", "root = \"arm\""),
        &["arm.root", "did you mean \"arm_slew\""],
    );
}

const WEIGHED: &str = "[[payload]]\nlink = \"tool\"\nmass = \"estimate\"\n";

/// The rigid machine with a force on its lift linkage, this accuracy of it, and payloads.
fn weighing(accuracy: &str, payloads: &str) -> Result<Machine, MachineError> {
    support::edited("rigid", |text| {
        let force =
            format!("name = \"lift\"\nforce = {{ topic = \"/f\", field = \"f\" }}\n{accuracy}\n");
        text.replacen("name = \"lift\"\n", &force, 1) + payloads
    })
}

#[test]
fn one_force_weighs_one_payload_at_a_time() {
    let two =
        |first: &str, second: &str| weighing("", &format!("{WEIGHED}{first}\n{WEIGHED}{second}\n"));
    assert_says(
        &refusal(two("", "")),
        &[
            "payload 2: mass",
            "linkage lift",
            "as payload 1",
            "machine.toml",
        ],
    );
    refusal(two("to = 10.0", "from = 9.0"));
    two("to = 10.0", "from = 10.0").unwrap();
}

#[test]
fn a_force_that_weighs_a_payload_has_an_error_and_friction() {
    weighing("", WEIGHED).unwrap();
    for (accuracy, key) in [
        ("friction_share = 0.0", "linkage.lift.friction_share"),
        ("friction_share = -0.1", "linkage.lift.friction_share"),
        ("force_sigma = 0.0", "linkage.lift.force_sigma"),
        ("force_sigma = -500.0", "linkage.lift.force_sigma"),
    ] {
        assert_says(
            &refusal(weighing(accuracy, WEIGHED)),
            &[key, "positive", "weighs a payload"],
        );
        // one that only is compared may be exact
        if accuracy.ends_with("0.0") && !accuracy.contains("-500") {
            weighing(accuracy, "").unwrap();
        }
    }
}

#[test]
fn a_force_that_only_is_compared_has_errors_that_are_not_negative() {
    for (accuracy, key) in [
        ("friction_share = -0.1", "linkage.lift.friction_share"),
        ("force_sigma = -500.0", "linkage.lift.force_sigma"),
    ] {
        assert_says(&refusal(weighing(accuracy, "")), &[key, "not negative"]);
    }
}

#[test]
fn a_rest_of_the_arm_is_stated_from_the_smaller_to_the_larger_position() {
    for range in ["[1.0, 1.0]", "[1.0, 0.5]"] {
        let stated = format!("pivot = \"lift\"\nrests_within = {range}");
        assert_says(
            &of_file("pivot = \"lift\"", &stated),
            &["linkage.lift.rests_within", "the smaller one first"],
        );
    }
}

#[test]
fn impossible_inertial_parameters_are_rejected() {
    assert_says(
        &of_urdf("<mass value='2200.0'/>", "<mass value='-2200.0'/>"),
        &["base_link", "positive mass", "-2200"],
    );
    assert_says(
        &of_urdf("ixx='480.0'", "ixx='4800.0'"),
        &["base_link", "none larger than the sum", "kg m^2"],
    );
    assert_says(
        &of_urdf("<mass value='2200.0'/>", "<mass value='heavy'/>"),
        &["machine.urdf, line 4", "finite number", "heavy"],
    );
}

#[test]
fn triangles_that_cannot_close_are_rejected() {
    assert_says(
        &of_file(
            "xyz = [0.376106321013, 0, 0]",
            "xyz = [0.376106321013, 0, 0.4]",
        ),
        &["linkage \"lift\" cannot close", "one plane"],
    );
    assert_says(
        &of_file("xyz = [0.376106321013, 0, 0]", "xyz = [0, 0, 0]"),
        &["cannot close", "three distinct corners"],
    );
    let short = "<joint name='lift_rod' type='prismatic'><parent link='lift_cylinder_link'/><child link='lift_rod_link'/><origin xyz='0.085 0 0' rpy='0 -0 0'/><axis xyz='1 0 0'/><limit lower='-10' upper='10'";
    let message = of_urdf(
        short,
        &short.replace("lower='-10' upper='10'", "lower='5' upper='6'"),
    );
    assert_says(&message, &["cannot close", "within the rod's limits"]);
}

#[test]
fn joints_without_a_source_of_motion_are_rejected() {
    let spec = MachineSpec::from_toml(&support::data("rigid.toml"), "machine.toml").unwrap();
    let logged = [
        "slew".to_string(),
        "lift".into(),
        "tilt".into(),
        "steer_fl".into(),
        "steer_fr".into(),
    ];
    let check = |names: &[String]| {
        let facts = LogFacts {
            joint_names: Some(names),
            ..LogFacts::default()
        };
        spec.check(&support::data("rigid.urdf"), "machine.urdf", facts)
    };
    assert_says(
        &refusal(check(&logged)),
        &["\"extension\"", "slew, lift, tilt"],
    );
    let with_extension: Vec<String> = logged.into_iter().chain(["extension".into()]).collect();
    let machine = check(&with_extension).unwrap();
    assert_eq!(
        machine
            .joints()
            .iter()
            .filter(|j| !j.logged && j.spins_wheel.is_some())
            .count(),
        4
    );
}

#[test]
fn invalid_numbers_and_keys_are_rejected() {
    assert_says(
        &of_file("radius = 0.35", "radius = -0.35"),
        &["wheels.FL.radius", "positive length", "-0.35"],
    );
    assert_says(
        &of_file(
            "roll_moment_distribution = 0.5",
            "roll_moment_distribution = 1.5",
        ),
        &["contact.roll_moment_distribution", "0 to 1"],
    );
    assert_says(
        &of_file("roll_moment_distribution = 0.5", "rollmoment = 0.5"),
        &["machine.toml", "line", "rollmoment"],
    );
}

#[test]
fn invalid_trees_are_rejected() {
    assert_says(
        &of_urdf("<child link='wheel_fl'/>", "<child link='wheel_fx'/>"),
        &["wheel_fl", "existing links", "wheel_fx"],
    );
    assert_says(
        &of_urdf("<child link='wheel_fl'/>", "<child link='wheel_fr'/>"),
        &["one parent joint"],
    );
    assert_says(
        &of_urdf("type='prismatic'", "type='floating'"),
        &["fixed, revolute, continuous, prismatic", "floating"],
    );
    assert_says(
        &of_urdf("<robot name='hdmm_rigid'>", "<robot name='hdmm_rigid'"),
        &["machine.urdf, line", "XML"],
    );
}

#[test]
fn deprecated_front_share_key_is_read_but_not_twice() {
    let with = |contact: &str, uncertainty: &str| {
        let text = support::data("rigid.toml").replace("roll_moment_distribution = 0.5", contact);
        MachineSpec::from_toml(
            &format!("{text}\n[uncertainty]\n{uncertainty}"),
            "machine.toml",
        )
    };
    for key in ["front_share", "roll_moment_distribution"] {
        let spec = with(&format!("{key} = 0.25"), &format!("{key} = 0.125")).unwrap();
        assert_eq!(spec.contact.roll_moment_distribution, Some(0.25));
        assert_eq!(spec.uncertainty.roll_moment_distribution, 0.125);
    }
    let twice = with("front_share = 0.5\nroll_moment_distribution = 0.5", "").unwrap_err();
    assert_says(&twice.to_string(), &["duplicate field"]);
}
