//! A log replayed with another motion of its suspension.

use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use tipwatch_binding::MachineFile;
use tipwatch_language::message;
use tipwatch_mechanics::machine::{ControlMode, SuspensionControl};
use tipwatch_suspension::replay::{Comparison, RecordedRows, SuspensionMotion};

use super::mode::{SuspensionMode, WhatIfOptions};
use crate::analysis::Analysis;
use crate::analysis::run;
use crate::base::options::Options;

/// A replay and the motions it is compared with.
#[derive(Debug)]
pub struct WhatIf {
    /// The log as recorded.
    pub analysis: Analysis,
    /// The options used.
    pub options: WhatIfOptions,
    /// The suspension locked, moved as requested, and in its best posture.
    pub comparison: Comparison,
}

/// Limits of a replay, as sentences.
pub const CAVEATS: [&str; 5] = [
    message!(
        "The path of the wheels, the arm motion and the operator's commands are as recorded. With other wheel loads the \
     operator would have driven differently and the wheels would have slipped differently."
    ),
    message!(
        "All wheels stay on one plane that moves as recorded. Lifting wheels are not simulated: with a wheel off the \
     ground the loads follow from equilibrium alone. The replay does not model uneven ground under a wheel that the \
     suspension displaces."
    ),
    message!(
        "Tyres and frame are rigid. Actuator loads are computed, not measured. The moving mass of an actuator is that \
     for all rods moving alike."
    ),
    message!(
        "The controller and the load computation use the same model. Errors of parameters and signals therefore have no \
     effect on the control."
    ),
    message!(
        "The load split between the diagonals follows the split rule of the machine file. Measured pressures are not used."
    ),
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
    if let Some(gross) = analysis.gross_inputs.first() {
        bail!(
            "{}: expected plausible inputs. {}. Likely correction: {}",
            log.display(),
            gross.headline,
            gross.fix
        );
    }
    let (machine, rows) = (&analysis.machine, &analysis.rows);
    let suspension = machine.suspension().ok_or_else(|| {
        anyhow!(
            "{}: expected [suspension] with the linkages that move the platform, found none",
            file.path.display()
        )
    })?;
    let recorded = RecordedRows {
        times_ns: &rows.times_ns,
        reasons: &rows.reasons,
        states: &rows.whole().states,
    };
    let motion = motion(&suspension.control, options);
    let comparison = Comparison::of(machine, recorded, &motion)
        .with_context(|| file.path.display().to_string())?;
    Ok(WhatIf {
        analysis,
        options,
        comparison,
    })
}

/// The requested motion; its control is that of the machine file with the requested mode and period.
fn motion(stated: &SuspensionControl, options: WhatIfOptions) -> SuspensionMotion {
    let controlled = |mode| {
        SuspensionMotion::Controlled(SuspensionControl {
            mode,
            rate: options.step_s.map_or(stated.rate, |step| 1.0 / step),
            ..stated.clone()
        })
    };
    match options.suspension {
        SuspensionMode::Locked => SuspensionMotion::Locked,
        SuspensionMode::Recorded => SuspensionMotion::Recorded,
        SuspensionMode::Literal => controlled(ControlMode::OneStep),
        SuspensionMode::LookAhead => controlled(ControlMode::LookAhead),
    }
}
