//! Physical properties of the suspension's hydraulics: oil, valve and cylinder.

use crate::support;
use proptest::prelude::*;
use tipwatch_mechanics::machine::HydraulicsSpec;
use tipwatch_suspension::hydraulics::{
    Actuator, ActuatorInput, ActuatorState, Pressures, StepError, Valve, flows, piston_force,
    pressure_rates,
};

const STROKE: f64 = 0.2;
const HELD: ActuatorInput = ActuatorInput::Motion { velocity: 0.0 };

fn actuator() -> Actuator {
    Actuator {
        parameters: HydraulicsSpec::default().parameters(STROKE),
    }
}

/// A valve with this opening.
fn open(opening: f64) -> Valve {
    let mut parameters = actuator().parameters;
    (parameters.gain, parameters.valve_rate) = (1.0, 1e9);
    Valve::closed().follow(&parameters, opening, 0.0, 1.0)
}

fn state(piston: f64, rod: f64, extension: f64) -> ActuatorState {
    ActuatorState {
        pressures: Pressures { piston, rod },
        extension,
        velocity: 0.0,
    }
}

/// Most that a pressure leaves the range between tank and relief (Pa) while the piston sweeps this flow (m^3/s): half as
/// much again as the drop over a safety valve of twenty times the valve's coefficient, and 0.5 MPa in any case.
fn safety_drop(swept: f64, coefficient: f64) -> f64 {
    let drop = (swept / (20.0 * coefficient)).powi(2);
    (1.5 * drop).max(5e5)
}

/// The printed Q_b has a plus sign: a valve opened towards b would then empty it, in contradiction to (28).
#[test]
fn val_negative_opening_fills_the_rod_side() {
    let parameters = actuator().parameters;
    let pressures = Pressures {
        piston: 8e6,
        rod: 5e6,
    };
    let (out, back) = (
        flows(&parameters, &pressures, 0.4),
        flows(&parameters, &pressures, -0.4),
    );
    assert!(out.piston > 0.0 && out.rod < 0.0, "{out:?}");
    assert!(back.piston < 0.0 && back.rod > 0.0, "{back:?}");
    let rates = pressure_rates(&parameters, &back, 0.1, 0.0);
    assert!(rates.rod > 0.0 && rates.piston < 0.0);
    // 40 l/min at 3.5 MPa over one edge of the fully open valve.
    let nominal = Pressures {
        piston: parameters.supply - 3.5e6,
        rod: parameters.tank + 3.5e6,
    };
    let full = flows(&parameters, &nominal, 1.0);
    assert!((full.piston - 40e-3 / 60.0).abs() < 1e-8 && (full.rod + 40e-3 / 60.0).abs() < 1e-8);
}

/// With the piston locked, the chambers fill from supply and drain to tank.
#[test]
fn val_locked_piston_settles_between_supply_and_tank() {
    let actuator = actuator();
    let p = &actuator.parameters;
    for (opening, piston, rod) in [(0.3, p.supply, p.tank), (-0.3, p.tank, p.supply)] {
        let settled = actuator
            .step(&state(9e6, 6e6, 0.1), open(opening), HELD, 20.0)
            .unwrap();
        assert!(
            (settled.pressures.piston - piston).abs() < 2e4,
            "{settled:?}"
        );
        assert!((settled.pressures.rod - rod).abs() < 2e4, "{settled:?}");
        let expected = p.piston_area * piston - p.ring_area * rod;
        assert!((actuator.force(&settled) - expected).abs() < 200.0);
    }
}

/// In steady motion the flows equal the volumes swept per time:
/// v^2 (A_a^3/c_a^2 + A_b^3/c_b^2)/u^2 + d v = A_a p_s - A_b p_r - F, and with a and b exchanged for retraction.
#[test]
fn val_steady_velocity_under_load() {
    let actuator = actuator();
    let p = actuator.parameters;
    for (opening, force, from) in [
        (0.5, 3e4, 0.02),
        (0.2, -1e4, 0.02),
        (-0.5, 2e4, 0.18),
        (-0.3, -2e4, 0.18),
    ] {
        let drive = ActuatorInput::Load {
            force,
            mass: 1500.0,
        };
        let mut moving = actuator.at_rest(from, force);
        for _ in 0..60 {
            moving = actuator.step(&moving, open(opening), drive, 0.01).unwrap();
        }
        let c = p.coefficients[0] * opening;
        let swept = (p.piston_area.powi(3) + p.ring_area.powi(3)) / (c * c);
        let pushed: f64 = if opening > 0.0 {
            p.piston_area * p.supply - p.ring_area * p.tank - force
        } else {
            p.ring_area * p.supply - p.piston_area * p.tank + force
        };
        let speed =
            (-p.friction + (p.friction * p.friction + 4.0 * swept * pushed).sqrt()) / (2.0 * swept);
        let expected = speed.copysign(opening);
        assert!(
            (moving.velocity - expected).abs() < 0.01 * speed,
            "{moving:?} {expected}"
        );
        assert!(
            moving.extension > 0.0 && moving.extension < STROKE,
            "{moving:?}"
        );
    }
}

