//! Contradictory sheets are refused, with what was expected, what was found, and the likely correction.

use tipwatch_datasheet::{Sheet, Template};

/// The refusal of an example in which a text is replaced.
fn refusal(template: Template, from: &str, to: &str) -> String {
    let text = template.example();
    assert!(text.contains(from), "{template}: no {from}");
    let sheet = Sheet::from_toml(&text.replacen(from, to, 1), "sheet.toml");
    match sheet.and_then(|sheet| sheet.machine()) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("{template} with {to} instead of {from} is accepted"),
    }
}

#[test]
fn wrong_units_are_refused_with_the_likely_unit() {
    use Template::{CrawlerExcavator, Forklift, WheelLoader};
    for (template, from, to, expected) in [
        (
            WheelLoader,
            "mass = \"15.2 t\"",
            "mass = 15.2",
            "\"15.2 t\"",
        ),
        (
            WheelLoader,
            "behind = \"3200 mm\"",
            "behind = 3200",
            "\"3200 mm\"",
        ),
        (
            WheelLoader,
            "load = \"7.0 t\"",
            "load = 7.0",
            "state the unit",
        ),
        (Forklift, "track = \"914 mm\"", "track = 914", "\"914 mm\""),
        (
            Forklift,
            "tyre_radius = \"0.203 m\"",
            "tyre_radius = 203",
            "\"203 mm\"",
        ),
        (
            CrawlerExcavator,
            "mass = \"22600 kg\"",
            "mass = \"22600 t\"",
            "expected",
        ),
        (
            CrawlerExcavator,
            "tail = \"2830 mm\"",
            "tail = 2830",
            "\"2830 mm\"",
        ),
        (
            CrawlerExcavator,
            "length = \"5.7 m\"",
            "length = 5700",
            "\"5700 mm\"",
        ),
        (
            WheelLoader,
            "mass = \"15.2 t\"",
            "mass = \"15.2 stone\"",
            "a mass [kg]",
        ),
        (WheelLoader, "angle = 37", "angle = 0.65", "\"0.65 rad\""),
    ] {
        let message = refusal(template, from, to);
        assert!(message.contains(expected), "{to}: {message}");
        assert!(
            message.contains("expected") && message.contains("found"),
            "{message}"
        );
    }
}

