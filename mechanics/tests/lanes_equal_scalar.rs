//! Evaluation in lanes gives the same bits as one by one, over random and extreme states.

use crate::support;
use std::sync::Arc;

use crate::support::machine;
use proptest::prelude::*;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::{
    BatchWorkspace, Machine, Model, OutcomeColumns, Quantity, Scope, State, StateColumns,
    Workspace, evaluate, evaluate_into, evaluate_rows, ground_wrenches,
};

const EVERYTHING: Scope = Scope {
    parts: true,
    ..Scope::ALL
};

/// Realistic numbers, and numbers that only damaged logs contain.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -3.0..3.0_f64,
        2 => -50.0..50.0_f64,
        1 => prop::sample::select(vec![
            0.0, -0.0, 1e-320, 1e9, -1e12, 1e300, f64::MAX, f64::MIN_POSITIVE, f64::INFINITY, f64::NEG_INFINITY, f64::NAN,
        ]),
    ]
}

fn states(machine: &Machine, numbers: &[f64]) -> StateColumns {
    let size = State::<f64>::size(machine);
    let rows = numbers.len() / size;
    let mut columns = StateColumns::unknown(machine, rows);
    for row in 0..rows {
        columns.set_values(row, &numbers[row * size..(row + 1) * size]);
    }
    columns
}

fn one_by_one(machine: &Machine, states: &StateColumns) -> (OutcomeColumns, Vec<Reasons>) {
    let mut columns = OutcomeColumns::empty(machine, EVERYTHING);
    let mut reasons = Vec::new();
    let (mut state, mut workspace) = (
        State::zero(machine),
        Workspace::with_scope(machine, EVERYTHING),
    );
    for row in 0..states.rows() {
        states.get(row, &mut state);
        let outcome = evaluate(machine, &state, &mut workspace);
        for (column, &quantity) in columns.columns.iter_mut().zip(&columns.quantities) {
            column.push(outcome.get(quantity));
        }
        reasons.push(Reasons::NONE.with_outcome(outcome));
    }
    (columns, reasons)
}

/// Bitwise equality; any NaN equals any other, since its payload is meaningless.
fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

fn assert_equal_bits(machine: &Machine, numbers: &[f64]) {
    let states = states(machine, numbers);
    let (outcomes, (scalar, reasons)) = (
        evaluate_rows(
            machine,
            &states,
            0..states.rows(),
            EVERYTHING,
            &Arc::new(Model::WholeBody),
        ),
        one_by_one(machine, &states),
    );
    for ((quantity, lanes), scalar) in outcomes
        .quantities
        .iter()
        .zip(&outcomes.columns)
        .zip(&scalar.columns)
    {
        for (row, (&a, &b)) in lanes.iter().zip(scalar).enumerate() {
            assert!(
                same(a, b),
                "{quantity:?}, row {row}: {a:?} in lanes, {b:?} alone"
            );
        }
    }
    for (row, &alone) in reasons.iter().enumerate() {
        assert_eq!(outcomes.reasons(row, Reasons::NONE), alone, "row {row}");
    }
}

fn rows_of(machine: &Machine, rows: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(number(), rows * State::<f64>::size(machine))
}

/// Blocks of any length through the same memory give the rows of separate evaluations.
fn assert_blocks_equal_separate_rows(machine: &Machine, numbers: &[f64], lengths: &[usize]) {
    let (states, model) = (states(machine, numbers), Arc::new(Model::WholeBody));
    let mut workspace = BatchWorkspace::new(machine, EVERYTHING, &model);
    let mut block = OutcomeColumns::empty(machine, EVERYTHING);
    let (mut first, mut lengths) = (0, lengths.iter().cycle());
    while first < states.rows() {
        let end = (first + lengths.next().unwrap()).min(states.rows());
        evaluate_into(machine, &states, first..end, &mut workspace, &mut block);
        let alone = evaluate_rows(machine, &states, first..end, EVERYTHING, &model);
        for (quantity, (found, expected)) in
            (block.quantities.iter()).zip(block.columns.iter().zip(&alone.columns))
        {
            assert_eq!(found.len(), end - first);
            for (&a, &b) in found.iter().zip(expected) {
                assert!(
                    same(a, b),
                    "{quantity:?} in {first}..{end}: {a:?}, {b:?} alone"
                );
            }
        }
        for row in 0..end - first {
            let reasons = [&block, &alone].map(|columns| columns.reasons(row, Reasons::NONE));
            assert_eq!(reasons[0], reasons[1], "row {row} of {first}..{end}");
        }
        for wheel in 0..machine.wheels().len() {
            let of = |columns: &OutcomeColumns| columns.sensitivity.root_mean_squares(wheel);
            let squares = of(&block).into_iter().zip(of(&alone));
            for (place, (a, b)) in squares.enumerate() {
                assert!(
                    same(a, b),
                    "parameter {place} in {first}..{end}: {a:?}, {b:?} alone"
                );
            }
        }
        first = end;
    }
}

