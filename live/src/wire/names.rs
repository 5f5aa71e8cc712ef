//! Names of wheels and edges, and of the numbers of a verdict.

use anyhow::Result;
use tipwatch_mechanics::machine::{Proof, Proofs};
use tipwatch_mechanics::prediction::{
    Law, PREDICTED_AGE, PREDICTED_OTF, PredictedNumber, predicted_column,
};
use tipwatch_mechanics::{ColumnNames, Quantity, RowColumn};

use crate::wire::session::name_from_wire;
use crate::wire::topics::{WireMachine, WireVerdict};

/// Names of a machine's wheels and edges, in lower case and in the order of the numbers.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Names {
    /// Name of the machine.
    pub machine: String,
    /// Names of its wheels.
    pub wheels: Vec<String>,
    /// Names of the edges of its support polygon.
    pub edges: Vec<String>,
    /// Names of its joints, as in the URDF.
    pub joints: Vec<String>,
    /// Names of its load sensors.
    pub load_sensors: Vec<String>,
    /// Names of the linkages with a measured force of the arm, in lower case.
    pub arm_forces: Vec<String>,
    /// Joint positions at which a commissioning has proven each joint, as text; empty where it has not.
    pub commissioned: Vec<String>,
}

impl TryFrom<&WireMachine> for Names {
    type Error = anyhow::Error;

    fn try_from(wire: &WireMachine) -> Result<Self> {
        let listed = |names: &[[u8; 64]], count: u32| -> Result<Vec<String>> {
            let count = (count as usize).min(names.len());
            names[..count].iter().map(name_from_wire).collect()
        };
        let ends = wire.commissioned_from.iter().zip(&wire.commissioned_to);
        let commissioned = |(joint, (from, to)): (usize, (&f64, &f64))| match from <= to {
            true => {
                let unit = ["rad", "m"][usize::from(wire.sliding_joints >> joint & 1 == 1)];
                format!("{from:.3} to {to:.3} {unit}")
            }
            false => String::new(),
        };
        Ok(Self {
            commissioned: ends.enumerate().map(commissioned).collect(),
            machine: name_from_wire(&wire.name)?,
            wheels: listed(&wire.wheel_names, wire.wheel_count)?,
            edges: listed(&wire.edge_names, wire.edge_count)?,
            joints: listed(&wire.joint_names, wire.joint_count)?,
            load_sensors: listed(&wire.load_sensor_names, wire.load_sensor_count)?,
            arm_forces: listed(&wire.arm_force_names, wire.arm_force_count)?,
        })
    }
}

impl Names {
    /// Name of a joint by its index; its number where there is none.
    #[must_use]
    pub fn joint(&self, index: usize) -> String {
        let name = self.joints.get(index).filter(|name| !name.is_empty());
        name.map_or_else(|| index.to_string(), String::clone)
    }

    /// Returns the positions at which a commissioning has proven a joint, as text; `None` where it has not.
    fn commissioned_at(&self, proof: Proof) -> Option<&str> {
        let Proof::Joint(joint) = proof else {
            return None;
        };
        let text = self.commissioned.get(joint)?.as_str();
        (!text.is_empty()).then_some(text)
    }

    /// Returns what a person can do to prove a signal; of a joint also the positions at which it is commissioned.
    #[must_use]
    pub fn way(&self, proof: Proof) -> String {
        let way = proof.way(|joint| self.joint(joint));
        match self.commissioned_at(proof) {
            Some(text) => format!("{way}; it is commissioned at {text}"),
            None => way,
        }
    }

    /// Names of what is not proven.
    #[must_use]
    pub fn unproven(&self, verdict: &WireVerdict) -> Vec<String> {
        self.named(verdict.verdict().unproven)
    }

    /// Returns what a person can do to prove each signal of [`Self::unproven`], in the same order.
    #[must_use]
    pub fn proven_by(&self, verdict: &WireVerdict) -> Vec<String> {
        let unproven = verdict.verdict().unproven.iter(self.joints.len());
        unproven.map(|proof| self.way(proof)).collect()
    }

    /// Returns the signals that are not proven, with what would prove them, as text: joints together. Empty if all are proven.
    #[must_use]
    pub fn missing_proofs_text(&self, verdict: &WireVerdict) -> String {
        let unproven = verdict.verdict().unproven.iter(self.joints.len());
        let (joints, others): (Vec<Proof>, Vec<Proof>) =
            unproven.partition(|proof| matches!(proof, Proof::Joint(_)));
        let name = |proof: &Proof| proof.name(|joint| self.joint(joint));
        let with_way = |proof: &Proof| format!("{} ({})", name(proof), self.way(*proof));
        let mut texts: Vec<String> = others.iter().map(with_way).collect();
        match joints.as_slice() {
            [] => {}
            [joint] => texts.push(with_way(joint)),
            [first, ..] => {
                let with_place = |proof: &Proof| match self.commissioned_at(*proof) {
                    Some(text) => format!("{} (commissioned at {text})", name(proof)),
                    None => name(proof),
                };
                let names: Vec<String> = joints.iter().map(with_place).collect();
                let way = first.way(|_| "each of these".into());
                texts.push(format!("{} ({way})", names.join(", ")));
            }
        }
        texts.join(", ")
    }

