//! The machine file of a data sheet with the signals that a log of the machine adds, and a person's statements about them.

use std::path::Path;

use anyhow::Result;
use tipwatch_datasheet::{FromLog, Machine};
use tipwatch_ingest::{Log, SensorKind};
use tipwatch_mechanics::machine::Outline;

use super::arm;
use super::can::CanMessages;
use super::draft::{Draft, Stated};
use super::guesses::Guesses;
use super::imu::{self, ImuSection};
use super::joint_lines::{doubted, write_joints};
use super::signals::Topics;
use super::text::Text;
use super::urdf::Urdf;
use super::write_options::WriteOptions;
use crate::setup::inspect::Described;

/// The URDF of a machine from its sheet, beside its machine file.
pub const URDF: &str = "machine.urdf";

/// A draft of the machine file of a sheet for a log, to be written to `out`. Joints that the sheet holds still are left as
/// they are unless the log has them.
///
/// # Errors
/// The log cannot be read.
pub fn draft_of_sheet(
    machine: Machine,
    log: &Path,
    out: &Path,
    databases: &[Described],
) -> Result<Draft> {
    let mut log = Log::open(log)?;
    let can = CanMessages::decode(&mut log, databases, out)?;
    let topics = Topics::find(&log, can)?;
    let text = machine.urdf();
    let outline = Outline::read(&text, URDF)?;
    let mut guesses = Guesses::of(outline, &topics, &log);
    guesses.leave_to_sheet(&machine.constant_joints());
    guesses.tool = machine.tool().map(|tool| arm::Guess {
        link: tool.into(),
        why: "the sheet's".into(),
    });
    let has_samples = match topics.imu() {
        Some(topic) => imu::mean_of(&log, topic, SensorKind::Imu)?.is_some(),
        None => topics.can.has_imu(),
    };
    Ok(Draft {
        urdf: Some(Urdf {
            text,
            name: URDF.into(),
            line: None,
        }),
        topics,
        guesses: Some(guesses),
        // a sheet does not say where it is
        imu: ImuSection {
            is_doubtful: has_samples,
            has_samples,
            ..ImuSection::default()
        },
        options: WriteOptions::default(),
        stated: Stated::default(),
        of_sheet: Some(machine),
        out: out.into(),
        log,
    })
}

/// The text of the machine file of a sheet with these guesses, beside a URDF of this name.
pub(super) fn rendered(
    draft: &Draft,
    machine: &Machine,
    guesses: Option<&Guesses>,
    urdf: &str,
) -> String {
    let mut text = Text::default();
    draft.topics.write(&draft.log, &mut text);
    if let Some(guesses) = guesses {
        write_joints(&mut text, guesses);
    }
    draft.topics.can.write_weights(&mut text, machine.tool());
    machine.machine_file(
        urdf,
        Some(FromLog {
            signals: &text.finish(),
            unconfirmed: &guesses.map(doubted).unwrap_or_default(),
            imu_xyz: draft.stated.imu_xyz,
            imu_rpy: draft.stated.imu_rpy,
            payload: draft.stated.payload,
        }),
    )
}