/// Conservation: inflow equals the change of volume plus compression; its energy is work of the piston or stored
/// pressure.
#[test]
fn oil_and_energy_are_conserved() {
    let actuator = actuator();
    let p = actuator.parameters;
    let (mut now, dt) = (actuator.at_rest(0.05, 2e4), 1e-4);
    let drive = ActuatorInput::Load {
        force: 2e4,
        mass: 1500.0,
    };
    let (mut came, mut room, mut brought, mut done) = ([0.0; 2], [0.0; 2], 0.0, 0.0);
    let volumes = |s: &ActuatorState| {
        [
            p.dead_volumes[0] + p.piston_area * s.extension,
            p.dead_volumes[1] + p.ring_area * (STROKE - s.extension),
        ]
    };
    for k in 0..5000 {
        let valve = open(0.6 * (f64::from(k) * 2e-3).sin());
        let next = actuator.step(&now, valve, drive, dt).unwrap();
        let [before, after] =
            [now, next].map(|s| (actuator.flows(&s, valve), s.pressures, volumes(&s)));
        let mean = |of: fn(&Pressures<f64>) -> f64| 0.5 * (of(&before.1) + of(&after.1));
        let pressures = [mean(|p| p.piston), mean(|p| p.rod)];
        let flows = [
            0.5 * (before.0.piston + after.0.piston),
            0.5 * (before.0.rod + after.0.rod),
        ];
        let changes = [after.1.piston - before.1.piston, after.1.rod - before.1.rod];
        for side in 0..2 {
            came[side] += flows[side] * dt;
            let volume = 0.5 * (before.2[side] + after.2[side]);
            let pressed = volume * changes[side] / p.bulk_modulus;
            room[side] += after.2[side] - before.2[side] + pressed;
            brought += pressures[side] * flows[side] * dt;
            done += pressures[side] * pressed;
        }
        done += (p.piston_area * pressures[0] - p.ring_area * pressures[1])
            * (next.extension - now.extension);
        now = next;
    }
    for side in 0..2 {
        assert!(
            (came[side] - room[side]).abs() < 2e-3 * came[side].abs() + 1e-9,
            "{came:?} {room:?}"
        );
    }
    assert!(
        (brought - done).abs() < 2e-3 * brought.abs(),
        "{brought} {done}"
    );
    assert!(brought.abs() > 100.0, "{brought}");
}