#[test]
fn nonsense_is_refused_with_the_likely_unit() {
    use Template::{
        CrawlerExcavator, Forklift, Forwarder, MobileCrane, MobileManipulator, Telehandler,
        WheelLoader, WheeledExcavator,
    };
    const BOOM: &str = "range = [-45, 42], at = -36";
    let likely: [(Template, &str, &str, &[&str]); 27] = [
        (
            WheelLoader,
            "length = 1.15",
            "length = 13",
            &["arm.tool.length", "0 to 5 m", "\"13 in\""],
        ),
        (
            WheelLoader,
            "length = 1.15",
            "length = 1150",
            &["arm.tool.length", "\"1150 mm\""],
        ),
        (
            WheelLoader,
            "width = \"2490 mm\"",
            "width = 1.2",
            &["width: ", "the track"],
        ),
        (
            WheelLoader,
            "length = 6.2 ",
            "length = 2.5 ",
            &["length: ", "the wheelbase"],
        ),
        (
            WheelLoader,
            "height = \"3280 mm\"",
            "height = \"328 mm\"",
            &["axles[0].tyre", "lower than the machine", "20.5R25"],
        ),
        (
            WheelLoader,
            "= \"430 mm\"",
            "= 4.3",
            &["axles[0].tyre", "ground_clearance"],
        ),
        (
            WheelLoader,
            "tyre = \"20.5R25\"",
            "tyre = \"200x50\"",
            &["axles[0].tyre"],
        ),
        (
            WheelLoader,
            "mass = \"2.9 t\"",
            "mass = 2.9",
            &["arm.mass", "\"2.9 t\""],
        ),
        (
            WheelLoader,
            "mass = \"1250 kg\"",
            "mass = 1.25",
            &["arm.tool.mass", "\"1.25 t\""],
        ),
        (
            WheelLoader,
            BOOM,
            "range = [-400, 420], at = -36",
            &[
                "segments[0].range",
                "2 to 720 degrees",
                "tenths of a degree",
            ],
        ),
        (
            WheelLoader,
            BOOM,
            "range = [-0.79, 0.73], at = -0.6",
            &["segments[0].range", "\"0.73 rad\""],
        ),
        (
            MobileCrane,
            "base = 6.2",
            "base = 0.6",
            &["outriggers[0].base", "the track is", "pad"],
        ),
        (
            MobileCrane,
            "base = 6.2",
            "base = 1.7",
            &["outriggers[0].base", "both sides together"],
        ),
        (
            MobileCrane,
            "base = 6.2",
            "base = 6200",
            &["outriggers[0].base", "\"6200 mm\""],
        ),
        (
            MobileCrane,
            "base = 6.2",
            "base = 6.2\nset = 3",
            &["outriggers[0].set", "`3`", "true, false", "left = { topic"],
        ),
        (
            Forwarder,
            "bore = \"150 mm\"",
            "bore = 1.5",
            &["cylinder.bore"],
        ),
        (
            Forwarder,
            "bore = \"150 mm\"",
            "bore = true",
            &[
                "arm.segments[",
                ".cylinder.bore: ",
                "a length [m]",
                "\"3300 mm\"",
            ],
        ),
        (
            Forklift,
            "name = \"forks\"",
            "name = 7",
            &["arm.tool.name", "`7`", "string"],
        ),
        (
            CrawlerExcavator,
            "mass = \"22600 kg\"",
            "mass = 221706",
            &["mass: ", "newtons"],
        ),
        (
            CrawlerExcavator,
            "mass = \"22600 kg\"",
            "mass = \"226 t\"",
            &["mass: ", "4.450 m by 3.170 m"],
        ),
        (
            MobileManipulator,
            "mass = 68.4",
            "mass = 671",
            &["mass: ", "newtons"],
        ),
        (
            WheeledExcavator,
            "behind = 1.425",
            "behind = \"1.425 mm\"",
            &["slew.behind", "\"1.425 m\""],
        ),
        (
            WheeledExcavator,
            "behind = 1.425",
            "behind = 2.85",
            &["slew.behind", "between the axles"],
        ),
        (
            WheeledExcavator,
            "mass = \"602 kg\"",
            "mass = \"6020 kg\"",
            &["arm.tool.mass", "\"6020 lb\""],
        ),
        (
            CrawlerExcavator,
            "tail = \"2830 mm\"",
            "tail = \"5660 mm\"",
            &["superstructure.tail", "diameter"],
        ),
        (
            Telehandler,
            "mass = \"3200 kg\"",
            "mass = \"7330 kg\"",
            &["rated_load.mass"],
        ),
        (
            WheelLoader,
            "tyre = \"20.5R25\"",
            "tyre = \"18x70-8\"",
            &["axles[0].tyre", "designation such as"],
        ),
    ];
    for (template, from, to, words) in likely {
        let message = refusal(template, from, to);
        for word in words {
            assert!(message.contains(word), "{to}: {word}: {message}");
        }
        for leak in ["untagged", "did not match any variant", "struct "] {
            assert!(!message.contains(leak), "{to}: {leak}: {message}");
        }
    }
}

