//! The log again with its suspension moved otherwise: locked, as recorded, or controlled.
//!
//! Arm, drive and the way of the wheels over the ground stay as they were recorded; where the platform is above
//! its wheels, what its wheels carry and what its actuators need follow from the rods. See [`CAVEATS`] for what
//! that cannot show.

mod best;
mod simulate;
mod summary;
mod table;
mod track;

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use serde::Serialize;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{ControlMode, Suspension, SuspensionControl};

pub use self::best::Best;
pub use self::summary::Summary;
pub(crate) use self::table::rod_names;
pub use self::track::Track;
use crate::analysis::Analysis;
use crate::options::Options;
use crate::{parquet, report, run};

/// How the suspension moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum SuspensionMode {
    /// The rods stay where they are in the first valid row.
    Locked,
    /// As the log has it.
    Recorded,
    /// The second paper's problem, one step ahead.
    Literal,
    /// Where a planned move leads.
    LookAhead,
}

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WhatIfOptions {
    /// How the suspension moves.
    pub suspension: SuspensionMode,
    /// Length of a step of the control (s); by the machine file where `None`.
    pub step_s: Option<f64>,
}

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

    /// Writes `whatif.parquet`, `summary.json` and `report.html` into a folder, which is made if it is not
    /// there.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot be created", folder.display()))?;
        let mut table = table::table(self)?;
        let path = folder.join("whatif.parquet");
        parquet::write(&mut table, &self.analysis.provenance, &path)?;
        let summary = serde_json::to_string_pretty(&Summary::of(self))?;
        for (name, text) in [
            ("summary.json", summary),
            ("report.html", report::render_what_if(self)),
        ] {
            let path = folder.join(name);
            fs::write(&path, text)
                .with_context(|| format!("{}: cannot be written", path.display()))?;
        }
        Ok(())
    }
}
