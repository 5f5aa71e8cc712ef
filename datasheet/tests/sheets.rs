//! The worked examples against figures of their data sheets that are not among their numbers.

use tipwatch_datasheet::{JointKind, Machine, Sheet, Template};

use crate::examples::{axle_loads, weigh};

/// A machine from a text of the sheet.
fn built(text: &str) -> Machine {
    let sheet = Sheet::from_toml(text, "sheet").unwrap_or_else(|e| panic!("{e}\n{text}"));
    sheet.machine().unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// The text with one place changed.
fn changed(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "{from}\n{text}");
    text.replace(from, to)
}

/// A point `ahead` of a link's origin along its x axis, in the base frame, for arms in one plane: (x, z).
/// Joints at these positions, others at zero, and those that follow others with them (rad or m).
fn tip(machine: &Machine, link: &str, ahead: f64, positions: &[(&str, f64)]) -> (f64, f64) {
    let position = |name: &str| {
        let found = positions.iter().find(|(joint, _)| *joint == name);
        found.map_or(0.0, |(_, position)| *position)
    };
    let (mut x, mut z) = (ahead, 0.0);
    let mut next = machine.link(link);
    while let Some(joint) = next.and_then(|link| machine.links[link].joint.as_ref()) {
        let at = match &joint.mimic {
            Some((leader, factor)) => factor * position(leader),
            None => position(&joint.name),
        };
        match joint.kind {
            JointKind::Fixed | JointKind::Continuous => {}
            JointKind::Prismatic => {
                x += joint.axis[0] * at;
                z += joint.axis[2] * at;
            }
            JointKind::Revolute => {
                // positive angles lift
                let angle = -joint.axis[1] * at;
                (x, z) = (
                    x * angle.cos() - z * angle.sin(),
                    x * angle.sin() + z * angle.cos(),
                );
            }
        }
        x += joint.xyz[0];
        z += joint.xyz[2];
        next = Some(joint.parent);
    }
    (x, z)
}

/// Limits of a joint (rad or m).
fn limits(machine: &Machine, joint: &str) -> [f64; 2] {
    let joints = machine.links.iter().filter_map(|link| link.joint.as_ref());
    let found = joints.into_iter().find(|j| j.name == joint);
    found.and_then(|j| j.limits).unwrap()
}

/// Distance of a machine's front wheels ahead of its base frame (m).
fn front(machine: &Machine) -> f64 {
    let mut wheel = machine.wheels[0].link;
    let mut x = 0.0;
    while let Some(joint) = &machine.links[wheel].joint {
        x += joint.xyz[0];
        wheel = joint.parent;
    }
    x
}

/// Positions from the least to the most.
fn steps([least, most]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    (0..=count).map(move |i| least + (most - least) * i as f64 / count as f64)
}

/// Working ranges of an excavator (m).
struct Ranges {
    reach: f64,
    at_ground: f64,
    depth: f64,
    height: f64,
}

fn ranges(machine: &Machine, radius: f64) -> Ranges {
    let mut found = Ranges {
        reach: machine.reach,
        at_ground: 0.0,
        depth: 0.0,
        height: 0.0,
    };
    let slew = tip(machine, "boom_link", 0.0, &[]).0 - 0.09;
    let pin = tip(machine, "boom_link", 0.0, &[]).1;
    let [low, high] = limits(machine, "boom");
    for stick in steps(limits(machine, "stick"), 90) {
        for bucket in steps(limits(machine, "bucket"), 90) {
            let at = |boom: f64| {
                let positions = [("boom", boom), ("stick", stick), ("bucket", bucket)];
                tip(machine, "bucket_link", radius, &positions)
            };
            found.depth = found.depth.max(-at(low).1);
            found.height = found.height.max(at(high).1);
            // the boom's angle that brings the tip to the ground
            let (x, z) = at(0.0);
            let level = x - slew - 0.09;
            let chord = level.hypot(z - pin);
            let boom = (-pin / chord).asin() - (z - pin).atan2(level);
            if (low..=high).contains(&boom) {
                let (x, z) = at(boom);
                assert!(z.abs() < 1e-9, "{z}");
                found.at_ground = found.at_ground.max(x - slew);
            }
        }
    }
    found
}

/// Cat M318D, one-piece boom: reach, reach at ground level, digging depth and digging height with three sticks, of
/// which the example has the middle one. Twelve figures; four places and angles of the example were fitted to them.
#[test]
fn val_wheeled_excavator_has_the_working_ranges_of_its_sheet() {
    let text = Template::WheeledExcavator.example();
    let stick = "name = \"stick\", length = \"2.5 m\"";
    for (length, reach, at_ground, depth, height) in [
        (2.2, 9.18, 9.00, 5.70, 8.76),
        (2.5, 9.49, 9.32, 6.00, 9.01),
        (2.8, 9.77, 9.60, 6.30, 9.17),
    ] {
        let of_stick = changed(text, stick, &format!("name = \"stick\", length = {length}"));
        let machine = built(&of_stick.replace("reach = \"9.49 m\"", ""));
        let found = ranges(&machine, 1.599);
        for (what, found, sheet) in [
            ("reach", found.reach, reach),
            ("reach at ground level", found.at_ground, at_ground),
            ("digging depth", found.depth, depth),
            ("digging height", found.height, height),
        ] {
            println!("stick {length} m: {what} {found:.3} m, sheet {sheet} m");
            assert!(
                (found - sheet).abs() < 0.05,
                "stick {length} m: {what} {found:.3} m, sheet {sheet} m"
            );
        }
    }
}

