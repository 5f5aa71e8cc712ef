//! URDFs as robots have them: what generators and people write, what is mended, and what is refused, all at once.

use crate::support;
use tipwatch_mechanics::machine::{InertiaFault, LogFacts, MachineSpec, Outline, Replacement};
use tipwatch_mechanics::{Machine, MachineError};

const WHEELS: [(&str, f64, f64); 4] = [
    ("FL", 1.0, 0.8),
    ("FR", 1.0, -0.8),
    ("RL", -1.0, 0.8),
    ("RR", -1.0, -0.8),
];
const CHASSIS: &str = "<link name='chassis'><inertial><mass value='1000'/>
  <inertia ixx='100' iyy='200' izz='250' ixy='0' ixz='0' iyz='0'/></inertial></link>";

/// A URDF around a chassis with four wheel frames.
fn urdf(chassis: &str, more: &str) -> String {
    let wheel = |(name, x, y): (&str, f64, f64)| {
        format!(
            "<link name='{name}'/><joint name='{name}' type='fixed'><parent link='chassis'/><child link='{name}'/>
             <origin xyz='{x} {y} -0.3'/><axis xyz='0 0 0'/></joint>\n"
        )
    };
    let wheels: String = WHEELS.map(wheel).concat();
    format!("<?xml version='1.0'?>\n<robot name='r'>\n{chassis}\n{wheels}{more}\n</robot>")
}

fn machine(urdf: &str, head: &str) -> Result<Machine, MachineError> {
    let wheel = |(name, ..): (&str, f64, f64)| {
        format!("[wheels.{name}]\nlink = \"{name}\"\nradius = 0.3\n")
    };
    let wheels = WHEELS.map(wheel).concat();
    let text = format!("name = \"m\"\n{head}\n[contact]\nroll_moment_distribution = 0.5\n{wheels}");
    let spec = MachineSpec::from_toml(&text, "m.toml")?;
    spec.check(urdf, "m.urdf", LogFacts::default())
}

fn link(name: &str, mass: f64, [x, y, z]: [f64; 3], shape: &str) -> String {
    format!(
        "<link name='{name}'><inertial><origin xyz='0 0 0.1'/><mass value='{mass}'/>
         <inertia ixx='{x}' iyy='{y}' izz='{z}' ixy='0' ixz='0' iyz='0'/></inertial>{shape}</link>"
    )
}

fn joint(kind: &str, parent: &str, child: &str, inside: &str) -> String {
    format!(
        "<joint name='{child}_joint' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{inside}</joint>"
    )
}

const BOX: &str = "<collision><geometry><box size='0.6 0.4 0.2'/></geometry></collision>";

#[test]
fn what_generators_leave_behind_is_read() {
    let arm = link("arm", 50.0, [1.0, 1.0, 1.0], "");
    for (chassis, more) in [
        // an axis of no length on a joint without motion is in every wheel frame above
        (CHASSIS.to_string(), String::new()),
        // prefixes that nobody declares
        (
            CHASSIS.replace("</link>", "<sensor:laser v:rate='10'/></link>"),
            "<gazebo:plugin name='a'><link name='chassis'/></gazebo:plugin>".into(),
        ),
        // a link with an inertia and no mass is a frame
        (
            CHASSIS.into(),
            link("frame", 0.0, [1.0, 1.0, 1.0], "") + &joint("fixed", "chassis", "frame", ""),
        ),
        // limits and axes of fixed joints mean nothing
        (
            CHASSIS.into(),
            arm.clone()
                + &joint(
                    "fixed",
                    "chassis",
                    "arm",
                    "<axis xyz='0 0 nan'/><limit lower='x'/><mimic joint='nobody'/>",
                ),
        ),
    ] {
        let found = machine(&urdf(&chassis, &more), "");
        assert!(found.is_ok(), "{more}: {:?}", found.err());
    }
    let late = urdf(CHASSIS, "").replace("<?xml", "\n<!-- made -->\n<?xml");
    assert!(machine(&late, "").is_ok());
    let moving = arm + &joint("revolute", "chassis", "arm", "<axis xyz='0 0 0'/>");
    let refused = machine(&urdf(CHASSIS, &moving), "").unwrap_err();
    let text = refused.to_string();
    assert!(
        text.contains("non-zero length") && text.contains("arm_joint"),
        "{text}"
    );
}

