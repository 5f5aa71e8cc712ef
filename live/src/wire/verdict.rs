//! Verdicts: conversion between the monitor and the wire.

use anyhow::Result;
use tipwatch_mechanics::estimation::plausibility::Inherited;
use tipwatch_mechanics::estimation::support_configuration::GroundGap;
use tipwatch_mechanics::machine::{Commissioned, Proofs};
use tipwatch_mechanics::prediction::{Law, PredictedNumber, Prediction, PredictionGap};
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::studies::measured_forces::ForceDoubt;
use tipwatch_mechanics::studies::measured_loads::LoadDoubt;
use tipwatch_mechanics::verdict::{
    Basis, Conditions, HeldProblems, InputFaults, Latch, Level, LiftOff, Verdict,
};
use tipwatch_mechanics::{
    Contribution, Machine, Outcome, Parameter, Quantity, State, verdict_quantities,
};

use crate::wire::sample::SampleCounts;
use crate::wire::session::name_to_wire;
use crate::wire::topics::{
    EVENT_BETWEEN, EVENT_ROW, LAWS, MAX_ARM_FORCES, MAX_JOINTS, MAX_LOAD_SENSORS, MAX_PLACES,
    NAME_BYTES, Wire, WireMachine, WireVerdict,
};

/// [`GroundUnknown::number`] of the first support whose signal is missing.
const MISSING: u32 = 16;
/// [`GroundUnknown::number`] of the first support that carries although it is told to be off the ground.
const CARRIES: u32 = 32;

/// Reason for which the supports that a machine stands on are unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroundUnknown {
    /// A gap in what is told of the supports.
    Gap(GroundGap),
    /// The machine cannot stand on the supports that it is told to stand on.
    Impossible,
    /// The supports are known, but in its reference posture the machine would not stand on them: without reference loads its
    /// utilisation is unknown, and its loads are not.
    NoReferenceLoads,
}

impl GroundUnknown {
    /// The number on the wire.
    #[must_use]
    pub fn number(self) -> u32 {
        match self {
            Self::Gap(GroundGap::Transition | GroundGap::Taken) => 1,
            Self::Impossible => 2,
            Self::NoReferenceLoads => 3,
            Self::Gap(GroundGap::Missing(support)) => MISSING + support.index() as u32,
            Self::Gap(GroundGap::Carries(support)) => CARRIES + support.index() as u32,
        }
    }
}

/// Correspondence between the wheels of a verdict and those on the ground, which are in the same order.
#[derive(Debug, Clone, Copy)]
struct Places {
    /// Bits: the wheels of the verdict that are on the ground.
    standing: u32,
}

impl Places {
    fn of(machine: &Machine) -> Self {
        let bit = |index: usize| 1_u32 << index;
        let bits: u32 = match machine.supports().vary() {
            true => machine.stands_on().iter().map(|on| bit(on.index())).sum(),
            // such a machine has no other wheels in its verdicts
            false => (0..machine.wheels().len()).map(bit).sum(),
        };
        Self { standing: bits }
    }

    /// The place of a wheel of the verdict among those on the ground.
    fn place(self, wheel: usize) -> Option<usize> {
        let bit = 1_u32.checked_shl(wheel as u32)?;
        let before = self.standing & (bit - 1);
        (self.standing & bit != 0).then_some(before.count_ones() as usize)
    }

    /// The wheel of the verdict at a place among those on the ground.
    fn wheel(self, place: usize) -> u32 {
        let mut wheels = (0..MAX_PLACES).filter(|wheel| self.place(*wheel).is_some());
        wheels.nth(place).unwrap_or(0) as u32
    }
}

impl WireVerdict {
    /// An unknown verdict: every number NaN.
    #[must_use]
    pub fn unknown() -> Self {
        let mut wire = Self::blank();
        wire.each_number_mut(Some, MAX_PLACES, |_, number| *number = f64::NAN);
        wire.time_to_lift_off_s = f64::NAN;
        wire.set_load_doubt(&LoadDoubt::default());
        (wire.payload_mass_kg, wire.payload_mass_sigma_kg) = (f64::NAN, f64::NAN);
        wire.predicted_age_s = f64::NAN;
        wire.prediction_gap = [PredictionGap::RowInvalid as u32; LAWS];
        for number in PredictedNumber::ALL {
            *wire.predicted_mut(number) = [f64::NAN; LAWS];
        }
        wire.predicted_otf_min = [[f64::NAN; MAX_PLACES]; LAWS];
        wire.event = EVENT_BETWEEN;
        wire
    }

