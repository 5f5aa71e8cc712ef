//! The suspension's hydraulics as the machine file states them.

use crate::support::{bogie_by_rods, edited};

#[test]
fn invalid_hydraulics_are_rejected_with_their_key() {
    let with = |table: &str| {
        edited("bogie", |text| {
            format!("{text}\n[suspension.hydraulics]\n{table}\n")
        })
    };
    for (table, key) in [
        ("bore = -0.1", "bore"),
        ("rod = 0.2", "rod"),
        ("supply_pressure = 0.0", "supply_pressure"),
        ("tank_pressure = 3e7", "tank_pressure"),
        ("relief_pressure = 1e6", "relief_pressure"),
        ("edges = [1.0, 0.0, 1.0, 1.0]", "edges"),
        ("friction = nan", "friction"),
    ] {
        let message = with(table).unwrap_err().to_string();
        assert!(
            message.contains(&format!("suspension.hydraulics.{key}")),
            "{message}"
        );
    }
    let machine = with("bore = 0.1\ngain = 4.0").unwrap();
    let parameters = &machine.suspension().unwrap().hydraulics;
    assert!((parameters.piston_area - 78.5398e-4).abs() < 1e-8 && parameters.gain == 4.0);
    let default = bogie_by_rods(|text| text);
    // Stroke from [suspension], areas of the published lift cylinder.
    let parameters = &default.suspension().unwrap().hydraulics;
    assert!((parameters.stroke - 0.2).abs() < 1e-12);
    assert!((parameters.piston_area - 50.265e-4).abs() < 1e-7);
    assert!((parameters.ring_area - 34.361e-4).abs() < 1e-7);
}
