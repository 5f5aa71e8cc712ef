//! Random sheets: a machine that weighs as much as they state, or a refusal.

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use strum::VariantNames;
use tipwatch_datasheet::{Length, Machine, Mass, Sheet, Template};

use crate::examples::axle_loads;

/// An example with every number changed by factors; the axle loads add up to the mass again.
fn changed(template: Template, factors: &[f64], front: f64) -> Sheet {
    let mut sheet = Sheet::from_toml(template.example(), "example").unwrap();
    let mut factors = factors.iter().copied().cycle();
    let mut next = || factors.next().unwrap();
    let length = |l: &mut Length, f: f64| l.si *= f;
    let mass = |m: &mut Mass, f: f64| m.si *= f;
    mass(&mut sheet.mass, next());
    for axle in &mut sheet.axles {
        axle.behind.iter_mut().for_each(|b| length(b, next()));
        axle.track.iter_mut().for_each(|t| length(t, next()));
        axle.laden = None;
        axle.load.iter_mut().for_each(|l| mass(l, next()));
    }
    if let Some(first) = sheet.axles.first_mut() {
        first.load.iter_mut().for_each(|l| mass(l, front));
    }
    let sum: f64 = sheet
        .axles
        .iter()
        .filter_map(|a| a.load)
        .map(|l| l.si)
        .sum();
    for axle in &mut sheet.axles {
        axle.load
            .iter_mut()
            .for_each(|l| l.si *= sheet.mass.si / sum);
    }
    let arm = &mut sheet.arm;
    arm.reach = None;
    length(&mut arm.ahead, next());
    arm.mass.iter_mut().for_each(|m| mass(m, next()));
    for segment in &mut arm.segments {
        segment.length.iter_mut().for_each(|l| length(l, next()));
        segment.extension.iter_mut().for_each(|l| length(l, next()));
        segment.cylinder = None;
        segment.at = None;
    }
    sheet
}

fn is_physical(machine: &Machine) {
    for link in machine.links.iter().filter(|link| link.mass > 0.0) {
        let [a, b, c] = link.inertia;
        let slack = 1e-9 * (a + b + c);
        let holds = a > 0.0
            && b > 0.0
            && c > 0.0
            && a + b >= c - slack
            && b + c >= a - slack
            && a + c >= b - slack;
        assert!(holds, "{}: {:?}", link.name, link.inertia);
    }
}

#[test]
fn random_sheets_weigh_what_they_say_or_are_refused() {
    let mut runner = TestRunner::new(Config::with_cases(400));
    let strategy = (
        0..Template::VARIANTS.len(),
        prop::collection::vec(0.75..1.3, 24),
        0.6..1.6,
    );
    let made = std::cell::Cell::new(0);
    runner
        .run(&strategy, |(template, factors, front)| {
            let template: Template = Template::VARIANTS[template].parse().unwrap();
            match changed(template, &factors, front).machine() {
                Ok(machine) => {
                    made.set(made.get() + 1);
                    is_physical(&machine);
                    let found = axle_loads(&machine);
                    if let Some(stated) = machine.stated_axle_loads() {
                        for (a, b) in found.iter().zip(&stated) {
                            prop_assert!(
                                (a / b - 1.0).abs() < 1e-6,
                                "{template}: {found:?} {stated:?}"
                            );
                        }
                    }
                    let total: f64 = found.iter().sum();
                    prop_assert!((total / machine.mass - 1.0).abs() < 1e-9);
                }
                Err(refused) => {
                    let text = refused.to_string();
                    prop_assert!(
                        text.contains("expected") && text.contains("found"),
                        "{text}"
                    );
                }
            }
            Ok(())
        })
        .unwrap();
    // a refusal of everything would prove nothing
    assert!(made.get() > 200, "{} machines", made.get());
}
