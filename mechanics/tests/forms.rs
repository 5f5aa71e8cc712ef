//! Values of a machine file that may be written in several forms: an error names the key, what was found, the forms
//! and an example.

use tipwatch_mechanics::machine::MachineSpec;

const HEAD: &str = "name = \"m\"\n";

#[test]
fn every_value_of_several_forms_names_key_finding_and_forms() {
    let payload = "[[payload]]\nlink = \"a\"\n";
    let support = "[supports.S]\nlink = \"a\"\n";
    let wheel = "[wheels.A]\nlink = \"a\"\nradius = 0.3\n";
    let linkage = "[[linkage]]\nname = \"l\"\npivot = \"p\"\ncylinder = \"c\"\nrod = \"r\"\n\
                   rod_end = { link = \"a\", xyz = [0, 0, 0] }\nanchor = { link = \"b\", xyz = [0, 0, 0] }\n";
    let cases: [(&str, &str, &str, &[&str]); 17] = [
        (
            "[contact]\n",
            "tyre_stiffness = \"soft\"",
            "contact.tyre_stiffness",
            &["\"soft\"", "{ FL = 4e5"],
        ),
        (
            "[contact]\n",
            "tyre_stiffness = [1, 2]",
            "contact.tyre_stiffness",
            &["sequence", "4e5"],
        ),
        (
            "[contact]\n",
            "tyre_stiffness = { FL = \"x\" }",
            "contact.tyre_stiffness.FL",
            &["\"x\"", "f64"],
        ),
        (
            payload,
            "mass = true",
            "payload[0].mass",
            &["`true`", "450.0", "\"estimate\""],
        ),
        (
            payload,
            "mass = [1]",
            "payload[0].mass",
            &["sequence", "\"estimate\""],
        ),
        (
            "[signals]\n",
            "joint_states = 3",
            "signals.joint_states",
            &["`3`", "[\"/arm/joint_states\""],
        ),
        (
            "[signals]\n",
            "joint_states = [1]",
            "signals.joint_states",
            &["`1`", "string"],
        ),
        (
            "[signals]\n",
            "imu = 1",
            "signals.imu",
            &["`1`", "\"/imu/data\""],
        ),
        (
            "[signals]\n",
            "odometry = { speed = 1 }",
            "signals.odometry",
            &["`speed`", "velocity"],
        ),
        (
            "[signals.joints.\"a.b\"]\n",
            "position = \"x\"",
            "signals.joints.\"a.b\".position",
            &["\"x\"", "{ topic"],
        ),
        (
            "[signals.joints.a]\n",
            "position = { field = \"x\" }",
            "signals.joints.a.position",
            &["topic"],
        ),
        (
            "[signals.joints.a]\n",
            "velocity = \"x\"",
            "signals.joints.a.velocity",
            &["\"x\"", "{ topic, field }"],
        ),
        (
            support,
            "set = \"yes\"",
            "supports.S.set",
            &["\"yes\"", "[[12.0, 80.5]]", "{ topic"],
        ),
        (support, "set = [[1, 2, 3]]", "supports.S.set", &["length"]),
        (
            support,
            "set = { topic = 1 }",
            "supports.S.set",
            &["string"],
        ),
        (
            wheel,
            "raised = 1.5",
            "wheels.A.raised",
            &["`1.5`", "true, false"],
        ),
        (
            linkage,
            "force = 3",
            "linkage[0].force",
            &["`3`", "{ topic, field }"],
        ),
    ];
    for (table, line, path, words) in cases {
        let text = format!("{HEAD}{table}{line}\n");
        let error = MachineSpec::from_toml(&text, "m.toml")
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with(&format!("m.toml: {path}")),
            "{line}: {error}"
        );
        for word in words {
            assert!(error.contains(word), "{line}: {word}: {error}");
        }
        for leak in [
            "untagged",
            "did not match any variant",
            "struct ",
            "FieldTable",
        ] {
            assert!(!error.contains(leak), "{line}: {leak}: {error}");
        }
    }
}

#[test]
fn every_form_is_read() {
    for lines in [
        "[contact]\ntyre_stiffness = 4e5",
        "[contact]\ntyre_stiffness = 400000",
        "[contact]\ntyre_stiffness = { FL = 4e5, FR = 3 }",
        "[[payload]]\nlink = \"a\"\nmass = 3",
        "[[payload]]\nlink = \"a\"\nmass = \"estimate\"",
        "[signals]\njoint_states = \"/a\"\nimu = \"/b\"",
        "[signals]\njoint_states = [\"/a\", \"/b\"]",
        "[signals.joints.a]\nposition = 1",
        "[signals.joints.a]\nposition = { topic = \"/a\", field = \"b\" }",
        "[supports.S]\nlink = \"a\"\nset = true",
        "[supports.S]\nlink = \"a\"\nset = [[1, 2.5]]",
        "[supports.S]\nlink = \"a\"\nset = { topic = \"/a\", field = \"b\", above = 1 }",
    ] {
        let read = MachineSpec::from_toml(&format!("{HEAD}{lines}\n"), "m.toml");
        assert!(read.is_ok(), "{lines}: {:?}", read.err());
    }
}