/// Cat M318D: 18,200 kg on a wheelbase of 2,600 mm.
#[test]
fn val_wheeled_excavator_has_the_mass_and_wheelbase_of_its_sheet() {
    let machine = built(Template::WheeledExcavator.example());
    let (loads, mass) = weigh(&machine);
    assert!((mass / 18_200.0 - 1.0).abs() < 1e-3, "{mass} kg");
    assert!(loads.iter().all(|(_, load)| *load > 0.0), "{loads:?}");
    assert!((2.0 * front(&machine) - 2.6).abs() < 1e-9);
}

/// Kato NK-550VR: 41,600 kg, of which 15,650 kg on the two front axles and 25,950 kg on the two rear ones, which are
/// 1,450, 3,900 and 1,350 mm apart.
#[test]
fn val_truck_crane_has_the_axle_loads_of_its_sheet() {
    let machine = built(Template::TruckCrane.example());
    let (_, mass) = weigh(&machine);
    let loads = axle_loads(&machine);
    let (front_axles, rear_axles) = (loads[0] + loads[1], loads[2] + loads[3]);
    println!("{mass:.1} kg, {front_axles:.1} kg, {rear_axles:.1} kg");
    assert!((mass / 41_600.0 - 1.0).abs() < 1e-3, "{mass} kg");
    assert!((front_axles / 15_650.0 - 1.0).abs() < 1e-3, "{loads:?}");
    assert!((rear_axles / 25_950.0 - 1.0).abs() < 1e-3, "{loads:?}");
    assert!((2.0 * front(&machine) - 6.7).abs() < 1e-9);
}

/// Kato NK-550VR: the hook goes to 43.0 m with the longest boom of 43 m, whose head is then the height of the hook
/// block above it, 1 to 3.5 m. Retracted, the boom is 11 m long.
#[test]
fn val_truck_crane_lifts_as_high_as_its_sheet_says() {
    let machine = built(Template::TruckCrane.example());
    let sections = 4.0;
    let [_, out] = limits(&machine, "boom_extension");
    let [_, up] = limits(&machine, "boom");
    let pin = tip(&machine, "boom_link", 0.0, &[]);
    let retracted = tip(&machine, "hook", 0.0, &[]);
    assert!((retracted.0 - pin.0 - 11.0).abs() < 1e-9, "{retracted:?}");
    let longest = tip(&machine, "hook", 0.0, &[("boom_extension", out)]);
    assert!((longest.0 - pin.0 - 43.0).abs() < 1e-9, "{longest:?}");
    assert!((sections * out - 32.0).abs() < 1e-9, "{out}");
    let head = tip(
        &machine,
        "hook",
        0.0,
        &[("boom_extension", out), ("boom", up)],
    );
    println!("boom's head at {:.2} m", head.1);
    assert!((44.0..46.5).contains(&head.1), "{head:?}");
}

/// Manitou MT-X 732: 7,330 kg; carriage 1.44 m ahead of the front wheels' axle with the forks down; lift height 6.90 m,
/// and there a reach of 1.15 m from the front of the tyres to the centre of the load.
#[test]
fn val_telehandler_has_the_mass_lift_height_and_reach_of_its_sheet() {
    let machine = built(Template::Telehandler.example());
    let (loads, mass) = weigh(&machine);
    assert!((mass / 7330.0 - 1.0).abs() < 1e-3, "{mass} kg");
    assert!(loads.iter().all(|(_, load)| *load > 0.0), "{loads:?}");
    let axle = front(&machine);
    assert!((2.0 * axle - 2.56).abs() < 1e-9);
    let [down, up] = limits(&machine, "boom");
    let [_, out] = limits(&machine, "boom_extension");
    let heel = tip(&machine, "forks_link", 0.0, &[("boom", down)]);
    println!(
        "forks down: {:.3} m ahead at {:.3} m",
        heel.0 - axle,
        heel.1
    );
    assert!((heel.0 - axle - 1.44).abs() < 0.02, "{heel:?}");
    assert!((0.0..0.15).contains(&heel.1), "{heel:?}");
    let raised = [("boom", up), ("boom_extension", out), ("forks", -up)];
    let heel = tip(&machine, "forks_link", 0.0, &raised);
    println!("highest: {:.3} m", heel.1);
    assert!((heel.1 - 6.90).abs() < 0.05, "{heel:?}");
    let load = tip(&machine, "forks_link", 0.5, &raised);
    assert!((load.1 - heel.1).abs() < 1e-9, "{load:?}");
    let reach = load.0 - axle - machine.wheels[0].radius;
    println!("reach there: {reach:.3} m");
    assert!((reach - 1.15).abs() < 0.1, "{reach} m");
    // crowding by 11.9 and dumping by 113.8 degrees
    let [dump, crowd] = limits(&machine, "forks");
    assert!(((crowd - dump).to_degrees() - 125.7).abs() < 0.01);
}
