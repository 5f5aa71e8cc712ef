//! A replay: the log as recorded, with another suspension motion, and with the best possible one.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{ControlMode, Suspension, SuspensionControl};

use super::best::{self, Best};
use super::mode::{SuspensionMode, WhatIfOptions};
use super::simulate;
use super::track::Track;
use crate::analysis::Analysis;
use crate::analysis::run;
use crate::base::options::Options;

/// A replay and what it is compared with.
#[derive(Debug)]
pub struct WhatIf {
    /// The log as recorded.
    pub analysis: Analysis,
    /// The options used.
    pub options: WhatIfOptions,
    /// The suspension and its control.
    pub suspension: Suspension,
    /// With the rods locked.
    pub fixed: Track,
    /// With the requested rod motion.
    pub moved: Track,
    /// The best static posture at each sample.
    pub best: Best,
}

/// What a replay cannot show.
pub const CAVEATS: [&str; 5] = [
    "The path of the wheels, the arm motion and the operator's commands are as recorded. A machine with other loads \
     would have been driven differently and would have slipped differently.",
    "All wheels stay on one plane that moves as recorded. Lifting wheels and uneven ground under a displaced wheel are \
     not simulated; with a wheel off the ground the loads follow from equilibrium alone.",
    "Tyres and frame are rigid. Actuator loads are computed, not measured, with the inertia that moves when all rods move alike.",
    "The control uses the same model as the computation of the loads. The effect of wrong parameters or signals is not included.",
    "The load split between the diagonals follows the split rule of the machine file, whatever the measured pressures.",
];

/// Replays a log.
///
/// # Errors
/// The log cannot be analysed, or the machine has no suspension that can move as requested.
pub fn what_if(
    log: &Path,
    file: &MachineFile,
    analysis_options: Options,
    options: WhatIfOptions,
    progress: &mut dyn FnMut(u64),
) -> Result<WhatIf> {
    let analysis = run::analyse(log, file, analysis_options, progress)?;
    let machine = &analysis.machine;
    let mut suspension = machine.suspension().cloned().ok_or_else(|| {
        anyhow!(
            "{}: expected [suspension] with the linkages that move the platform, found none",
            file.path.display()
        )
    })?;
    suspension.control = control(&suspension.control, options);
    let fixed = simulate::given(&analysis, SuspensionMode::Locked)?;
    let moved = match options.suspension {
        SuspensionMode::Locked | SuspensionMode::Recorded => {
            simulate::given(&analysis, options.suspension)?
        }
        SuspensionMode::Literal | SuspensionMode::LookAhead => {
            simulate::controlled(&analysis, &suspension)
                .with_context(|| format!("{}", file.path.display()))?
        }
    };
    let best = best::postures(&analysis)?;
    Ok(WhatIf {
        analysis,
        options,
        suspension,
        fixed,
        moved,
        best,
    })
}

fn control(stated: &SuspensionControl, options: WhatIfOptions) -> SuspensionControl {
    SuspensionControl {
        mode: match options.suspension {
            SuspensionMode::Literal => ControlMode::OneStep,
            _ => ControlMode::LookAhead,
        },
        rate: options.step_s.map_or(stated.rate, |step| 1.0 / step),
        ..stated.clone()
    }
}

impl WhatIf {
    /// Achieved reduction of the mean load spread, as a share of the reduction by the best posture;
    /// `None` if that reduces nothing.
    #[must_use]
    pub fn gain_share(&self) -> Option<f64> {
        let mean = |values: &[f64]| {
            let known = || self.best.rows.iter().map(|&row| values[row]);
            let sum: f64 = known().filter(|v| v.is_finite()).sum();
            sum / known().filter(|v| v.is_finite()).count() as f64
        };
        let fixed = mean(&self.fixed.spread);
        let best = self.best.mean_spread();
        let share = (fixed - mean(&self.moved.spread)) / (fixed - best);
        (fixed > best && share.is_finite()).then_some(share)
    }
}