    /// Names of the signals that are doubted since they failed visibly.
    #[must_use]
    pub fn doubted(&self, verdict: &WireVerdict) -> Vec<String> {
        self.named(Proofs::from_bits(verdict.doubted))
    }

    fn named(&self, signals: Proofs) -> Vec<String> {
        let signals = signals.iter(self.joints.len());
        let names = signals.map(|signal| signal.name(|joint| self.joint(joint)));
        names.collect()
    }

    /// Names of the joints that are predicted to move as a controller asks.
    #[must_use]
    pub fn commanded(&self, verdict: &WireVerdict) -> Vec<String> {
        let joints = 0..self.joints.len().min(u64::BITS as usize);
        let commanded = joints.filter(|joint| verdict.commanded >> joint & 1 == 1);
        commanded.map(|joint| self.joint(joint)).collect()
    }

    /// Names of the wheels that are on the ground as supports; `None` while these are unknown.
    #[must_use]
    pub fn standing(&self, verdict: &WireVerdict) -> Option<Vec<&str>> {
        let is_on = |(wheel, _): &(usize, &String)| verdict.is_standing(*wheel);
        let wheels = self.wheels.iter().enumerate().filter(is_on);
        (verdict.standing != 0).then(|| wheels.map(|(_, name)| name.as_str()).collect())
    }

    /// Returns the reason for which the supports on the ground, or the utilisation on them, are unknown, and its wheel, if it is about
    /// one; `None` if they are known.
    #[must_use]
    pub fn ground_gap(&self, verdict: &WireVerdict) -> Option<(&'static str, Option<&str>)> {
        let (gap, wheel) = verdict.ground_gap()?;
        let name = wheel.and_then(|wheel| self.wheels.get(wheel));
        Some((gap, name.map(String::as_str)))
    }

    /// Returns that reason and wheel as text.
    #[must_use]
    pub fn ground_gap_text(&self, verdict: &WireVerdict) -> Option<String> {
        let (gap, wheel) = self.ground_gap(verdict)?;
        Some(match wheel {
            Some(wheel) => format!("{gap} {wheel}"),
            None => gap.to_owned(),
        })
    }

    /// The measured loads that contradict the computed ones: the sensor that is furthest off, and "total".
    #[must_use]
    pub fn doubted_loads(&self, verdict: &WireVerdict) -> Vec<String> {
        let sensor = verdict.doubted_load_sensor();
        let sensor = sensor.map(|sensor| match self.load_sensors.get(sensor) {
            Some(name) if !name.is_empty() => name.clone(),
            _ => sensor.to_string(),
        });
        let total = (verdict.load_doubt & 2 != 0).then(|| "total".to_owned());
        sensor.into_iter().chain(total).collect()
    }

