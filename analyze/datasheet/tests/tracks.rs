//! Tracks stand on the ground along their length.

use tipwatch_datasheet::{Sheet, Template};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};

use crate::examples::weigh;

/// The machine of the example with more text at its end, as its machine file describes it.
fn crawler(more: &str) -> (tipwatch_datasheet::Machine, Machine) {
    let text = format!("{}{more}", Template::CrawlerExcavator.example());
    let machine = Sheet::from_toml(&text, "crawler").and_then(|sheet| sheet.machine());
    let machine = machine.unwrap_or_else(|e| panic!("{e}"));
    let file = machine.machine_file("machine.urdf", None);
    let spec =
        MachineSpec::from_toml(&file, "machine.toml").unwrap_or_else(|e| panic!("{e}\n{file}"));
    let checked = spec.check(&machine.urdf(), "machine.urdf", LogFacts::default());
    let checked = checked.unwrap_or_else(|e| panic!("{e}\n{file}"));
    (machine, checked)
}

/// Cat 320: 2,380 mm from track to track and 3,650 mm to the centres of the rollers.
#[test]
fn val_tracks_have_gauge_and_length_of_the_sheet() {
    let (_, checked) = crawler("");
    let corners = [
        [1.825, 1.19],
        [1.825, -1.19],
        [-1.825, 1.19],
        [-1.825, -1.19],
    ];
    let places: Vec<[f64; 3]> = checked
        .wheels()
        .iter()
        .map(|point| {
            [
                point.centre_at_zero.x,
                point.centre_at_zero.y,
                point.centre_at_zero.z,
            ]
        })
        .collect();
    assert_eq!(places.len(), 8);
    assert_eq!(checked.polygon().edges().len(), 4);
    for [x, y] in corners {
        let is_there = |at: &&[f64; 3]| (at[0] - x).hypot(at[1] - y) < 1e-9 && at[2].abs() < 1e-9;
        assert_eq!(places.iter().filter(is_there).count(), 1, "{places:?}");
    }
    for step in [-1.0, 1.0] {
        let x = step * 3.65 / 6.0;
        assert_eq!(
            places.iter().filter(|at| (at[0] - x).abs() < 1e-9).count(),
            2
        );
    }
}

/// A rigid track on even ground: the pressure is linear along it and its moment is that of the weight.
///
/// ```text
///     P_i = W / n + W x_c x_i / sum x_i^2
/// ```
#[test]
fn val_points_of_a_track_carry_the_weight_linearly_along_it() {
    let (machine, checked) = crawler("");
    let (loads, mass) = weigh(&machine);
    let weight = 9.806_65 * mass;
    let places: Vec<f64> = checked
        .wheels()
        .iter()
        .map(|point| point.centre_at_zero.x)
        .collect();
    let squares: f64 = places.iter().map(|x| x * x).sum();
    for ((name, load), x) in loads.iter().zip(&places) {
        let expected = weight / 8.0 + weight * machine.centre_of_mass[0] * x / squares;
        assert!(
            (load / expected - 1.0).abs() < 1e-3,
            "{name}: {load} N, {expected} N"
        );
    }
}

/// With its outriggers set, a crawler stands on them; and a machine has twelve supports at most.
#[test]
fn a_crawler_on_outriggers_has_its_tracks_off_the_ground() {
    let pair =
        |behind: f64| format!("\n[[outriggers]]\nbehind = {behind}\nbase = 4.5\nset = true\n");
    for pairs in [2_usize, 3, 4] {
        let more: String = (0..pairs).map(|i| pair(2.0 * i as f64 - 2.0)).collect();
        let (machine, checked) = crawler(&more);
        assert!(checked.supports().all.len() <= 12);
        assert!(
            checked
                .wheels()
                .iter()
                .all(|w| w.name.starts_with("OUTRIGGER"))
        );
        assert_eq!(checked.wheels().len(), 2 * pairs);
        let file = machine.machine_file("machine.urdf", None);
        assert_eq!(file.matches("\nraised_by = [").count(), 2, "{file}");
    }
}
