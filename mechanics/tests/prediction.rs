//! Loads ahead by assumed motions.

use nalgebra::Vector3;
use proptest::prelude::*;
use tipwatch_mechanics::machine::Axis;
use tipwatch_mechanics::prediction::{
    Law, PacedPredictor, PredictedNumber, Prediction, PredictionGap, Predictor,
};
use tipwatch_mechanics::state::{Reason, Reasons};
use tipwatch_mechanics::verdict::Level;
use tipwatch_mechanics::{Contribution, Machine, Parameter, Scope, State, Workspace, evaluate_one};

use crate::support::{cases, edited, machine, set_joint, wheel};

const ARM: [(&str, f64); 4] = [
    ("slew", 0.0),
    ("lift", -1.3),
    ("tilt", -1.4),
    ("extension", 0.3),
];

fn rigid() -> Machine {
    with_reference(machine("rigid"))
}

fn with_reference(mut machine: Machine) -> Machine {
    machine.set_reference_loads().unwrap();
    machine
}

/// Returns the state at rest on level ground, arm in a working posture, with attitude and velocity known.
fn standing(machine: &Machine) -> State<f64> {
    let mut state = State::zero(machine);
    for (name, position) in ARM {
        set_joint(machine, &mut state, name, [position, 0.0, 0.0]);
    }
    state.imu.specific_force.z = machine.gravity();
    state.base.up = Vector3::z();
    state.base.velocity = Vector3::zeros();
    state.base.velocity_rate = Vector3::zeros();
    state
}

fn otf(machine: &Machine, state: &State<f64>) -> Vec<f64> {
    let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
    evaluate_one(machine, state, &mut workspace).otf.clone()
}

fn predicted(machine: &Machine, state: &State<f64>) -> (Prediction, Predictor) {
    let mut predictor = Predictor::new(machine);
    let prediction = predictor
        .predict(machine, state, Reasons::NONE, Level::Safe)
        .clone();
    (prediction, predictor)
}

#[track_caller]
fn assert_close(a: &[f64], b: &[f64], within: f64) {
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < within, "{a} {b}");
    }
}

#[test]
fn machine_at_rest_stays_as_it_is_by_every_law() {
    let machine = rigid();
    let state = standing(&machine);
    let now = otf(&machine, &state);
    let (prediction, predictor) = predicted(&machine, &state);
    for law in Law::ALL {
        let ahead = prediction.of(law);
        assert_eq!(ahead.gap, None, "{law:?}");
        assert!(!ahead.lifts() && ahead.utilisation < 1.0);
        assert_close(&ahead.otf_least, &now, 1e-6);
        for wheel in 0..4 {
            assert_close(&[predictor.otf_at(law, 1.3, wheel)], &[now[wheel]], 1e-6);
        }
    }
}

#[test]
fn braking_now_is_the_stated_deceleration_in_the_specific_force() {
    let machine = rigid();
    let mut state = standing(&machine);
    state.base.velocity.x = 4.0;
    let (prediction, _) = predicted(&machine, &state);
    let mut braking = state.clone();
    braking.change(Parameter::SpecificForce(Axis::X), -3.0);
    let expected = otf(&machine, &braking);
    let ahead = prediction.of(Law::BrakeNow);
    // backwards it is the front that loses load
    for name in ["RL", "RR"] {
        let rear = wheel(&machine, name);
        assert_close(&[ahead.otf_least[rear]], &[expected[rear]], 1e-6);
        assert!(expected[rear] < otf(&machine, &state)[rear]);
    }
    assert_eq!(ahead.cause, Some(Contribution::PlatformAcceleration));
    state.base.velocity.x = -4.0;
    let (back, _) = predicted(&machine, &state);
    let front = wheel(&machine, "FL");
    assert!(back.of(Law::BrakeNow).otf_least[front] < otf(&machine, &state)[front]);
}

#[test]
fn arm_that_lowers_and_goes_on_lifts_a_wheel_when_its_posture_does() {
    let machine = rigid();
    let mut state = standing(&machine);
    set_joint(&machine, &mut state, "extension", [0.3, 4.0, 0.0]);
    let (prediction, predictor) = predicted(&machine, &state);
    // the posture that it passes after one second, at that velocity
    let mut later = state.clone();
    set_joint(&machine, &mut later, "extension", [4.3, 4.0, 0.0]);
    let expected = otf(&machine, &later);
    let least = *expected.iter().min_by(|a, b| a.total_cmp(b)).unwrap();
    assert!(least < 0.0, "{expected:?}");
    let ahead = prediction.of(Law::GoOn);
    assert!(
        ahead.lift_off_s > 0.0 && ahead.lift_off_s < 1.0,
        "{ahead:?}"
    );
    // both rear wheels lift at once: the machine tips, and the band is that of the last instant before
    assert!(
        ahead.earliest_s < ahead.lift_off_s && ahead.lift_off_s < ahead.latest_s,
        "{ahead:?}"
    );
    assert_eq!(ahead.cause, Some(Contribution::ArmWeight));
    assert!(ahead.utilisation >= 1.0);
    // in between the computed instants the OTF is a straight line
    let lifted = ahead.wheel.unwrap();
    let at_lift = predictor.otf_at(Law::GoOn, ahead.lift_off_s, lifted);
    assert!(at_lift.abs() < 1.0, "{at_lift}");
    // 4 m/s with 2 m/s^2 take 4 m to stop: the wheel lifts on the way, but the arm does not get as far
    let stopped = prediction.of(Law::StopArm);
    assert!(
        stopped.otf_least[lifted] > ahead.otf_least[lifted] + 1000.0,
        "{stopped:?}"
    );
}

