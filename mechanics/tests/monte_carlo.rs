//! Monte Carlo study of sampled machines.

use crate::support::{machine, moving};
use nalgebra::Vector3;
use tipwatch_mechanics::studies::monte_carlo::{Band, Study, bands};
use tipwatch_mechanics::{Machine, Quantity, Scope, StateColumns, Workspace, evaluate};

const ROWS: usize = 18;

fn states(machine: &Machine) -> StateColumns {
    let mut columns = StateColumns::unknown(machine, ROWS);
    // The last row stays unknown.
    for row in 0..ROWS - 1 {
        let push = Vector3::new(0.3, -0.2, 9.8);
        let mut state = moving(machine, row as f64, push, Vector3::new(0.0, 0.1, 0.2));
        columns.set(row, &mut state);
    }
    columns
}

fn study(machine: &Machine, study: Study) -> Vec<Band> {
    bands(machine, &study.machines(machine), &states(machine), 0..ROWS)
}

/// Nominal value of a band's quantity in a row.
fn nominal(machine: &Machine, quantity: Quantity, row: usize) -> f64 {
    let mut workspace = Workspace::with_scope(machine, Scope::ALL);
    let push = Vector3::new(0.3, -0.2, 9.8);
    let state = moving(machine, row as f64, push, Vector3::new(0.0, 0.1, 0.2));
    evaluate(machine, &state, &mut workspace).get(quantity)
}

#[test]
fn zero_spread_gives_zero_width_and_seed_repeats() {
    let machine = machine("rigid");
    let still = Study {
        draws: 5,
        spread: 0.0,
        seed: 1,
    };
    for band in study(&machine, still) {
        for row in 0..ROWS - 1 {
            let nominal = nominal(&machine, band.quantity, row);
            let off = (band.low[row] - nominal)
                .abs()
                .max((band.high[row] - nominal).abs());
            assert!(
                off < 1e-6 * (1.0 + nominal.abs()),
                "{:?}: {off}",
                band.quantity
            );
        }
        assert!(band.low[ROWS - 1].is_nan() && band.left_out[ROWS - 1] == 5);
    }
    let sampled = Study {
        draws: 40,
        spread: 0.1,
        seed: 7,
    };
    let (once, again) = (study(&machine, sampled), study(&machine, sampled));
    let other = study(&machine, Study { seed: 8, ..sampled });
    for ((once, again), other) in once.iter().zip(&again).zip(&other) {
        assert_eq!(once.low[..ROWS - 1], again.low[..ROWS - 1]);
        assert_ne!(once.low[..ROWS - 1], other.low[..ROWS - 1]);
    }
}

/// Figs. 13 and 14: ten per cent variation of all parameters changes a wheel's load by some kilonewtons and the
/// arm's vertical force by nearly half a kilonewton; the bands contain the nominal value.
#[test]
fn val_ten_per_cent_parameter_variation() {
    let machine = machine("rigid");
    let found = study(
        &machine,
        Study {
            draws: 400,
            spread: 0.1,
            seed: 3,
        },
    );
    assert_eq!(found.len(), 4 + 6);
    for band in &found {
        for row in 0..ROWS - 1 {
            let nominal = nominal(&machine, band.quantity, row);
            assert!(
                band.low[row] <= nominal && nominal <= band.high[row],
                "{band:?}"
            );
            assert!(band.left_out[row] < 200);
        }
    }
    let width = |band: &Band| band.high[3] - band.low[3];
    for load in &found[..4] {
        assert!((500.0..6000.0).contains(&width(load)), "{}", width(load));
    }
    // The tool's 570 kg alone contribute 5.6 kN * 0.1 / sqrt(3) = 323 N.
    let vertical = &found[6];
    assert!(
        (320.0..500.0).contains(&vertical.sigma[3]),
        "{}",
        vertical.sigma[3]
    );
}