#[test]
fn a_floating_or_planar_joint_says_where_the_machine_stands() {
    for kind in ["floating", "planar"] {
        let world = format!(
            "<link name='world'/><link name='map'/>{}{}",
            joint("fixed", "world", "map", ""),
            joint(
                kind,
                "map",
                "chassis",
                "<origin xyz='3 0 0'/><axis xyz='0 0 0'/>"
            )
        );
        let in_world = machine(&urdf(CHASSIS, &world), "").unwrap();
        let alone = machine(&urdf(CHASSIS, ""), "").unwrap();
        assert_eq!(in_world.base_link(), "chassis");
        assert_eq!(in_world.mass(), alone.mass());
        for (a, b) in in_world.wheels().iter().zip(alone.wheels()) {
            assert!(
                (a.centre_at_zero - b.centre_at_zero).norm() < 1e-12,
                "{}",
                a.name
            );
        }
        let heavy = world.replace("<link name='map'/>", &link("map", 5.0, [1.0; 3], ""));
        let load = link("load", 5.0, [1.0; 3], "") + &joint(kind, "chassis", "load", "");
        for refused in [heavy, load] {
            let text = machine(&urdf(CHASSIS, &refused), "")
                .unwrap_err()
                .to_string();
            assert!(text.contains("massless world"), "{text}");
        }
    }
}

#[test]
fn a_joint_that_mimics_follows_with_factor_and_offset_or_stays_at_the_offset() {
    use tipwatch_mechanics::machine::JointCoupling;
    let slides = |rule: &str| format!("<axis xyz='0 0 1'/><mimic {rule}/>");
    let links = |names: &[&str]| -> String {
        let links = names.iter().map(|name| link(name, 10.0, [1.0; 3], ""));
        links.collect()
    };
    let chain = links(&["a", "b", "c"])
        + &joint("prismatic", "chassis", "a", "<axis xyz='0 0 1'/>")
        + &joint(
            "prismatic",
            "a",
            "b",
            &slides("joint='a_joint' multiplier='2' offset='0.5'"),
        )
        + &joint(
            "prismatic",
            "b",
            "c",
            &slides("joint='b_joint' multiplier='-1' offset='0.1'"),
        );
    let found = machine(&urdf(CHASSIS, &chain), "").unwrap();
    let coupling = |name: &str| {
        let body = found.bodies().iter().find(|body| body.name == name);
        body.unwrap().coupling
    };
    let JointCoupling::Mimic {
        multiplier, offset, ..
    } = coupling("c")
    else {
        panic!("{:?}", coupling("c"));
    };
    assert_eq!((multiplier, offset), (-2.0, -0.4));
    // a joint that follows one that cannot move rests at its offset
    let fixed = links(&["a", "b"])
        + &joint("fixed", "chassis", "a", "")
        + &joint(
            "prismatic",
            "a",
            "b",
            &slides("joint='a_joint' multiplier='3' offset='0.25'"),
        );
    let found = machine(&urdf(CHASSIS, &fixed), "").unwrap();
    assert_eq!(found.bodies().len(), 1);
    let of_b = found.links().iter().find(|link| link.name == "b").unwrap();
    assert_eq!(of_b.body_from_link.translation.z, 0.25);
    for (rules, word) in [
        (["joint='nobody'", "joint='a_joint'"], "no joint \"nobody\""),
        (["joint='b_joint'", "joint='a_joint'"], "in a circle"),
    ] {
        let more = links(&["a", "b"])
            + &joint("prismatic", "chassis", "a", &slides(rules[0]))
            + &joint("prismatic", "a", "b", &slides(rules[1]));
        let text = machine(&urdf(CHASSIS, &more), "").unwrap_err().to_string();
        assert!(text.contains(word) && text.contains("a_joint"), "{text}");
    }
}