/// Large steps agree with small steps of a textbook method.
#[test]
fn result_does_not_depend_on_step_length() {
    let actuator = actuator();
    let p = actuator.parameters;
    let (opening, force, mass) = (0.35, 2.5e4, 900.0);
    let drive = ActuatorInput::Load { force, mass };
    let start = actuator.at_rest(0.06, 5e3);
    let big = actuator.step(&start, open(opening), drive, 0.25).unwrap();
    // Fourth-order Runge-Kutta with steps of 2 microseconds.
    let rates = |y: [f64; 4]| {
        let pressures = Pressures {
            piston: y[0],
            rod: y[1],
        };
        let oil = pressure_rates(&p, &flows(&p, &pressures, opening), y[2], y[3]);
        let pushed = piston_force(&p, &pressures) - force - p.friction * y[3];
        [oil.piston, oil.rod, y[3], pushed / mass]
    };
    let mut y = [
        start.pressures.piston,
        start.pressures.rod,
        start.extension,
        0.0,
    ];
    let h = 2e-6;
    let ahead = |y: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
    for _ in 0..125_000 {
        let k1 = rates(y);
        let k2 = rates(ahead(y, k1, 0.5 * h));
        let k3 = rates(ahead(y, k2, 0.5 * h));
        let k4 = rates(ahead(y, k3, h));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    assert!(
        (big.extension - y[2]).abs() < 1e-4 && (big.velocity - y[3]).abs() < 2e-3,
        "{big:?} {y:?}"
    );
    assert!((big.pressures.piston - y[0]).abs() < 5e4, "{big:?} {y:?}");
}

/// (36) as in Fig. 11: k_p = 10, 25 s of (34); the valve saturates at the start, then the rod follows.
#[test]
fn val_valve_law_follows_suspension_command() {
    let actuator = actuator();
    let p = actuator.parameters;
    let wanted = |t: f64| 0.1 + 0.07 * (0.3 * t).sin();
    let (force, dt) = (3e4, 0.01);
    let (mut now, mut valve) = (actuator.at_rest(0.02, force), Valve::closed());
    let (mut worst, mut largest, mut fastest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for k in 0..2500 {
        let t = f64::from(k) * dt;
        let next = valve.follow(&p, wanted(t), now.extension, dt);
        fastest = fastest.max((next.opening() - valve.opening()).abs() / dt);
        valve = next;
        largest = largest.max(valve.opening().abs());
        now = actuator
            .step(
                &now,
                valve,
                ActuatorInput::Load {
                    force,
                    mass: 1500.0,
                },
                dt,
            )
            .unwrap();
        if t > 3.0 {
            worst = worst.max((now.extension - wanted(t)).abs());
        }
    }
    // v = k_p v_max error: 21 mm/s require 13 mm at the flow under this load.
    println!(
        "worst error after the start {:.1} mm, largest opening {largest:.2}",
        worst * 1e3
    );
    assert!(worst < 0.02, "{worst}");
    assert!(largest > 0.5 && largest <= 1.0 && fastest <= p.valve_rate + 1e-9);
}

proptest! {
    #![proptest_config(support::cases(60))]

    #[test]
    fn pressures_stay_between_tank_and_relief(
        openings in prop::collection::vec(-1.0..1.0_f64, 40),
        loads in prop::collection::vec(-1.0..1.0_f64, 40),
        piston in 0.0..1.0_f64, rod in 0.0..1.0_f64, out in 0.0..1.0_f64,
        long in prop::bool::ANY,
    ) {
        let actuator = actuator();
        let p = &actuator.parameters;
        let dt = if long { 0.05 } else { 0.002 };
        let between = |share: f64| p.tank + share * (p.supply - p.tank);
        // Locked, no chamber exceeds supply pressure; moving, relief and check valves bound the pressures.
        let mut held = state(between(piston), between(rod), out * STROKE);
        let mut moved = held;
        for (&opening, &load) in openings.iter().zip(&loads) {
            held = actuator.step(&held, open(opening), HELD, dt).unwrap();
            for pressure in [held.pressures.piston, held.pressures.rod] {
                prop_assert!((p.tank - 2e3..=p.supply + 2e3).contains(&pressure), "{held:?}");
            }
            let drive = ActuatorInput::Load { force: 8e4 * load, mass: 800.0 };
            let before = moved.velocity;
            moved = actuator.step(&moved, open(opening), drive, dt).unwrap();
            let speed = before.abs().max(moved.velocity.abs());
            for (pressure, drop) in [
                (moved.pressures.piston, safety_drop(p.piston_area * speed, p.coefficients[0])),
                (moved.pressures.rod, safety_drop(p.ring_area * speed, p.coefficients[2])),
            ] {
                prop_assert!((p.tank - drop..=p.relief + drop).contains(&pressure), "{moved:?}");
            }
            prop_assert!((-0.02..=STROKE + 0.02).contains(&moved.extension), "{moved:?}");
        }
    }

    #[test]
    fn no_input_causes_a_panic(
        numbers in prop::array::uniform8(prop_oneof![
            3 => -1e8..1e8_f64,
            1 => prop::sample::select(vec![0.0, f64::NAN, f64::INFINITY, 1e300, -1e-300]),
        ]),
    ) {
        let [piston, rod, out, velocity, opening, force, mass, seconds] = numbers;
        let start = ActuatorState { velocity, ..state(piston, rod, out) };
        let valve = Valve::closed().follow(&actuator().parameters, opening, 0.0, seconds);
        for drive in [ActuatorInput::Load { force, mass }, ActuatorInput::Motion { velocity: force }] {
            match actuator().step(&start, valve, drive, seconds) {
                Ok(after) => prop_assert!(after.extension.is_finite() && after.pressures.piston.is_finite()),
                Err(StepError::NotFinite | StepError::TooManySubsteps { .. }) => {}
            }
        }
    }
}