#[test]
fn what_is_unknown_is_a_gap_and_no_number() {
    let machine = rigid();
    let mut state = standing(&machine);
    let unknown = Vector3::repeat(f64::NAN);
    state.base.velocity = unknown;
    state.base.velocity_rate = unknown;
    let (prediction, _) = predicted(&machine, &state);
    let brake = prediction.of(Law::BrakeNow);
    assert_eq!(brake.gap, Some(PredictionGap::VelocityUnknown));
    assert!(
        PredictedNumber::ALL
            .iter()
            .all(|number| number.of(brake).is_nan())
    );
    assert!(brake.otf_least.iter().all(|otf| otf.is_nan()));
    assert_eq!((brake.wheel, brake.cause), (None, None));
    // neither attitude nor velocity: the specific force stays
    state.base.up = unknown;
    let (prediction, _) = predicted(&machine, &state);
    let goes_on = prediction.of(Law::GoOn);
    assert_eq!(goes_on.gap, None);
    assert_close(&goes_on.otf_least, &otf(&machine, &state), 1e-6);
    let armless = edited("rigid", |text| {
        let (before, after) = text.split_once("[arm]").unwrap();
        let rest = after.split_once("\n[").map_or("", |(_, rest)| rest);
        format!("{before}\n[{rest}")
    });
    let armless = with_reference(armless.unwrap());
    let (prediction, _) = predicted(&armless, &standing(&armless));
    assert_eq!(prediction.of(Law::StopArm).gap, Some(PredictionGap::NoArm));
    let mut predictor = Predictor::new(&machine);
    let known = standing(&machine);
    let mut gap = Reasons::NONE;
    gap.add(Reason::ImuGap);
    for (reasons, level) in [
        (gap, Level::Safe),
        (Reasons::NONE, Level::Fault),
        (Reasons::NONE, Level::Unknown),
    ] {
        let prediction = predictor.predict(&machine, &known, reasons, level);
        for law in Law::ALL {
            assert_eq!(prediction.of(law).gap, Some(PredictionGap::RowInvalid));
        }
    }
}

#[test]
fn keys_that_bound_nothing_are_refused() {
    for (key, expected) in [
        ("horizon = 0.0", "prediction.horizon"),
        ("horizon = 60.0", "at most 10 s"),
        ("points = 0", "1 to 32 instants"),
        ("points = 33", "1 to 32 instants"),
        ("period = 0.0", "prediction.period"),
        ("period = 0.2", "at most 0.1 s"),
        ("brake_deceleration = -1.0", "prediction.brake_deceleration"),
        ("stop_time = nan", "prediction.stop_time"),
        ("joints.nobody.deceleration = 1.0", "a measured joint"),
        ("joints.slew.deceleration = 0.0", "joints.slew.deceleration"),
        ("decay = 1.0", "unknown field"),
    ] {
        let refused = edited("rigid", |text| format!("{text}\n[prediction]\n{key}\n"));
        let error = refused.unwrap_err().to_string();
        assert!(error.contains(expected), "{key}: {error}");
    }
}

/// The row of a machine at rest, at this time and level.
fn paced(
    machine: &Machine,
    predictor: &mut PacedPredictor,
    (time_ns, level): (i64, Level),
    state: &State<f64>,
) -> Prediction {
    predictor
        .row(machine, time_ns, state, Reasons::NONE, level)
        .clone()
}

const MS: i64 = 1_000_000;

