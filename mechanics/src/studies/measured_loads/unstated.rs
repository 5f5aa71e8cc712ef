//! The load that would explain that more is measured than computed: mass, and where it acts.

use serde::Serialize;
use tipwatch_language::{say, word};

use super::rows::shows;
use super::singles::{Acts, PointForce};
use super::total_row::TotalRow;

/// A load that the machine file does not state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UnstatedLoad {
    /// Mass of the load (kg); negative for less than the stated mass.
    pub mass_kg: f64,
    /// Standard deviation of its mass (kg).
    pub mass_sigma_kg: f64,
    /// Place of the load, forward and to the left of the base frame's origin (m); null unless the load of every support on the
    /// ground is measured by itself.
    pub at_m: Option<[f64; 2]>,
    /// Standard deviation of either (m), motion included.
    pub at_sigma_m: Option<[f64; 2]>,
    /// Whether the load acts where the arm carries loads: a payload.
    pub at_tool: bool,
    /// Whether the load acts at a support: then a wrong sensor of that support explains it as well.
    pub at_support: bool,
    /// Whether the loads of these rows follow the measured loads of all supports.
    pub followed: bool,
}

/// Places this near to each other (standard deviations) are one.
pub(super) const SAME_PLACE: f64 = 3.0;

impl UnstatedLoad {
    /// The mean over some rows, whose sensors are `exchanged` or not; `None` without any, and where no load explains it.
    #[must_use]
    pub fn of(rows: &[&TotalRow], exchanged: bool) -> Option<Self> {
        let count = rows.len() as f64;
        let mean = |value: &dyn Fn(&TotalRow) -> f64| -> f64 {
            rows.iter().map(|row| value(row)).sum::<f64>() / count
        };
        let acts: Option<Vec<&Acts>> = rows.iter().map(|row| row.acts.as_ref()).collect();
        // in the mean over the rows, for no single one decides
        let is_near =
            |misfits: &mut dyn Iterator<Item = f64>| misfits.sum::<f64>() / count < SAME_PLACE;
        let on_tool: Option<Vec<PointForce>> =
            (acts.as_ref()).and_then(|acts| acts.iter().map(|acts| acts.on_tool).collect());
        let on_tool = on_tool.filter(|of| is_near(&mut of.iter().map(|force| force.misfit)));
        let at_support = (acts.as_ref())
            .is_some_and(|acts| is_near(&mut acts.iter().map(|acts| acts.from_support)));
        let (difference, sigma_of_sum) = (mean(&|row| row.difference), mean(&|row| row.sigma));
        let is_in_sum = shows(difference, sigma_of_sum);
        if !(on_tool.is_some() || at_support || is_in_sum) {
            return None;
        }
        let (force, sigma) = match &on_tool {
            // a known place: the moments weigh it, too
            Some(of) => (
                of.iter().map(|force| force.force).sum::<f64>() / count,
                of.iter().map(|force| force.sigma).sum::<f64>() / count,
            ),
            None => (difference, sigma_of_sum),
        };
        let gravity = mean(&|row| row.gravity);
        let mass_kg = force / gravity;
        if !mass_kg.is_finite() {
            return None;
        }
        let along = |axis: usize| {
            let acts = acts.as_ref()?;
            let of = |value: &dyn Fn(&Acts) -> f64| -> f64 {
                acts.iter().map(|acts| value(acts)).sum::<f64>() / count
            };
            let at = of(&|acts| acts.at[axis]);
            let spread = of(&|acts| (acts.at[axis] - at).powi(2)).sqrt();
            Some((at, of(&|acts| acts.sigma[axis]).hypot(spread)))
        };
        let all_forces = |acts: &Vec<&Acts>| acts.iter().all(|acts| acts.can_be_followed);
        let at = along(0).zip(along(1));
        let at = at.filter(|(x, y)| (x.0 + x.1 + y.0 + y.1).is_finite());
        Some(Self {
            mass_kg,
            mass_sigma_kg: sigma / gravity,
            at_m: at.map(|(x, y)| [x.0, y.0]),
            at_sigma_m: at.map(|(x, y)| [x.1, y.1]),
            at_tool: on_tool.is_some(),
            at_support,
            // less than is computed is a stated load that is not there, or dead sensors
            followed: !at_support
                && !exchanged
                && (on_tool.is_some() || is_in_sum && difference > 0.0)
                && acts.as_ref().is_some_and(all_forces),
        })
    }
}

impl std::fmt::Display for UnstatedLoad {
    /// "a load of 2500 ± 180 kg that is not stated, at x = 3.10 ± 0.10 m, y = 0.02 ± 0.08 m, would explain it": with two
    /// standard deviations, as everything that is said to people
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (mass, band) = (self.mass_kg.abs(), 2.0 * self.mass_sigma_kg);
        formatter.write_str(&match self.mass_kg < 0.0 {
            true => say!("{mass:.0} ± {band:.0} kg less than stated"),
            false => say!("a load of {mass:.0} ± {band:.0} kg that is not stated"),
        })?;
        // the mean place of a load that the arm moves is nowhere
        if let (false, Some([x, y]), Some(sigma)) = (self.at_tool, self.at_m, self.at_sigma_m) {
            let [sx, sy] = sigma.map(|sigma| 2.0 * sigma);
            // plus zero: no sign before zero
            let [x, y] = [x, y].map(|at| (100.0 * at).round() / 100.0 + 0.0);
            let at = say!(", at x = {x:.2} ± {sx:.2} m, y = {y:.2} ± {sy:.2} m,");
            formatter.write_str(&at)?;
        }
        formatter.write_str(match (self.at_tool, self.at_support) {
            (_, true) => word!(" would explain it, and so would a wrong sensor of the support where it acts"),
            (true, false) if self.mass_kg < 0.0 => word!(
                " would explain it: it acts where the arm carries loads. Correct the payload or the tool in the machine file"
            ),
            (true, false) if !self.followed => {
                word!(" would explain it: it acts where the arm carries loads")
            }
            (true, false) => word!(
                " would explain it: it acts where the arm carries loads. State it as a payload in the machine file"
            ),
            (false, false) => word!(" would explain it"),
        })
    }
}
