//! Names of wheels and edges, and of the numbers of a verdict.

use anyhow::Result;

use crate::wire::session::name_from_wire;
use crate::wire::topics::{CAUSES, MAX_PLACES, WireMachine, WireVerdict};

/// Names of a machine's wheels and edges, in lower case and in the order of the numbers.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Names {
    /// Name of the machine.
    pub machine: String,
    /// Names of its wheels.
    pub wheels: Vec<String>,
    /// Names of the edges of its support polygon.
    pub edges: Vec<String>,
}

impl TryFrom<&WireMachine> for Names {
    type Error = anyhow::Error;

    fn try_from(wire: &WireMachine) -> Result<Self> {
        let listed = |names: &[[u8; 64]], count: u32| -> Result<Vec<String>> {
            let count = (count as usize).min(MAX_PLACES);
            names[..count].iter().map(name_from_wire).collect()
        };
        Ok(Self {
            machine: name_from_wire(&wire.name)?,
            wheels: listed(&wire.wheel_names, wire.wheel_count)?,
            edges: listed(&wire.edge_names, wire.edge_count)?,
        })
    }
}

/// Names of the load contributions, in the order of [`WireVerdict::causes`].
#[must_use]
pub fn causes() -> [&'static str; CAUSES] {
    tipwatch_mechanics::Contribution::ALL.map(tipwatch_mechanics::Contribution::name)
}

impl Names {
    /// Calls `each` with every number of a verdict and the name of its column in `samples.parquet`.
    pub fn each_number(&self, verdict: &WireVerdict, mut each: impl FnMut(&str, f64)) {
        let single = [
            ("utilisation", verdict.utilisation),
            ("time_to_lift_off", verdict.time_to_lift_off_s),
            ("normal_force", verdict.normal_force),
            ("zmp_x", verdict.zmp_x),
            ("zmp_y", verdict.zmp_y),
            ("zmp_margin", verdict.zmp_margin),
            ("ltr", verdict.ltr),
            ("sigma", verdict.sigma),
            ("spread", verdict.spread),
        ];
        for (name, number) in single {
            each(name, number);
        }
        let by_wheel = [
            ("load_", "", &verdict.load),
            ("otf_", "", &verdict.otf),
            ("load_", "_sigma", &verdict.load_sigma),
            ("otf_", "_sigma", &verdict.otf_sigma),
            ("load_", "_min", &verdict.load_min),
            ("load_", "_max", &verdict.load_max),
        ];
        for (before, after, numbers) in by_wheel {
            for (wheel, &number) in self.wheels.iter().zip(numbers) {
                each(&format!("{before}{wheel}{after}"), number);
            }
        }
        let by_edge = [
            ("itom_full_", &verdict.itom_full),
            ("itom_", &verdict.itom),
            ("tom_", &verdict.tom),
            ("mhs_", &verdict.mhs),
            ("force_angle_", &verdict.force_angle),
            ("stability_angle_", &verdict.stability_angle),
        ];
        for (before, numbers) in by_edge {
            for (edge, &number) in self.edges.iter().zip(numbers) {
                each(&format!("{before}{edge}"), number);
            }
        }
        for (cause, numbers) in causes().into_iter().zip(&verdict.causes) {
            for (wheel, &number) in self.wheels.iter().zip(numbers) {
                each(&format!("cause_{cause}_{wheel}"), number);
            }
        }
    }
}
