//! A controlled suspension is never worse than a locked one.

use crate::manoeuvres::{Manoeuvre, least_load};
use crate::problems::{Draws, control, machine};
use tipwatch_mechanics::machine::ControlMode;
use tipwatch_suspension::replay::SuspensionMotion;

#[test]
fn explore() {
    let machine = machine();
    let n: usize = std::env::var("N").map_or(8, |n| n.parse().unwrap());
    for (mode, independent) in [(ControlMode::LookAhead, false), (ControlMode::OneStep, true)] {
        let mut draws = Draws(5);
        let motion = SuspensionMotion::Controlled(control(mode, independent));
        println!("{mode:?} {independent}");
        for k in 0..n {
            let manoeuvre = Manoeuvre::draw(&mut draws, &machine);
            if std::env::var("ONLY").is_ok_and(|o| o.parse() != Ok(k)) { continue; }
            let c = manoeuvre.compared(&machine, &motion);
            let rows = c.fixed.spread.len();
            let max = |v: &[f64]| v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let min = |v: &[f64]| v.iter().copied().fold(f64::INFINITY, f64::min);
            let mean = |v: &[f64]| v.iter().sum::<f64>() / rows as f64;
            let (mut worst, mut lifted, mut at) = (f64::INFINITY, 0, 0);
            for row in 0..rows {
                let (f, m) = (least_load(&c.fixed, row), least_load(&c.moved, row));
                let d = m - f.min(500.0);
                if d < worst { worst = d; at = row; }
                lifted += usize::from(m <= 0.0 && f > 0.0);
            }
            let acc = c.moved.rods.iter().flat_map(|r| r.acceleration.iter().map(|a| a.abs())).fold(0.0, f64::max);
            if std::env::var("ONLY").is_ok_and(|o| o.parse() == Ok(k)) {
                let peak = (0..rows).max_by(|&a, &b| c.moved.spread[a].total_cmp(&c.moved.spread[b])).unwrap();
                for (name, mid) in [("load", at), ("spread", peak)] {
                    println!("{name}");
                    for row in mid.saturating_sub(40)..(mid + 8).min(rows) {
                        if row % 2 == 1 { continue; }
                        let r = &c.moved.rods[0];
                        println!("{row} fixed {:?} moved {:?} spread {:.0} {:.0} x {:.4} {:.4} v {:.3} {:.3} a {:.3} {:.3} u {:.3} {:?}",
                            c.fixed.otf.iter().map(|o| o[row] as i64).collect::<Vec<_>>(), c.moved.otf.iter().map(|o| o[row] as i64).collect::<Vec<_>>(),
                            c.fixed.spread[row], c.moved.spread[row],
                            r.reference[row] - c.fixed.rods[0].position[0], r.position[row] - c.fixed.rods[0].position[0], r.reference_velocity[row], r.velocity[row], r.commanded_acceleration[row], r.acceleration[row], r.opening[row], c.moved.status[row]);
                    }
                }
            }
            println!("{k:3} least {:6.0} -> {:6.0}  worst {worst:6.0} at {at:3} lifted {lifted:3}  spread mean {:6.0} -> {:6.0} best {:6.0}  max {:6.0} -> {:6.0}  angle {:.4} -> {:.4}  acc {acc:.2}",
                (0..rows).map(|r| least_load(&c.fixed, r)).fold(f64::INFINITY, f64::min),
                (0..rows).map(|r| least_load(&c.moved, r)).fold(f64::INFINITY, f64::min),
                mean(&c.fixed.spread), mean(&c.moved.spread), c.best.mean_spread(), max(&c.fixed.spread), max(&c.moved.spread),
                min(&c.fixed.stability_angle), min(&c.moved.stability_angle));
        }
    }
}
