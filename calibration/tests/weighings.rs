//! Weighings in several postures.

use tipwatch_calibration::identification::{Knowledge, Measured, Situation, identify};
use tipwatch_mechanics::machine::{Machine, Parameter, Unknown};

use crate::support::{Noise, load_error, machine, postures, weighed, weighings, wrong};

/// Standard deviation of a scale (N).
const SCALE: f64 = 20.0;

/// The split between the diagonals is open, so errors are compared with those of the true machine as scales see them.
fn held_back_error(truth: &Machine, count: usize, seed: u64) -> (f64, f64, f64) {
    let mut noise = Noise::new(seed);
    let stated = wrong(truth, &mut noise);
    let data = weighings(truth, count, SCALE, &mut noise);
    let found = identify(&stated, None, &data).unwrap();
    let held = found.held_back.unwrap();
    assert!(held.instants >= 3);
    let identified = stated.with_identified(found.identified);
    let others = postures(truth, 40, &mut noise);
    let error = load_error(truth, &identified, &others);
    // a true machine's error on the scales is the scales' own
    (held.loads_before, held.loads_after, error)
}

#[test]
fn wrong_masses_and_centres_of_mass_are_corrected_as_far_as_scales_can_tell() {
    let truth = machine("");
    for seed in 1..=3 {
        let (before, after, error) = held_back_error(&truth, 24, seed);
        assert!(before > 5.0 * SCALE, "seed {seed}: {before}");
        assert!(after < 1.5 * SCALE, "seed {seed}: {before} {after}");
        assert!(error < 1.5 * SCALE, "seed {seed}: {error}");
    }
}

#[test]
fn what_scales_on_level_ground_cannot_tell_keeps_its_standard_deviation() {
    let truth = machine("");
    let mut noise = Noise::new(7);
    let stated = wrong(&truth, &mut noise);
    let data = weighings(&truth, 24, SCALE, &mut noise);
    let found = identify(&stated, None, &data).unwrap();
    let place = |name: &str| found.estimates.iter().position(|e| e.name == name).unwrap();
    // the height of the platform's centre of mass, its inertia and the gyro have no effect on a level machine at rest
    for name in [
        "base_link.com_z",
        "base_link.inertia_share",
        "imu.angular_velocity_z",
        "imu.rotation_z",
    ] {
        let place = place(name);
        let estimate = &found.estimates[place];
        assert_eq!(estimate.knowledge, Knowledge::Undetermined, "{estimate:?}");
        assert!(estimate.sigma > 0.98 * estimate.prior_sigma, "{estimate:?}");
        assert!(
            estimate.change.abs() < 0.2 * estimate.prior_sigma,
            "{estimate:?}"
        );
        assert!(found.undetermined.contains(&place), "{name}");
    }
    // the total mass is told far better than that of any part
    let mass = &found.estimates[place("base_link.mass")];
    assert_eq!(mass.knowledge, Knowledge::Determined, "{mass:?}");
    let identified = stated.with_identified(found.identified.clone());
    assert!(
        (identified.mass() - truth.mass()).abs() < 10.0,
        "{}",
        identified.mass()
    );
    // the four wheels' masses and that of the platform are told only together
    assert!(!found.indistinguishable.is_empty());
}

#[test]
fn one_weighing_on_a_known_slope_tells_the_height_of_the_centre_of_mass() {
    let truth = machine("");
    let mut noise = Noise::new(3);
    let stated = wrong(&truth, &mut noise);
    let sigma_of_height = |sigma_of_slope: f64, noise: &mut Noise| {
        let mut data = weighings(&truth, 3, SCALE, noise);
        for (source, slope) in data
            .sources
            .iter_mut()
            .zip([[0.2, 0.0], [-0.2, 0.0], [0.0, 0.15]])
        {
            let Situation::AtRest { positions, .. } = &source.instants[0].situation else {
                unreachable!();
            };
            let situation = Situation::AtRest {
                positions: positions.clone(),
                slope,
                slope_sigma: sigma_of_slope,
            };
            source.instants[0] = weighed(&truth, situation, 0.0, SCALE, noise);
        }
        let found = identify(&stated, None, &data).unwrap();
        let height = Unknown::Parameter(Parameter::LinkCom(0, tipwatch_mechanics::Axis::Z));
        found.identified.sigma(height).unwrap()
    };
    let (known, unknown) = (
        sigma_of_height(0.0, &mut noise),
        sigma_of_height(0.1, &mut noise),
    );
    assert!(known < 0.75 * 0.03, "{known}");
    // a slope of which nobody knows anything tells nothing
    assert!(unknown > 0.9 * 0.03, "{unknown}");
}