    /// Sets the supports on the ground, and forgets the numbers on others: `on` is the machine on them, and `wheels` the number
    /// of all its supports.
    pub fn set_ground(&mut self, wheels: usize, on: Result<&Machine, GroundUnknown>) {
        self.each_number_mut(Some, MAX_PLACES, |_, number| *number = f64::NAN);
        self.wheel_count = wheels as u32;
        self.edge_count = 0;
        (self.edge_from, self.edge_to) = Default::default();
        let machine = match on {
            Ok(machine) => machine,
            Err(why) => {
                (self.standing, self.ground_gap) = (0, why.number());
                return;
            }
        };
        let places = Places::of(machine);
        self.standing = places.standing;
        let mut references = machine.reference().static_load.iter();
        self.ground_gap = match machine.supports().vary() && references.any(|load| load.is_nan()) {
            true => GroundUnknown::NoReferenceLoads.number(),
            false => 0,
        };
        let edges = machine.polygon().edges();
        self.edge_count = edges.len() as u32;
        let ends = self.edge_from.iter_mut().zip(&mut self.edge_to);
        for ((from, to), edge) in ends.zip(edges) {
            *from = places.wheel(edge.from);
            *to = places.wheel(edge.to);
        }
    }

    /// Sets the numbers of a row on the supports that were set last; `outcome` is `None` where these are unknown.
    pub fn set_row(
        &mut self,
        time_ns: i64,
        reasons: Reasons,
        outcome: Option<&Outcome<f64>>,
        utilisation: f64,
        next: Option<LiftOff>,
    ) {
        self.event = EVENT_ROW;
        self.time_ns = time_ns;
        self.reasons = reasons.bits().into();
        let (places, edges) = (self.places(), self.edge_count as usize);
        if let Some(outcome) = outcome {
            self.each_number_mut(
                |wheel| places.place(wheel),
                edges,
                |quantity, number| *number = outcome.get(quantity),
            );
        }
        self.utilisation = utilisation;
        self.time_to_lift_off_s = next.map_or(f64::NAN, |next| next.in_s);
        self.next_wheel = next.map_or(0, |next| places.wheel(next.wheel));
    }

    /// Sets what measured loads contradict on the supports that were set last, and what would explain it.
    pub fn set_load_doubt(&mut self, doubt: &LoadDoubt) {
        self.load_doubt = u32::from(doubt.sensor.is_some()) | u32::from(doubt.is_total) << 1;
        self.doubted_load_sensor = doubt.sensor.map_or(0, |sensor| sensor as u32);
        let unstated = doubt.unstated;
        self.load_explanation = u32::from(unstated.is_some())
            | u32::from(unstated.is_some_and(|load| load.at_tool)) << 1
            | u32::from(unstated.is_some_and(|load| load.at_support)) << 2
            | u32::from(doubt.exchanged.is_some()) << 3;
        let places = self.places();
        let exchanged = doubt.exchanged.iter().flatten();
        let exchanged = exchanged.filter(|_| self.standing != 0);
        self.exchanged_sensors = exchanged.map(|&place| 1_u32 << places.wheel(place)).sum();
        self.unstated_mass_kg = unstated.map_or(f64::NAN, |load| load.mass_kg);
        self.unstated_mass_sigma_kg = unstated.map_or(f64::NAN, |load| load.mass_sigma_kg);
    }

    /// Sets what the measured forces of the arm contradict, and which of them have stopped.
    pub fn set_force_doubt(&mut self, doubt: ForceDoubt) {
        (self.doubted_forces, self.frozen_forces) = (doubt.contradicted, doubt.frozen);
    }