#[test]
fn all_faults_of_a_urdf_come_in_one_message() {
    let more = [
        link("heavy", -5.0, [1.0; 3], ""),
        link("word", 1.0, [1.0; 3], "").replace("'1'", "'one'"),
        "<link/>".into(),
        "<link name='twice'/><link name='twice'/>".into(),
        joint("fixed", "chassis", "nobody", ""),
        joint("sliding", "chassis", "heavy", ""),
        joint("revolute", "chassis", "word", "<axis xyz='0 0'/>"),
    ];
    let error = machine(&urdf(CHASSIS, &more.concat()), "").unwrap_err();
    let MachineError::Several { errors, .. } = &error else {
        panic!("{error}");
    };
    // one is not a number in four places, and no parent is left out
    let text = error.to_string();
    for word in [
        "mass -5 kg",
        "\"one\"",
        "<link name=",
        "twice",
        "no link \"nobody\"",
        "sliding",
        "three numbers",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    assert!(errors.len() >= 7, "{text}");
    let roots = "<link name='second'/><link name='third'/>";
    let text = machine(&urdf(CHASSIS, roots), "").unwrap_err().to_string();
    assert!(text.contains("\"second\", \"third\""), "{text}");
    let cycle = "<link name='p'/><link name='q'/>".to_string()
        + &joint("fixed", "p", "q", "")
        + &joint("fixed", "q", "p", "");
    let error = machine(&urdf(CHASSIS, &cycle), "").unwrap_err();
    assert!(error.to_string().contains("a cycle"), "{error}");
}

#[test]
fn templates_are_told_to_be_expanded() {
    for leftover in [
        "<xacro:wheel name='a'/>",
        "<include filename='a.xacro'/>",
        "<link name='${prefix}link'/>",
        "<link name='a'><inertial><mass value='${2 * m}'/></inertial></link>",
    ] {
        let error = machine(&urdf(CHASSIS, leftover), "").unwrap_err();
        assert!(
            error.to_string().contains("xacro FILE.xacro"),
            "{leftover}: {error}"
        );
    }
    let mesh = "<link name='a'><visual><geometry><mesh filename='$(find x)/a.stl'/></geometry></visual></link>".to_string()
        + &joint("fixed", "chassis", "a", "");
    assert!(machine(&urdf(CHASSIS, &mesh), "").is_ok());
}

/// Arms on the chassis whose inertias no body has.
fn impossible() -> String {
    [
        ("turned", 40.0, [1.0, 1.0, 9.0], BOX),
        ("negative", 30.0, [-2.0, 3.0, 3.0], ""),
        ("none", 60.0, [0.0; 3], ""),
        ("huge", 20.0, [900.0, 900.0, 900.0], ""),
    ]
    .map(|(name, mass, moments, shape)| {
        link(name, mass, moments, shape) + &joint("fixed", "chassis", name, "")
    })
    .concat()
}

#[test]
fn impossible_inertias_are_refused_together_with_their_effect() {
    let error = machine(&urdf(CHASSIS, &impossible()), "").unwrap_err();
    let MachineError::Inertias { inertias, .. } = &error else {
        panic!("{error}");
    };
    let found: Vec<_> = inertias
        .iter()
        .map(|i| (i.link.as_str(), i.fault))
        .collect();
    assert!(matches!(
        found[..],
        [
            ("turned", InertiaFault::Triangle { .. }),
            ("negative", InertiaFault::Negative),
            ("none", InertiaFault::Missing),
            ("huge", InertiaFault::TooLarge { .. })
        ]
    ));
    // 40 kg of 0.6 x 0.4 x 0.2 m: 40 / 12 (0.04 + 0.16), (0.36 + 0.04), (0.36 + 0.16)
    let turned = &inertias[0];
    assert_eq!(turned.replacement, Replacement::Box([0.6, 0.4, 0.2]));
    for (used, by_hand) in turned
        .used_kg_m2
        .iter()
        .zip([2.0 / 3.0, 4.0 / 3.0, 52.0 / 30.0])
    {
        assert!((used - by_hand).abs() < 1e-12, "{used}");
    }
    // the largest difference, 9 - 52/30, times 5 rad/s^2 over a track of 1.6 m
    let load = (9.0 - 52.0 / 30.0) * 5.0 / 1.6;
    assert!(
        (turned.load_change_n - load).abs() < 1e-9,
        "{}",
        turned.load_change_n
    );
    assert_eq!(inertias[1].replacement, Replacement::Nearest);
    assert!(matches!(inertias[2].replacement, Replacement::Ball(_)));
    let text = error.to_string();
    for word in [
        "turned",
        "negative",
        "huge",
        "could change a wheel load by",
        "--accept-inertias",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    assert!(!text.contains("e-1"), "noise of a rotation: {text}");
}

#[test]
fn accepted_inertias_are_replaced_noted_and_uncertain() {
    use tipwatch_mechanics::machine::{InertiaElement, Parameter};
    let text = urdf(CHASSIS, &impossible());
    let found = machine(&text, "accept_inertias = true").unwrap();
    assert_eq!(found.replaced_inertias().len(), 4);
    let turned = found
        .links()
        .iter()
        .position(|link| link.name == "turned")
        .unwrap();
    let tensor = found.links()[turned].inertia.about_com;
    assert!((tensor[(0, 0)] - 2.0 / 3.0).abs() < 1e-12, "{tensor}");
    assert_eq!(found.links()[turned].inertia.mass, 40.0);
    assert_eq!(found.links()[turned].inertia.com.z, 0.1);
    // half of the largest moment, for products too
    for element in InertiaElement::ALL {
        let sigma = Parameter::LinkInertia(turned, element).sigma(&found);
        assert!((sigma - 26.0 / 30.0).abs() < 1e-12, "{element:?}: {sigma}");
    }
    let noted = |link: &str| {
        let is_noted = |note: &str| note.contains("accepted") && note.contains(link);
        found.notes().iter().any(|note| is_noted(note))
    };
    assert!(
        ["turned", "negative", "none", "huge"]
            .iter()
            .all(|link| noted(link))
    );
    // without rotation the loads do not depend on it: mass and centre of mass are as stated
    let refused = machine(&text, "accept_inertias = false");
    assert!(matches!(refused, Err(MachineError::Inertias { .. })));
}

#[test]
fn inertias_too_small_to_matter_are_replaced_without_being_asked() {
    let sensor = |mass: f64, moments| {
        link("sensor", mass, moments, "") + &joint("fixed", "chassis", "sensor", "")
    };
    for more in [
        sensor(0.2, [0.001, 0.001, 0.5]),
        sensor(5.0, [0.01, 0.01, 0.05]),
    ] {
        let found = machine(&urdf(CHASSIS, &more), "").unwrap();
        assert_eq!(found.replaced_inertias().len(), 1, "{more}");
        assert!(
            found
                .notes()
                .iter()
                .any(|note| note.contains("too small to matter"))
        );
    }
    let large = machine(&urdf(CHASSIS, &sensor(5.0, [0.1, 0.1, 5.0])), "");
    assert!(matches!(large, Err(MachineError::Inertias { .. })));
    // guesses need masses alone
    assert!(Outline::read(&urdf(CHASSIS, &impossible()), "m.urdf").is_ok());
}

#[test]
fn joints_that_nobody_moves_are_told_with_the_mass_they_carry() {
    let spec = MachineSpec::from_toml(&support::data("rigid.toml"), "machine.toml").unwrap();
    let facts = LogFacts {
        joint_names: Some(&[]),
        ..LogFacts::default()
    };
    let error = spec
        .check(&support::data("rigid.urdf"), "machine.urdf", facts)
        .unwrap_err();
    let text = error.to_string();
    for word in ["carries", "% of the mass", "[[linkage]]", "position = 0.0"] {
        assert!(text.contains(word), "{word}: {text}");
    }
}

/// A document type is passed over. No entity is expanded, so that those that stand for gigabytes or for other files do no
/// harm, and a reference to one is told with its line.
#[test]
fn a_document_type_is_passed_over_and_no_entity_expanded() {
    let plain = urdf(CHASSIS, "");
    let alone = machine(&plain, "").unwrap();
    let with = |document_type: &str, text: &str| {
        text.replacen("<robot", &format!("{document_type}\n<robot"), 1)
    };
    let bomb: String = (0..9)
        .map(|of: u8| {
            let inside = format!("&e{of};").repeat(10);
            format!("<!ENTITY e{} '{inside}'>\n", of + 1)
        })
        .collect();
    let bomb = format!("<!DOCTYPE robot [\n<!ENTITY e0 'aaaaaaaaaa'>\n{bomb}]>");
    let types = [
        "<!DOCTYPE robot>",
        "<!DOCTYPE robot SYSTEM 'robot.dtd'>",
        "<!DOCTYPE robot [\n<!ELEMENT robot ANY>\n<!-- ]> -->\n<!ENTITY e9 SYSTEM 'file:///etc/hosts'>\n]>",
        bomb.as_str(),
    ];
    for document_type in types {
        let found = machine(&with(document_type, &plain), "").unwrap();
        assert_eq!(found.mass(), alone.mass(), "{document_type}");
        let used = urdf(CHASSIS, "<link name='&e9;'/>");
        let line_before = used[..used.find("&e9;").unwrap()].matches('\n').count() + 1;
        let refused = machine(&with(document_type, &used), "").unwrap_err();
        let MachineError::Urdf { line, found, .. } = refused else {
            panic!("{document_type}: {refused}");
        };
        let added = document_type.matches('\n').count() + 1;
        assert_eq!(line as usize, line_before + added, "{document_type}");
        assert!(found.contains("&e9;"), "{found}");
    }
}

/// One message for each slip, with the line and what is there.
#[test]
fn slips_are_named_with_line_and_element() {
    let arm = link("arm", 10.0, [1.0; 3], "");
    let turning = |inside: &str| arm.clone() + "\n" + &joint("revolute", "chassis", "arm", inside);
    let fixed = joint("fixed", "chassis", "arm", "");
    for (more, parts) in [
        (
            turning("<axis xyz='0 1 0'/><limit lower='1.5' upper='-0.5'/>"),
            &["\"arm_joint\"", "lower=\"1.5\"", "upper=\"-0.5\""][..],
        ),
        (
            turning("<axis xyz='0 1e200 1e200'/>"),
            &["\"arm_joint\"", "1e200"],
        ),
        (
            arm.replace("'10'", "'nan'") + &fixed,
            &["<mass>", "\"nan\""],
        ),
        (arm.replace("'10'", "'-4'") + &fixed, &["\"arm\"", "-4 kg"]),
        (
            format!("{arm}\n{arm}{fixed}"),
            &["link \"arm\"", "another one in line 13"],
        ),
        (
            format!("{arm}\n{fixed}\n{fixed}"),
            &["joint \"arm_joint\"", "another one in line 15"],
        ),
        (arm.clone(), &["\"chassis\", \"arm\" in lines 3, 13"]),
        (
            arm.clone() + &joint("fixed", "arm", "arm", ""),
            &["link \"arm\"", "a cycle"],
        ),
    ] {
        let text = machine(&urdf(CHASSIS, &more), "").unwrap_err().to_string();
        for part in parts.iter().chain(&["m.urdf", "line"]) {
            assert!(text.contains(part), "{part} is not in: {text}");
        }
    }
    // an axis of another length than one is a direction
    let of_length = |length: f64| {
        let found = machine(
            &urdf(CHASSIS, &turning(&format!("<axis xyz='0 {length} 0'/>"))),
            "",
        );
        found.unwrap().bodies()[1].parent_from_joint
    };
    assert_eq!(of_length(7.0), of_length(1.0));
}