#[test]
fn quiet_predictions_are_repeated_until_the_next_period_at_level_safe_only() {
    let machine = rigid();
    let mut moving = standing(&machine);
    let mut predictor = PacedPredictor::new(&machine);
    let mut at = |time_ns, level, state: &State<f64>| {
        paced(&machine, &mut predictor, (time_ns, level), state)
    };
    let first = at(1005 * MS, Level::Safe, &standing(&machine));
    assert_eq!(first.age_s, 0.0);
    // it is the first row's, whatever the machine does now
    set_joint(&machine, &mut moving, "slew", [0.1, 0.05, 0.0]);
    let repeated = at(1019 * MS, Level::Safe, &moving);
    assert_eq!(repeated.age_s, 0.014);
    assert_eq!(
        format!("{:?}", repeated.ahead),
        format!("{:?}", first.ahead)
    );
    // the period of 20 ms ends
    let next = at(1020 * MS, Level::Safe, &moving);
    assert_eq!(next.age_s, 0.0);
    assert_ne!(format!("{:?}", next.ahead), format!("{:?}", first.ahead));
    for level in [Level::Notice, Level::Warning, Level::Danger] {
        assert_eq!(at(1021 * MS, level, &moving).age_s, 0.0, "{level:?}");
    }
    // nor is a prediction of another level repeated
    assert_eq!(at(1022 * MS, Level::Safe, &moving).age_s, 0.0);
    assert_eq!(at(1023 * MS, Level::Safe, &moving).age_s, 0.001);
    let unknown = at(1024 * MS, Level::Unknown, &moving);
    assert!(unknown.age_s.is_nan() && unknown.of(Law::GoOn).gap.is_some());
    assert_eq!(at(1025 * MS, Level::Safe, &moving).age_s, 0.0);
    // a clock that goes back
    assert_eq!(at(1021 * MS, Level::Safe, &moving).age_s, 0.0);
}

#[test]
fn what_may_lift_a_wheel_is_predicted_in_every_row() {
    let machine = rigid();
    let mut state = standing(&machine);
    set_joint(&machine, &mut state, "extension", [0.3, 4.0, 0.0]);
    let mut predictor = PacedPredictor::new(&machine);
    for time_ms in [1000, 1001, 1002] {
        let row = (time_ms * MS, Level::Safe);
        let prediction = paced(&machine, &mut predictor, row, &state);
        assert!(prediction.of(Law::GoOn).lifts());
        assert_eq!(prediction.age_s, 0.0);
    }
}

#[test]
fn predictions_do_not_depend_on_where_a_session_was_joined() {
    let machine = rigid();
    let mut joined: Vec<Option<PacedPredictor>> = vec![None, None];
    let mut state = standing(&machine);
    for row in 0..60_i64 {
        let time_ns = 7 * row * MS + row % 3;
        let phase = row as f64 * 0.3;
        set_joint(
            &machine,
            &mut state,
            "slew",
            [phase.sin(), phase.cos(), 0.0],
        );
        let starts = [0, 13];
        let predictions: Vec<_> = (joined.iter_mut().zip(starts))
            .filter(|(_, start)| row >= *start)
            .map(|(predictor, _)| {
                let predictor = predictor.get_or_insert_with(|| PacedPredictor::new(&machine));
                paced(&machine, predictor, (time_ns, Level::Safe), &state)
            })
            .collect();
        if row >= 13 + 3 {
            assert_eq!(
                format!("{:?}", predictions[0]),
                format!("{:?}", predictions[1]),
                "row {row}"
            );
        }
    }
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -3.0..3.0,
        1 => prop::num::f64::ANY,
    ]
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn nothing_panics_and_nothing_is_remembered(numbers in prop::collection::vec(any_number(), 40)) {
        let machine = rigid();
        let mut state = standing(&machine);
        let mut next = numbers.iter().copied().cycle();
        let mut number = || next.next().unwrap();
        for joint in &mut state.joints {
            joint.position = number();
            joint.rate = number();
            joint.acceleration = number();
        }
        state.imu.specific_force += Vector3::from_fn(|_, _| number());
        state.imu.angular_velocity = Vector3::from_fn(|_, _| number());
        state.base.velocity = Vector3::from_fn(|_, _| number());
        state.base.up = Vector3::from_fn(|_, _| number());
        let (fresh, mut predictor) = predicted(&machine, &state);
        for law in Law::ALL {
            let ahead = fresh.of(law);
            if ahead.gap.is_some() {
                prop_assert!(ahead.otf_least.iter().all(|otf| otf.is_nan()));
            } else {
                prop_assert!(ahead.otf_least.iter().all(|otf| otf.is_finite()));
                prop_assert!(ahead.wheel.is_some());
            }
            // later by less load, never earlier
            prop_assert!(!(ahead.earliest_s > ahead.lift_off_s));
            prop_assert!(!(ahead.lift_off_s > ahead.latest_s));
        }
        predictor.predict(&machine, &standing(&machine), Reasons::NONE, Level::Safe);
        let again = predictor.predict(&machine, &state, Reasons::NONE, Level::Safe);
        prop_assert_eq!(format!("{fresh:?}"), format!("{again:?}"));
    }
}