    /// Sets what is known of the payloads whose mass is known row by row.
    pub fn set_payloads(&mut self, machine: &Machine, state: &State<f64>) {
        let payloads = machine.payloads().iter().enumerate();
        let by_row = payloads.filter(|(_, payload)| payload.is_by_row);
        let known = by_row.map(|(index, _)| {
            let mass = state.payload_share[index];
            let sigma = state.sigma(machine, Parameter::PayloadMass(index));
            match mass {
                0.0 => [0.0; 2],
                Machine::EMPTY_PAYLOAD => [0.0, sigma],
                _ => [mass, sigma + mass * 0.0],
            }
        });
        let sum = known.reduce(|a, b| [a[0] + b[0], a[1].hypot(b[1])]);
        [self.payload_mass_kg, self.payload_mass_sigma_kg] = sum.unwrap_or([f64::NAN; 2]);
    }

    /// The load sensor that is furthest off, where the loads of single sensors contradict the computed ones.
    #[must_use]
    pub fn doubted_load_sensor(&self) -> Option<usize> {
        (self.load_doubt & 1 != 0).then_some(self.doubted_load_sensor as usize)
    }

    /// Whether a wheel is on the ground as a support; `false` while the supports are unknown.
    #[must_use]
    pub fn is_standing(&self, wheel: usize) -> bool {
        self.places().place(wheel).is_some()
    }

    /// Returns the reason for which the supports on the ground, or the utilisation on them, are unknown, and its wheel, if it is about
    /// one; `None` if they are known. An unknown number is a reason, too.
    #[must_use]
    pub fn ground_gap(&self) -> Option<(&'static str, Option<usize>)> {
        let wheel = |from: u32| Some((self.ground_gap - from) as usize);
        match self.ground_gap {
            0 => None,
            1 => Some(("transition", None)),
            2 => Some(("impossible", None)),
            3 => Some(("no_reference_loads", None)),
            MISSING..CARRIES => Some(("signal_missing", wheel(MISSING))),
            CARRIES.. => Some(("carries_though_off", wheel(CARRIES))),
            _ => Some(("unknown", None)),
        }
    }

    fn places(&self) -> Places {
        Places {
            standing: self.standing,
        }
    }

    /// Sets of which joints the rate that is asked for is known; the others are NaN.
    pub fn set_commanded(&mut self, commands: &[f64]) {
        let known = commands.iter().take(MAX_JOINTS).enumerate();
        let known = known.filter(|(_, rate)| rate.is_finite());
        self.commanded = known.map(|(joint, _)| 1_u64 << joint).sum();
    }

    /// Sets what is predicted.
    pub fn set_prediction(&mut self, prediction: &Prediction) {
        for law in Law::ALL {
            let (ahead, place) = (prediction.of(law), law as usize);
            self.prediction_gap[place] = ahead.gap.map_or(0, |gap| gap as u32);
            self.predicted_wheel[place] = ahead.wheel.map_or(0, |wheel| wheel as u32);
            self.predicted_cause[place] = ahead.cause.map_or(0, |cause| 1 + cause as u32);
            for number in PredictedNumber::ALL {
                self.predicted_mut(number)[place] = number.of(ahead);
            }
            let wheels = self.predicted_otf_min[place].iter_mut();
            wheels
                .zip(&ahead.otf_least)
                .for_each(|(number, otf)| *number = *otf);
        }
        self.predicted_age_s = prediction.age_s;
    }

    /// A number of the prediction by law.
    #[must_use]
    pub fn predicted(&self, number: PredictedNumber) -> &[f64; LAWS] {
        match number {
            PredictedNumber::LiftOff => &self.predicted_lift_off_s,
            PredictedNumber::Earliest => &self.predicted_earliest_s,
            PredictedNumber::Latest => &self.predicted_latest_s,
            PredictedNumber::Utilisation => &self.predicted_utilisation,
        }
    }

    fn predicted_mut(&mut self, number: PredictedNumber) -> &mut [f64; LAWS] {
        match number {
            PredictedNumber::LiftOff => &mut self.predicted_lift_off_s,
            PredictedNumber::Earliest => &mut self.predicted_earliest_s,
            PredictedNumber::Latest => &mut self.predicted_latest_s,
            PredictedNumber::Utilisation => &mut self.predicted_utilisation,
        }
    }

