//! Rows of a log: their errors are correlated, and some are wrong.

use tipwatch_calibration::identification::{Data, Identification, Situation, identify};
use tipwatch_mechanics::machine::Machine;

use crate::support::{
    Noise, channels, load_error, logged, machine, of_log, postures, row, weighed, wrong,
};

/// Standard deviation of a load cell's constant error, and of one sample (N).
const BIAS: f64 = 30.0;
const SAMPLE: f64 = 15.0;

/// A log in which the arm goes through postures, with `per_posture` rows in each.
fn log(truth: &Machine, count: usize, per_posture: usize, noise: &mut Noise) -> Data {
    let postures = postures(truth, count, noise).into_iter();
    let postures = postures.flat_map(|positions| vec![positions; per_posture]);
    let instants = logged(truth, postures.collect(), SAMPLE, noise);
    of_log(channels(truth, BIAS), instants)
}

fn sigma_of_mass(found: &Identification) -> f64 {
    let mass = found.estimates.iter().find(|e| e.name == "base_link.mass");
    mass.unwrap().sigma
}

#[test]
fn a_log_with_load_cells_corrects_the_machine() {
    let truth = machine("");
    for seed in 1..=2 {
        let mut noise = Noise::new(20 + seed);
        let stated = wrong(&truth, &mut noise);
        let found = identify(&stated, None, &log(&truth, 40, 10, &mut noise)).unwrap();
        let held = found.held_back.as_ref().unwrap();
        assert!(held.instants > 50, "{held:?}");
        assert!(
            held.loads_after < 1.5 * SAMPLE && held.loads_before > 5.0 * SAMPLE,
            "{held:?}"
        );
        let identified = stated.with_identified(found.identified);
        let others = postures(&truth, 30, &mut noise);
        let error = load_error(&truth, &identified, &others);
        // no better than the load cells are known
        assert!(error < BIAS, "{error}");
    }
}

#[test]
fn repeating_rows_of_one_posture_tells_no_more() {
    let truth = machine("");
    let mut noise = Noise::new(31);
    let stated = wrong(&truth, &mut noise);
    let positions = postures(&truth, 1, &mut noise).remove(0);
    let still = |rows: usize, noise: &mut Noise| {
        let instants = (0..rows).map(|k| {
            let situation = Situation::Logged(Box::new(row(&truth, &positions)));
            weighed(&truth, situation, 0.01 * k as f64, SAMPLE, noise)
        });
        let data = of_log(channels(&truth, BIAS), instants.collect());
        identify(&stated, None, &data).unwrap()
    };
    let (few, many) = (still(8, &mut noise), still(390, &mut noise));
    assert!(few.sources[0].effective <= 1.0 + 1e-9 && many.sources[0].effective <= 1.0 + 1e-9);
    let (few, many) = (sigma_of_mass(&few), sigma_of_mass(&many));
    assert!(many > 0.9 * few, "{few} {many}");
}

#[test]
fn the_stated_errors_of_the_estimates_are_the_true_ones() {
    // Over machines drawn from the prior, (estimate - truth) / sigma of what a scale sees has the spread one.
    let machine = machine("");
    let mut squares = Vec::new();
    for seed in 0..8 {
        let mut noise = Noise::new(100 + seed);
        let truth = wrong(&machine, &mut noise);
        let data = log(&truth, 12, 3, &mut noise);
        let found = identify(&machine, None, &data).unwrap();
        let identified = machine.with_identified(found.identified);
        for positions in postures(&truth, 4, &mut noise) {
            let resting = tipwatch_mechanics::RestingMachine::new(&identified, &positions);
            let real = tipwatch_mechanics::static_outcome(&truth, &positions).load;
            for axle in [[0, 1], [2, 3], [0, 2]] {
                let (load, sigma) = resting.load_of(&axle);
                squares.push(((load - real[axle[0]] - real[axle[1]]) / sigma).powi(2));
            }
        }
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    let outside = squares.iter().filter(|square| **square > 4.0).count() as f64;
    let outside = outside / squares.len() as f64;
    assert!(
        (0.1..1.6).contains(&mean) && outside < 0.1,
        "{mean} {outside}"
    );
}

#[test]
fn wrong_rows_do_not_move_the_result() {
    let truth = machine("");
    let mut noise = Noise::new(41);
    let stated = wrong(&truth, &mut noise);
    let mut data = log(&truth, 30, 8, &mut noise);
    let clean = identify(&stated, None, &data).unwrap();
    for (k, instant) in data.sources[0].instants.iter_mut().enumerate() {
        if k % 9 == 0 {
            instant.readings[k % 4].value += 8000.0;
        }
    }
    let found = identify(&stated, None, &data).unwrap();
    assert!(found.sources[0].outliers >= 15, "{:?}", found.sources);
    let others = postures(&truth, 30, &mut noise);
    let error = |found: Identification| {
        load_error(&truth, &stated.with_identified(found.identified), &others)
    };
    let (clean, disturbed) = (error(clean), error(found));
    assert!(disturbed < clean + 0.7 * SAMPLE, "{clean} {disturbed}");
}

#[test]
fn unknown_numbers_and_lifted_wheels_are_left_out() {
    let truth = machine("");
    let mut noise = Noise::new(51);
    let mut data = log(&truth, 8, 4, &mut noise);
    let lifted = {
        // the specific force of a side slope on which the machine would tip
        let mut state = row(&truth, &postures(&truth, 1, &mut noise)[0]);
        state.imu.specific_force = nalgebra::Vector3::new(0.0, 8.0, 5.0);
        Situation::Logged(Box::new(state))
    };
    data.sources[0].instants[0].situation = lifted;
    data.sources[0].instants[1].readings[0].value = f64::NAN;
    let mut state = row(&truth, &postures(&truth, 1, &mut noise)[0]);
    state.joints[0].position = f64::NAN;
    data.sources[0].instants[2].situation = Situation::Logged(Box::new(state));
    let found = identify(&truth, None, &data).unwrap();
    assert!(
        found
            .estimates
            .iter()
            .all(|e| e.change.is_finite() && e.sigma.is_finite())
    );
    let used = &found.sources[0];
    assert!(used.left_out + used.outliers >= 2, "{used:?}");
}
