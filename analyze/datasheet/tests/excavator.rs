//! The excavators against figures of their data sheets that are not among their numbers.

use tipwatch_datasheet::{Machine, Template};

use crate::examples::weigh;
use crate::plane::{across, built, changed, front, limits, place, tip};

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

/// Place of the slew's axis (m).
fn slew(machine: &Machine) -> f64 {
    tip(machine, "superstructure", 0.0, &[]).0
}

fn ranges(machine: &Machine, radius: f64) -> Ranges {
    let mut found = Ranges {
        reach: machine.reach,
        at_ground: 0.0,
        depth: 0.0,
        height: 0.0,
    };
    let slew = slew(machine);
    let (pin_ahead, pin) = tip(machine, "boom_link", 0.0, &[]);
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
            let level = x - pin_ahead;
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

/// Cat 320 with the boom of 5.7 m and the stick of 2.9 m: 9,860 mm at ground level.
#[test]
fn val_crawler_excavator_reaches_as_far_on_the_ground_as_its_sheet_says() {
    let machine = built(Template::CrawlerExcavator.example());
    let found = ranges(&machine, 1.47).at_ground;
    println!("{found:.3} m");
    assert!((found / 9.86 - 1.0).abs() < 0.01, "{found:.3} m");
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

/// Loads at the end of the stick, without bucket, that tip the machine over its front, its rear and its side (kg).
///
/// ```text
///     P (r - b) = M b - (moment of the superstructure and arm + moment of the carrier)
/// ```
/// about the edge at distance b from the slew's axis, towards the arm.
fn tipping_loads(machine: &Machine, radius: f64, height: f64) -> [f64; 3] {
    let pin = tip(machine, "boom_link", 0.0, &[]);
    let elbow = tip(machine, "stick_link", 0.0, &[]);
    let end = tip(machine, "bucket_link", 0.0, &[]);
    let upper_link = machine.link("superstructure").unwrap();
    let slew = slew(machine);
    let (boom, stick) = (elbow.0 - pin.0, end.0 - elbow.0);
    let (dx, dz) = (radius + slew - pin.0, height - pin.1);
    let chord = dx.hypot(dz).min(boom + stick);
    let corner = |a: f64, b: f64, opposite: f64| {
        ((a * a + b * b - opposite * opposite) / (2.0 * a * b))
            .clamp(-1.0, 1.0)
            .acos()
    };
    let raised = dz.atan2(dx) + corner(boom, chord, stick);
    let bent = corner(boom, stick, chord) - std::f64::consts::PI;
    let posture = [("boom", raised), ("stick", bent)];
    let (mut mass, mut upper, mut carrier) = (0.0, 0.0, 0.0);
    for (index, link) in machine.links.iter().enumerate() {
        if link.name == "bucket_link" {
            continue;
        }
        let mut chain = Some(index);
        while chain.is_some_and(|link| link != upper_link) {
            chain = chain.and_then(|link| machine.links[link].joint.as_ref().map(|j| j.parent));
        }
        let at = place(machine, index, (link.com[0], link.com[2]), &posture).0 - slew;
        mass += link.mass;
        match chain {
            Some(_) => upper += link.mass * at,
            None => carrier += link.mass * at,
        }
    }
    let [front, rear] = [front(machine) - slew, front(machine) + slew];
    let side = machine
        .wheels
        .iter()
        .map(|wheel| across(machine, wheel.link))
        .fold(0.0, f64::max);
    [
        (front, upper + carrier),
        (rear, upper - carrier),
        (side, upper),
    ]
    .map(|(edge, moment)| (mass * edge - moment) / (radius - edge))
}

/// Cat M318D with the boom of 5.26 m between its pins, the stick of 2.2 m, no bucket, blade at the rear and off the
/// ground, oscillating axle locked: lifting capacities over front, rear and side (kg), which are 75 % of the loads that
/// tip it. None of the masses of the parts, their centres of mass and the track are of the sheet. Front and rear are
/// compared by their sum, in which the place of the carrier's centre of mass cancels: the sheet's carrier has the blade
/// at its rear, the model's is symmetrical.
#[test]
fn val_wheeled_excavator_tips_under_the_loads_of_its_sheet() {
    let text = Template::WheeledExcavator.example();
    let text = changed(text, "length = \"5.35 m\"", "length = \"5.26 m\"");
    let text = changed(&text, "length = \"2.5 m\"", "length = \"2.2 m\"");
    let machine = built(&text.replace("reach = \"9.49 m\"", ""));
    for (radius, height, capacities) in [
        (4.5, 0.0, [6750.0, 4500.0, 3800.0]),
        (6.0, 0.0, [4450.0, 3050.0, 2600.0]),
        (7.38, 0.0, [3350.0, 2300.0, 2000.0]),
        (7.59, 1.5, [3250.0, 2250.0, 1950.0]),
    ] {
        let found = tipping_loads(&machine, radius, height).map(|load| 0.75 * load);
        let ratios: [f64; 3] = std::array::from_fn(|i| found[i] / capacities[i]);
        println!("{radius} m: {found:.0?} kg, sheet {capacities:?} kg, ratios {ratios:.3?}");
        let along = (found[0] + found[1]) / (capacities[0] + capacities[1]);
        assert!(
            (along - 1.0).abs() < 0.05,
            "{radius} m: {found:?}, sheet {capacities:?}"
        );
        assert!(
            (ratios[2] - 1.0).abs() < 0.03,
            "{radius} m: {found:?}, sheet {capacities:?}"
        );
        assert!(
            ratios.iter().all(|ratio| (0.8..1.2).contains(ratio)),
            "{radius} m: {ratios:?}"
        );
    }
}