    /// Returns the reason for which nothing is predicted by an assumed motion; `None` if something is. An unknown number is a
    /// reason, too.
    #[must_use]
    pub fn gap_of(&self, law: Law) -> Option<PredictionGap> {
        PredictionGap::from_number(self.prediction_gap[law as usize])
    }

    /// The cause behind a predicted lift.
    #[must_use]
    pub fn predicted_cause_of(&self, law: Law) -> Option<Contribution> {
        let number = self.predicted_cause[law as usize] as usize;
        Contribution::ALL.get(number.checked_sub(1)?).copied()
    }

    /// Sets the verdict, the conditions of the input and the counts of samples.
    pub fn set_verdict(&mut self, verdict: Verdict, conditions: Conditions, counts: SampleCounts) {
        self.level = verdict.level as u32;
        self.latched_level = verdict.latched_level as u32;
        self.basis = verdict.basis as u32;
        self.unproven = verdict.unproven.bits();
        self.faults = conditions.faults.bits();
        self.cautions = conditions.cautions.bits();
        self.held_faults = verdict.held.faults.bits();
        self.held_cautions = verdict.held.cautions.bits();
        self.held_reasons = verdict.held.reasons.bits().into();
        self.rows = counts.rows;
        self.lost = counts.lost;
        self.refused = counts.refused;
        self.repeated = counts.repeated;
    }

    /// Sets the latched alarm.
    pub fn set_alarm(&mut self, latch: Latch) {
        self.alarm = latch.level.map_or(0, |level| level as u32);
        self.alarm_acknowledged = latch.is_acknowledged.into();
    }

    /// The latched alarm. An unknown number is a fault.
    #[must_use]
    pub fn latch(&self) -> Latch {
        Latch {
            level: (self.alarm != 0).then(|| Level::from_number(self.alarm)),
            is_acknowledged: self.alarm_acknowledged != 0,
        }
    }

    /// The levels. An unknown number is a fault.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        Verdict {
            level: Level::from_number(self.level),
            latched_level: Level::from_number(self.latched_level),
            basis: Basis::from_number(self.basis),
            unproven: Proofs::from_bits(self.unproven),
            held: HeldProblems {
                faults: InputFaults::from_bits(self.held_faults),
                cautions: InputFaults::from_bits(self.held_cautions),
                reasons: Reasons::from_bits(self.held_reasons as u16),
            },
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

    /// Returns the reasons for which the row is not valid.
    #[must_use]
    pub fn row_reasons(&self) -> Reasons {
        Reasons::from_bits(self.reasons as u16)
    }
}

macro_rules! verdict_numbers {
    (
        worst_wheel { $($worst:ident: $worst_of:ident),* $(,)? }
        machine { $($one:ident: $one_of:ident),* $(,)? }
        wheel { $($wheel:ident: $wheel_of:ident),* $(,)? }
        cause_and_wheel { $($cause:ident: $cause_of:ident),* $(,)? }
        edge { $($edge:ident: $edge_of:ident),* $(,)? }
    ) => {
        impl WireVerdict {
            /// The quantities of a verdict for that many wheels and edges, in the order of its recording.
            pub fn each_quantity(wheels: usize, edges: usize, mut each: impl FnMut(Quantity)) {
                $(each(Quantity::$worst_of);)*
                $(each(Quantity::$one_of);)*
                $((0..wheels).for_each(|wheel| each(Quantity::$wheel_of(wheel)));)*
                $((0..edges).for_each(|edge| each(Quantity::$edge_of(edge)));)*
                $(for cause in Contribution::ALL {
                    (0..wheels).for_each(|wheel| each(Quantity::$cause_of(cause, wheel)));
                })*
            }

            /// The number of a quantity; `None` if the verdict does not carry it.
            #[must_use]
            pub fn number(&self, quantity: Quantity) -> Option<f64> {
                match quantity {
                    $(Quantity::$worst_of => Some(self.$worst),)*
                    $(Quantity::$one_of => Some(self.$one),)*
                    $(Quantity::$wheel_of(wheel) => self.$wheel.get(wheel).copied(),)*
                    $(Quantity::$edge_of(edge) => self.$edge.get(edge).copied(),)*
                    $(Quantity::$cause_of(cause, wheel) => {
                        self.$cause[cause as usize].get(wheel).copied()
                    })*
                    _ => None,
                }
            }

            /// Every number of a quantity: of the wheels that have a place among those on the ground, and of that many edges.
            fn each_number_mut(
                &mut self,
                place: impl Fn(usize) -> Option<usize>,
                edges: usize,
                mut each: impl FnMut(Quantity, &mut f64),
            ) {
                $(each(Quantity::$worst_of, &mut self.$worst);)*
                $(each(Quantity::$one_of, &mut self.$one);)*
                $(for (wheel, number) in self.$wheel.iter_mut().enumerate() {
                    if let Some(place) = place(wheel) {
                        each(Quantity::$wheel_of(place), number);
                    }
                })*
                $(for (edge, number) in self.$edge.iter_mut().take(edges).enumerate() {
                    each(Quantity::$edge_of(edge), number);
                })*
                $(for (cause, numbers) in Contribution::ALL.into_iter().zip(&mut self.$cause) {
                    for (wheel, number) in numbers.iter_mut().enumerate() {
                        if let Some(place) = place(wheel) {
                            each(Quantity::$cause_of(cause, place), number);
                        }
                    }
                })*
            }
        }
    };
}
verdict_quantities!(verdict_numbers);