    /// Returns the possible explanations of the contradicted total load: `unstated_load`, `load_on_tool`, `support_sensor`,
    /// `exchanged_sensors`.
    #[must_use]
    pub fn load_explanations(&self, verdict: &WireVerdict) -> Vec<&'static str> {
        let bits = verdict.load_explanation;
        let has = |bit: u32| bits >> bit & 1 == 1;
        let all = [
            (has(0) && !has(1), "unstated_load"),
            (has(1), "load_on_tool"),
            (has(2), "support_sensor"),
            (has(3), "exchanged_sensors"),
        ];
        let found = all.into_iter().filter(|(is_there, _)| *is_there);
        found.map(|(_, name)| name).collect()
    }

    /// Names of the supports whose sensors may be exchanged.
    #[must_use]
    pub fn exchanged_sensors(&self, verdict: &WireVerdict) -> Vec<&str> {
        let wheels = self.wheels.iter().enumerate();
        let has = |wheel: usize| verdict.exchanged_sensors >> wheel & 1 == 1;
        wheels
            .filter(|(wheel, _)| has(*wheel))
            .map(|(_, name)| name.as_str())
            .collect()
    }

    /// The same as text, with the mass of the load that is not stated; empty if no measured load is doubted.
    #[must_use]
    pub fn load_doubt_text(&self, verdict: &WireVerdict) -> String {
        let doubted = self.doubted_loads(verdict).join(", ");
        let mut text = match doubted.is_empty() {
            true => return doubted,
            false => format!("measured loads doubted: {doubted}"),
        };
        let explained = self.load_explanations(verdict).join(" or ");
        if !explained.is_empty() {
            text += &format!(" ({explained}");
            if verdict.unstated_mass_kg.is_finite() {
                let (mass, sigma) = (verdict.unstated_mass_kg, verdict.unstated_mass_sigma_kg);
                text += &format!(", {mass:.0} ± {:.0} kg", 2.0 * sigma);
            }
            let exchanged = self.exchanged_sensors(verdict);
            if !exchanged.is_empty() {
                text += &format!(", {}", exchanged.join(" and "));
            }
            text.push(')');
        }
        text
    }

    /// Returns the forces of the arm that contradict what masses and motion require.
    #[must_use]
    pub fn doubted_forces(&self, verdict: &WireVerdict) -> Vec<String> {
        self.forces(verdict.doubted_forces)
    }

    /// Returns the forces of the arm that repeat one value although the required one changes.
    #[must_use]
    pub fn frozen_forces(&self, verdict: &WireVerdict) -> Vec<String> {
        self.forces(verdict.frozen_forces)
    }

    /// The names of forces, of which `bits` are set; the number of one without a name.
    fn forces(&self, bits: u32) -> Vec<String> {
        let set = (0..u32::BITS as usize).filter(|force| bits >> force & 1 == 1);
        let name = |force: usize| match self.arm_forces.get(force) {
            Some(name) if !name.is_empty() => name.clone(),
            _ => force.to_string(),
        };
        set.map(name).collect()
    }

    /// Returns both as text; empty if there are none.
    #[must_use]
    pub fn force_doubt_text(&self, verdict: &WireVerdict) -> String {
        let told = [
            (
                "measured forces doubted, or their arm rests on something",
                self.doubted_forces(verdict),
            ),
            ("measured forces frozen", self.frozen_forces(verdict)),
        ];
        let told = told.into_iter().filter(|(_, names)| !names.is_empty());
        let told: Vec<String> = told
            .map(|(what, names)| format!("{what}: {}", names.join(", ")))
            .collect();
        told.join("  ")
    }

    /// The mass of the payloads that is known row by row, as text; empty where there is none.
    #[must_use]
    pub fn payload_text(&self, verdict: &WireVerdict) -> String {
        let (mass, sigma) = (verdict.payload_mass_kg, verdict.payload_mass_sigma_kg);
        match mass.is_finite() {
            true => format!("payload {mass:.0} ± {:.0} kg", 2.0 * sigma),
            false => String::new(),
        }
    }

    /// The signal of this name; of a joint, its own name suffices.
    #[must_use]
    pub fn signal(&self, name: &str) -> Option<Proof> {
        let mut signals = Proof::all(self.joints.len());
        signals.find(|signal| {
            let is_joint = |joint: usize| self.joint(joint) == name;
            matches!(signal, Proof::Joint(joint) if is_joint(*joint))
                || signal.name(|joint| self.joint(joint)) == name
        })
    }

    /// Calls `each` with every number of a verdict, in the order of [`Self::columns`].
    pub fn each_number(&self, verdict: &WireVerdict, mut each: impl FnMut(f64)) {
        WireVerdict::each_quantity(self.wheels.len(), self.edges.len(), |quantity| {
            each(verdict.number(quantity).unwrap_or(f64::NAN));
            if quantity == Quantity::Utilisation {
                each(verdict.time_to_lift_off_s);
                for law in Law::ALL {
                    for number in PredictedNumber::ALL {
                        each(verdict.predicted(number)[law as usize]);
                    }
                    let otf = &verdict.predicted_otf_min[law as usize];
                    (0..self.wheels.len()).for_each(|wheel| {
                        each(otf.get(wheel).copied().unwrap_or(f64::NAN));
                    });
                }
                each(verdict.predicted_age_s);
            }
        });
    }

    /// Names of the columns of `samples.parquet` that hold the numbers of a verdict.
    #[must_use]
    pub fn columns(&self) -> Vec<String> {
        let names = ColumnNames {
            wheels: self.wheels.clone(),
            edges: self.edges.clone(),
            ..ColumnNames::default()
        };
        let mut columns = Vec::new();
        WireVerdict::each_quantity(self.wheels.len(), self.edges.len(), |quantity| {
            columns.push(quantity.column(&names));
            if quantity == Quantity::Utilisation {
                columns.push(RowColumn::TIME_TO_LIFT_OFF.name.to_string());
                for law in Law::ALL {
                    for number in PredictedNumber::ALL {
                        columns.push(predicted_column(number.column(), law));
                    }
                    let otf = predicted_column(PREDICTED_OTF, law);
                    let of_wheels = self.wheels.iter();
                    columns.extend(of_wheels.map(|wheel| otf.replace("{wheel}", wheel)));
                }
                columns.push(PREDICTED_AGE.name.to_string());
            }
        });
        columns
    }
}