/// The wrench of the ground is that of whole evaluations.
fn assert_equal_wrenches(machine: &Machine, numbers: &[f64]) {
    let (states, model) = (states(machine, numbers), Arc::new(Model::WholeBody));
    let mut batch = BatchWorkspace::new(machine, Scope::LOADS, &model);
    let wrenches = ground_wrenches(machine, &states, 1..states.rows(), &mut batch);
    assert_eq!(wrenches.len(), states.rows() - 1);
    let (mut state, mut workspace) = (State::zero(machine), Workspace::new(machine));
    for (row, wrench) in (1..).zip(&wrenches) {
        states.get(row, &mut state);
        let alone = &evaluate(machine, &state, &mut workspace).ground_wrench;
        let pairs = [
            (&wrench.force, &alone.force),
            (&wrench.moment, &alone.moment),
        ];
        for (found, expected) in pairs {
            let mut numbers = found.iter().zip(expected);
            assert!(
                numbers.all(|(a, b)| same(*a, *b)),
                "row {row}: {found}, {expected} alone"
            );
        }
    }
}

proptest! {
    #![proptest_config(support::cases(300))]

    #[test]
    fn blocks_through_one_workspace_keep_no_trace_of_each_other(
        numbers in rows_of(&machine("rigid"), 41),
        lengths in prop::collection::vec(1..20_usize, 1..5),
    ) {
        assert_blocks_equal_separate_rows(&machine("rigid"), &numbers, &lengths);
    }

    #[test]
    fn with_measured_pivots(numbers in rows_of(&machine("rigid"), 7)) {
        assert_equal_bits(&machine("rigid"), &numbers);
    }

    #[test]
    fn wrenches_of_the_ground(numbers in rows_of(&machine("rigid"), 7)) {
        assert_equal_wrenches(&machine("rigid"), &numbers);
    }

    #[test]
    fn with_six_wheels_on_free_bogies(numbers in rows_of(&six_wheels(), 5)) {
        assert_equal_bits(&six_wheels(), &numbers);
    }
}

/// A machine on springs with free bogie joints.
fn six_wheels() -> Machine {
    let file = include_str!("data/six_wheels.toml");
    let spec = tipwatch_mechanics::MachineSpec::from_toml(file, "six_wheels.toml").unwrap();
    spec.check(
        include_str!("data/six_wheels.urdf"),
        "six_wheels.urdf",
        Default::default(),
    )
    .unwrap()
}

#[test]
fn plausible_states_stay_finite_and_cover_all_branches() {
    let machine = machine("rigid");
    let mut lifted = 0;
    let mut state = State::<f64>::zero(&machine);
    let mut workspace = Workspace::new(&machine);
    for k in 0..2000 {
        let phase = f64::from(k) * 0.37;
        support::set_joint(&machine, &mut state, "slew", [phase, 0.2, 0.1]);
        support::set_joint(
            &machine,
            &mut state,
            "lift",
            [-1.3 + 0.4 * (0.7 * phase).sin(), 0.1, 0.0],
        );
        support::set_joint(
            &machine,
            &mut state,
            "tilt",
            [-1.3 + 0.6 * (1.1 * phase).cos(), 0.0, 0.2],
        );
        support::set_joint(&machine, &mut state, "extension", [0.4, 0.0, 0.0]);
        state.imu.specific_force =
            nalgebra::Vector3::new(2.0 * phase.sin(), 2.5 * (1.3 * phase).cos(), 9.8);
        let outcome = evaluate(&machine, &state, &mut workspace);
        assert!(
            Quantity::all(&machine, Scope::LOADS)
                .iter()
                .all(|&q| outcome.get(q).is_finite()),
            "{k}: {outcome:?}"
        );
        lifted += usize::from(outcome.load.contains(&0.0));
    }
    assert!(
        lifted > 100 && lifted < 1900,
        "{lifted} of 2000 with a lifted wheel"
    );
}