impl WireMachine {
    /// The message for this machine, without head.
    ///
    /// # Errors
    /// A name is too long for the wire.
    pub fn new(machine: &Machine, session: u64) -> Result<Self> {
        let limits = machine.limits();
        let (wheels, edges) = match machine.supports().vary() {
            true => (&machine.supports().all[..], &[][..]),
            false => (machine.wheels(), machine.polygon().edges()),
        };
        let mut wire = Self {
            session,
            limits: [limits.notice, limits.warning, limits.limit],
            wheel_count: wheels.len() as u32,
            edge_count: edges.len() as u32,
            name: name_to_wire(machine.name())?,
            commissioned_from: [f64::NAN; MAX_JOINTS],
            commissioned_to: [f64::NAN; MAX_JOINTS],
            ..Self::blank()
        };
        for (name, wheel) in wire.wheel_names.iter_mut().zip(wheels) {
            *name = name_to_wire(&wheel.name.to_lowercase())?;
        }
        // A joint beyond them, or with a longer name, is named by its number.
        wire.joint_count = machine.joints().len().min(MAX_JOINTS) as u32;
        for (name, joint) in wire.joint_names.iter_mut().zip(machine.joints()) {
            *name = name_to_wire(&joint.name).unwrap_or([0; NAME_BYTES]);
        }
        let sliding = (0..machine.joints().len()).filter(|&joint| machine.joint_slides(joint));
        let sliding = sliding.filter(|&joint| joint < MAX_JOINTS);
        wire.sliding_joints = sliding.fold(0, |bits, joint| bits | 1 << joint);
        let sensors = machine.load_sensors();
        wire.load_sensor_count = sensors.len().min(MAX_LOAD_SENSORS) as u32;
        for (name, sensor) in wire.load_sensor_names.iter_mut().zip(sensors) {
            *name = name_to_wire(&sensor.name).unwrap_or([0; NAME_BYTES]);
        }
        let forces = machine.arm_forces();
        wire.arm_force_count = forces.len().min(MAX_ARM_FORCES) as u32;
        for (name, force) in wire.arm_force_names.iter_mut().zip(forces) {
            let linkage = &machine.linkages()[force.linkage].name;
            *name = name_to_wire(&linkage.to_lowercase()).unwrap_or([0; NAME_BYTES]);
        }
        for (name, edge) in wire.edge_names.iter_mut().zip(edges) {
            *name = name_to_wire(&edge.name)?;
        }
        Ok(wire)
    }
}

