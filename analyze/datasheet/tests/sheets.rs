//! The worked examples against figures of their data sheets that are not among their numbers.

use tipwatch_datasheet::Template;

use crate::examples::{axle_loads, weigh};
use crate::plane::{built, front, limits, place, tip};

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

/// John Deere 1510G: 18,230 kg; the frame joint is 1,900 mm behind the middle of the front bogies and 3,400 mm ahead of
/// that of the rear ones; the crane reaches 10 m.
#[test]
fn val_forwarder_has_the_mass_wheelbase_and_reach_of_its_sheet() {
    let machine = built(Template::Forwarder.example());
    let (loads, mass) = weigh(&machine);
    assert!((mass / 18_230.0 - 1.0).abs() < 1e-3, "{mass} kg");
    assert_eq!(loads.len(), 8);
    let places: Vec<f64> = machine
        .wheels
        .iter()
        .map(|wheel| place(&machine, wheel.link, (0.0, 0.0), &[]).0)
        .collect();
    let joints = machine.links.iter().filter_map(|link| link.joint.as_ref());
    let joint = joints
        .into_iter()
        .find(|joint| joint.name == "articulation")
        .unwrap();
    let joint = place(&machine, joint.parent, (joint.xyz[0], 0.0), &[]).0;
    let middle = |of: &dyn Fn(f64) -> bool| {
        let of: Vec<f64> = places.iter().copied().filter(|x| of(*x)).collect();
        assert_eq!(of.len(), 4, "{places:?}");
        of.iter().sum::<f64>() / 4.0
    };
    let (front, rear) = (middle(&|x| x > joint), middle(&|x| x < joint));
    assert!(
        (front - joint - 1.9).abs() < 1e-9,
        "{places:?}, joint {joint}"
    );
    assert!(
        (joint - rear - 3.4).abs() < 1e-9,
        "{places:?}, joint {joint}"
    );
    assert!(
        (machine.reach / 10.0 - 1.0).abs() < 0.01,
        "{} m",
        machine.reach
    );
}