#[test]
fn an_accelerometer_on_level_ground_tells_its_mounting() {
    let truth = machine("");
    let mut noise = Noise::new(4);
    // the IMU leans by 0.01 rad, which the machine file does not know
    let leaning = Parameter::ImuRotation(tipwatch_mechanics::Axis::Y);
    let real = truth.changed(&[(leaning, 0.01)]);
    let mut data = weighings(&real, 3, SCALE, &mut noise);
    data.channels.extend(
        (0..3).map(|_| tipwatch_calibration::identification::Channel {
            name: "IMU".into(),
            unit: "m/s^2",
            bias_sigma: 0.0,
            is_load: false,
        }),
    );
    for source in &mut data.sources {
        let instant = &mut source.instants[0];
        instant.readings.extend(
            (0..3).map(|axis| tipwatch_calibration::identification::Reading {
                what: Measured::SpecificForce { axis },
                value: 0.0,
                sigma: 0.002,
                channel: 4 + axis,
            }),
        );
        let predicted = tipwatch_calibration::identification::predict(&real, instant);
        let straight = tipwatch_calibration::identification::predict(&truth, instant);
        let lean = (predicted[4] - straight[4]).abs();
        assert!(
            (lean - 9.8066 * 0.01_f64.sin()).abs() < 1e-3,
            "{predicted:?} {straight:?}"
        );
        for axis in 0..3 {
            instant.readings[4 + axis].value = predicted[4 + axis];
        }
    }
    let found = identify(&truth, None, &data).unwrap();
    let change = |name: &str| {
        let estimate = found.estimates.iter().find(|e| e.name == name).unwrap();
        (estimate.change, estimate.sigma, estimate.prior_sigma)
    };
    // rotation and bias have the same effect on level ground: they share it by their standard deviations, 0.005 rad
    // and 0.03 m/s^2 = 0.003 rad
    let (rotation, bias) = (change("imu.rotation_y"), change("imu.specific_force_x"));
    let together = rotation.0 + bias.0 / 9.8066;
    // the rest is in the radii of the wheels, which lean the base by 0.001 rad
    assert!(
        (together.abs() - 0.01).abs() < 2e-3,
        "{rotation:?} {bias:?}"
    );
    assert!(
        rotation.1 > 0.4 * rotation.2 && bias.1 > 0.6 * bias.2,
        "{rotation:?} {bias:?}"
    );
}

#[test]
fn weighing_twice_is_one_identification_of_both() {
    let truth = machine("");
    let mut noise = Noise::new(11);
    let stated = wrong(&truth, &mut noise);
    let data = weighings(&truth, 3, SCALE, &mut noise);
    let part = |range: std::ops::Range<usize>| tipwatch_calibration::identification::Data {
        channels: data.channels.clone(),
        sources: data.sources[range].to_vec(),
    };
    let whole = identify(&stated, None, &data).unwrap();
    let first = identify(&stated, None, &part(0..2)).unwrap();
    let then = identify(&stated, Some(&first.identified), &part(2..3)).unwrap();
    // up to the curvature between the points of linearisation, and directions that are told by less than 1 %
    let pairs = whole.estimates.iter().zip(&then.estimates);
    for (whole, then) in pairs {
        assert_eq!(whole.name, then.name);
        let sigma = whole.prior_sigma;
        assert!(
            (whole.sigma - then.sigma).abs() < 0.1 * sigma,
            "{whole:?} {then:?}"
        );
        assert!(
            (whole.change - then.change).abs() < 0.1 * sigma,
            "{whole:?} {then:?}"
        );
    }
}