/// Loads of the wrong axles add up, too.
#[test]
fn exchanged_axle_loads_are_refused_where_a_wheel_would_carry_three_times_another() {
    let text = Template::Harvester.example();
    let (front, rear) = ("load = \"11.9 t\"", "load = \"7.3 t\"");
    assert!(text.contains(front) && text.contains(rear));
    let exchanged = text.replace(front, "load = X").replace(rear, front);
    let exchanged = exchanged.replace("load = X", rear);
    let made = Sheet::from_toml(&exchanged, "sheet.toml").and_then(|sheet| sheet.machine());
    let message = made.err().unwrap().to_string();
    for part in ["axles.load", "1825 kg", "5950 kg", "exchanged"] {
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn contradictions_are_refused() {
    use Template::{Forklift, Forwarder, MobileCrane, TruckCrane, WheelLoader};
    for (template, from, to, expected) in [
        // axle loads that do not add up
        (
            WheelLoader,
            "load = \"8.2 t\"",
            "load = \"9.2 t\"",
            "add up to the operating mass",
        ),
        // those with the rated load
        (
            Forklift,
            "load = 1489",
            "load = 3489",
            "look like those with the rated load",
        ),
        // an arm heavier than the machine
        (
            WheelLoader,
            "mass = \"2.9 t\"",
            "mass = \"13.9 t\"",
            "arm, tool, wheels and axles",
        ),
        // a longer arm than the reach
        (
            TruckCrane,
            "extension = \"32 m\"",
            "extension = \"42 m\"",
            "arm.reach",
        ),
        (
            TruckCrane,
            "extension = \"32 m\"",
            "extension = \"22 m\"",
            "arm.reach",
        ),
        // loads that need a centre of mass outside the machine
        (
            MobileCrane,
            "centre_of_mass_behind = 1.7",
            "centre_of_mass_behind = 9.9",
            "tail swing",
        ),
        (
            TruckCrane,
            "load = \"7825 kg\"",
            "load = \"27825 kg\"",
            "add up",
        ),
        // laden loads of another load centre
        (
            Forklift,
            "ahead = \"340 mm\"",
            "ahead = \"1340 mm\"",
            "laden",
        ),
        // a cylinder that is too short
        (
            Forwarder,
            "stroke = 0.75",
            "stroke = 0.15",
            "between its pins",
        ),
        (
            Forwarder,
            "bore = \"150 mm\", rod = \"90 mm\"",
            "bore = \"90 mm\", rod = \"150 mm\"",
            "Exchange",
        ),
        // a posture outside the range
        (WheelLoader, "at = -36", "at = 60", "within the range"),
        (WheelLoader, "at = -36", "att = -36", "unknown field"),
        (
            WheelLoader,
            "tyre = \"20.5R25\"",
            "tyre = \"round\"",
            "designation such as",
        ),
        (
            WheelLoader,
            "tyre = \"20.5R25\"",
            "tyre = \"20.5R25\"\ntyre_radius = 1.49",
            "diameter",
        ),
        (
            WheelLoader,
            "name = \"boom\"",
            "name = \"base_link\"",
            "name of its own",
        ),
        (WheelLoader, "name = \"boom\"", "name = \"b om\"", "letters"),
        (
            WheelLoader,
            "height = \"3280 mm\"",
            "height = \"3280 mm\"\ntilt_angle = 30",
            "pivot",
        ),
        (
            WheelLoader,
            "height = \"3280 mm\"",
            "height = \"3280 mm\"\ncentre_of_mass_height = 3.2",
            "centre_of_mass_height",
        ),
    ] {
        let message = refusal(template, from, to);
        assert!(message.contains(expected), "{to}: {message}");
    }
}

/// Any number of a sheet replaced by an absurd one: a machine or a refusal, never a panic.
#[test]
fn absurd_numbers_never_panic() {
    use strum::IntoEnumIterator;
    let absurd = [
        "0",
        "-1",
        "nan",
        "inf",
        "-inf",
        "1e308",
        "-1e308",
        "1e-308",
        "\"\"",
        "\"nan\"",
        "9223372036854775807",
    ];
    for template in Template::iter() {
        let text = template.example();
        for (at, _) in text.match_indices("= ") {
            let start = at + 2;
            let end = text[start..]
                .find([',', '\n', '}', ' '])
                .map_or(text.len(), |n| start + n);
            for value in absurd {
                let changed = format!("{}{value}{}", &text[..start], &text[end..]);
                if let Ok(machine) =
                    Sheet::from_toml(&changed, "x").and_then(|sheet| sheet.machine())
                {
                    let _ = (
                        machine.urdf(),
                        machine.machine_file("m.urdf", None),
                        machine.picture(),
                        machine.summary(),
                    );
                    assert!(
                        machine
                            .links
                            .iter()
                            .all(|l| l.mass >= 0.0 && l.mass.is_finite()),
                        "{changed}"
                    );
                }
            }
        }
    }
}
