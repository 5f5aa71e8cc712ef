//! A replay: the log as it was, its suspension moved otherwise, and the best that it could have done.

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

/// What would have been.
#[derive(Debug)]
pub struct WhatIf {
    /// The log as it was.
    pub analysis: Analysis,
    /// What was asked for.
    pub options: WhatIfOptions,
    /// The suspension and how it is steered.
    pub suspension: Suspension,
    /// With the rods locked.
    pub fixed: Track,
    /// With the rods moving as was asked for.
    pub moved: Track,
    /// The best posture of the stroke, sample by sample.
    pub best: Best,
}

/// What a replay cannot show, in plain sentences.
pub const CAVEATS: [&str; 5] = [
    "The way of the wheels over the ground, the arm's motion and the operator's commands are as recorded: a machine that feels \
     other loads would have been driven and would have slipped otherwise.",
    "All wheels are held to one plane that goes where the recorded one went; a wheel that lifts or the ground's unevenness under \
     a moved wheel are not simulated, and loads of an instant at which a wheel is off the ground are those of equilibrium alone.",
    "Tyres and frame do not vibrate; the load of an actuator is that of the model with the inertia that moves when all rods move \
     alike, not measured.",
    "The control gets the same model that computes the loads here: how wrong parameters or signals spoil it is not in these numbers.",
    "The split between the diagonals follows the split rule of the machine file, whatever pressures were measured.",
];

/// Replays a log.
///
/// # Errors
/// The log cannot be analysed, or the machine has no suspension that can be steered as asked.
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
            SuspensionMode::Literal => ControlMode::Literal,
            _ => ControlMode::LookAhead,
        },
        rate: options.step_s.map_or(stated.rate, |step| 1.0 / step),
        ..stated.clone()
    }
}

impl WhatIf {
    /// Of what the best posture would have taken off the mean spread of the loads, the share that was taken
    /// off; `None` where it would have taken off nothing.
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