impl WireMachine {
    /// Adds the signals that the session begins by doubting, and the positions with which its first ones are compared.
    #[must_use]
    pub fn inheriting(mut self, from: &Inherited) -> Self {
        let Inherited { doubts, positions } = from;
        self.doubted_count = doubts.len().min(MAX_JOINTS) as u32;
        for (place, doubt) in doubts.iter().take(MAX_JOINTS).enumerate() {
            self.doubted_signals[place] = doubt.signal.number();
            self.doubted_by[place] = doubt.by;
            self.doubted_moved[place] = doubt.moved;
        }
        self.known_count = positions.len().min(MAX_JOINTS) as u32;
        for (place, at) in positions.iter().take(MAX_JOINTS).enumerate() {
            self.known_joints[place] = at.joint as u32;
            self.known_stamps_us[place] = (at.stamp_ns / 1000) as f64;
            self.known_positions[place] = at.position;
        }
        self
    }

    /// Adds the positions at which a commissioning has proven the joints.
    #[must_use]
    pub fn commissioned(mut self, commissioned: &Commissioned) -> Self {
        let ends = self
            .commissioned_from
            .iter_mut()
            .zip(&mut self.commissioned_to);
        for (joint, (from, to)) in ends.enumerate() {
            [*from, *to] = commissioned.range(joint).unwrap_or([f64::NAN; 2]);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use tipwatch_mechanics::machine::{LogFacts, MachineSpec};

    use super::*;

    #[test]
    fn every_number_on_the_wire_is_in_the_table() {
        let numbers = WireVerdict::FIELDS.iter().filter(|f| f.c_type == "double");
        // those are of no row of the table: they are extrapolated
        let is_ahead = |name: &str| name == "time_to_lift_off_s" || name.starts_with("predicted_");
        // nor those: they explain two seconds of rows, or are part of the state
        let is_mass = |name: &str| name.starts_with("unstated_") || name.starts_with("payload_");
        for field in numbers.filter(|field| !is_ahead(field.name) && !is_mass(field.name)) {
            let doc = field.doc.join("");
            let mut kinds = Quantity::KINDS.iter().filter(|kind| {
                let stem = kind.pattern.replace("_{wheel}", "").replace("_{edge}", "");
                let is_cause = field.name == "causes" && kind.variant == "Contribution";
                (stem == field.name || is_cause) && doc.contains(kind.meaning)
            });
            assert!(kinds.next().is_some(), "{}: {doc}", field.name);
        }
    }

    #[test]
    fn documented_causes_are_those_of_the_message() {
        let mut fields = WireVerdict::FIELDS.iter();
        let causes = fields.find(|field| field.name == "causes").unwrap();
        let names = Contribution::ALL.map(Contribution::name).join(" ");
        let doc = causes.doc.join(" ").replace([',', '.'], " ");
        let doc: Vec<_> = doc.split_whitespace().collect();
        assert!(doc.join(" ").ends_with(&names), "{doc:?}");
    }

    #[test]
    fn supports_without_reference_loads_are_known_and_the_reason_is_told() {
        let toml = include_str!("../../../tests/data/crane.toml");
        let urdf = include_str!("../../../tests/data/crane.urdf");
        let spec = MachineSpec::from_toml(toml, "crane.toml").unwrap();
        let machine = spec.check(urdf, "crane.urdf", LogFacts::default()).unwrap();
        let supports = machine.supports();
        let feet = ["OFL", "OFR", "ORL", "ORR"].map(|name| supports.named(name)[0]);
        let mut on = machine.standing_on(&feet).unwrap();
        let mut verdict = WireVerdict::unknown();
        verdict.set_ground(supports.all.len(), Ok(&on));
        assert_eq!(verdict.ground_gap(), Some(("no_reference_loads", None)));
        assert!(verdict.is_standing(feet[0].index()));
        on.set_reference_loads().unwrap();
        verdict.set_ground(supports.all.len(), Ok(&on));
        assert_eq!(verdict.ground_gap(), None);
    }

    #[test]
    fn every_quantity_has_its_number() {
        let mut verdict = WireVerdict::unknown();
        let mut next = 0.0;
        let four = |wheel| (wheel < 4).then_some(wheel);
        verdict.each_number_mut(four, 4, |_, number| {
            next += 1.0;
            *number = next;
        });
        let mut found = Vec::new();
        WireVerdict::each_quantity(4, 4, |q| found.push(verdict.number(q).unwrap()));
        assert_eq!(
            found,
            (1..=found.len()).map(|n| n as f64).collect::<Vec<_>>()
        );
        assert_eq!(found.len() as f64, next);
    }
}
