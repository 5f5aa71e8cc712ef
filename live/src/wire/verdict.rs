//! Verdicts: conversion between the monitor and the wire.

use anyhow::Result;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::verdict::{Conditions, InputFaults, Level, LiftOff, Verdict};
use tipwatch_mechanics::{Machine, Outcome};

use crate::wire::sample::SampleCounts;
use crate::wire::session::name_to_wire;
use crate::wire::topics::{EVENT_BETWEEN, EVENT_ROW, Wire, WireMachine, WireVerdict};

impl WireVerdict {
    /// An unknown verdict: every number NaN.
    #[must_use]
    pub fn unknown() -> Self {
        let mut wire = Self::blank();
        for value in wire.numbers_mut() {
            *value = f64::NAN;
        }
        wire.event = EVENT_BETWEEN;
        wire
    }

    /// All numbers that are NaN if unknown.
    fn numbers_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        let single = [
            &mut self.utilisation,
            &mut self.time_to_lift_off_s,
            &mut self.normal_force,
            &mut self.zmp_x,
            &mut self.zmp_y,
            &mut self.zmp_margin,
            &mut self.ltr,
            &mut self.sigma,
            &mut self.spread,
        ];
        let by_place = [
            &mut self.load,
            &mut self.otf,
            &mut self.load_sigma,
            &mut self.otf_sigma,
            &mut self.load_min,
            &mut self.load_max,
            &mut self.itom_full,
            &mut self.itom,
            &mut self.tom,
            &mut self.mhs,
            &mut self.force_angle,
            &mut self.stability_angle,
        ];
        let causes = self.causes.as_flattened_mut();
        single
            .into_iter()
            .chain(by_place.into_iter().flatten())
            .chain(causes)
    }

    /// Sets the numbers of a row.
    pub fn set_row(
        &mut self,
        time_ns: i64,
        reasons: Reasons,
        outcome: &Outcome<f64>,
        utilisation: f64,
        next: Option<LiftOff>,
    ) {
        self.event = EVENT_ROW;
        self.time_ns = time_ns;
        self.reasons = reasons.bits().into();
        self.wheel_count = outcome.load.len() as u32;
        self.edge_count = outcome.itom_full.len() as u32;
        self.utilisation = utilisation;
        self.time_to_lift_off_s = next.map_or(f64::NAN, |next| next.in_s);
        self.next_wheel = next.map_or(0, |next| next.wheel as u32);
        self.normal_force = outcome.normal_force;
        self.zmp_x = outcome.zmp_x;
        self.zmp_y = outcome.zmp_y;
        self.zmp_margin = outcome.zmp_margin;
        let indicators = &outcome.indicators;
        self.ltr = indicators.load_transfer_ratio;
        self.sigma = indicators.sigma;
        self.spread = indicators.spread;
        copy(&mut self.load, &outcome.load);
        copy(&mut self.otf, &outcome.otf);
        copy(&mut self.load_sigma, &outcome.uncertainty.load);
        copy(&mut self.otf_sigma, &outcome.uncertainty.otf);
        copy(&mut self.load_min, &outcome.load_least);
        copy(&mut self.load_max, &outcome.load_largest);
        copy(&mut self.itom_full, &outcome.itom_full);
        copy(&mut self.itom, &indicators.itom);
        copy(&mut self.tom, &indicators.tom);
        copy(&mut self.mhs, &indicators.mhs);
        copy(&mut self.force_angle, &indicators.force_angle);
        copy(&mut self.stability_angle, &indicators.stability_angle);
        for (wheel, causes) in outcome.contributions.iter().enumerate() {
            for (by_wheel, &value) in self.causes.iter_mut().zip(causes) {
                by_wheel[wheel] = value;
            }
        }
    }

    /// Sets the verdict, the conditions of the input and the counts of samples.
    pub fn set_verdict(&mut self, verdict: Verdict, conditions: Conditions, counts: SampleCounts) {
        self.level = verdict.level as u32;
        self.latched_level = verdict.latched_level as u32;
        self.faults = conditions.faults.bits();
        self.cautions = conditions.cautions.bits();
        self.rows = counts.rows;
        self.lost = counts.lost;
        self.refused = counts.refused;
        self.repeated = counts.repeated;
    }

    /// The levels. An unknown number is a fault.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        Verdict {
            level: Level::from_number(self.level),
            latched_level: Level::from_number(self.latched_level),
        }
    }

    /// Problems of the input.
    #[must_use]
    pub fn conditions(&self) -> Conditions {
        Conditions {
            faults: InputFaults::from_bits(self.faults),
            cautions: InputFaults::from_bits(self.cautions),
        }
    }

    /// Why the row is not valid.
    #[must_use]
    pub fn row_reasons(&self) -> Reasons {
        Reasons::from_bits(self.reasons as u16)
    }
}

fn copy(to: &mut [f64], from: &[f64]) {
    for (to, &from) in to.iter_mut().zip(from) {
        *to = from;
    }
}

impl WireMachine {
    /// The message for this machine, without head.
    ///
    /// # Errors
    /// A name is too long for the wire.
    pub fn new(machine: &Machine, session: u64) -> Result<Self> {
        let limits = machine.limits();
        let edges = machine.polygon().edges();
        let mut wire = Self {
            session,
            limits: [limits.notice, limits.warning, limits.limit],
            wheel_count: machine.wheels().len() as u32,
            edge_count: edges.len() as u32,
            name: name_to_wire(machine.name())?,
            ..Self::blank()
        };
        for (name, wheel) in wire.wheel_names.iter_mut().zip(machine.wheels()) {
            *name = name_to_wire(&wheel.name.to_lowercase())?;
        }
        for (name, edge) in wire.edge_names.iter_mut().zip(edges) {
            *name = name_to_wire(&edge.name)?;
        }
        Ok(wire)
    }
}
