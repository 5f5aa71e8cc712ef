//! The section about signals alone, for a machine file that is made otherwise.

use std::path::Path;

use anyhow::Result;
use tipwatch_ingest::Log;
use tipwatch_mechanics::machine::Outline;

use super::can::CanMessages;
use super::guesses::Guesses;
use super::render::write_joints;
use super::signals::Topics;
use super::text::Text;
use crate::setup::inspect::Described;

/// The section `[signals]` for a log and the joints of a URDF. Joints of `constant` have a position elsewhere in the
/// machine file and are left out unless the log has them.
///
/// # Errors
/// The log cannot be read, or the text is not a URDF.
pub fn signals(
    log: &Path,
    databases: &[Described],
    out: &Path,
    urdf: &str,
    constant: &[String],
) -> Result<String> {
    let mut log = Log::open(log)?;
    let can = CanMessages::decode(&mut log, databases, out)?;
    let topics = Topics::find(&log, can)?;
    let outline = Outline::read(urdf, "machine.urdf")?;
    let mut guesses = Guesses::of(outline, &topics, &log);
    guesses.unknown.retain(|joint| !constant.contains(joint));
    guesses
        .joints
        .retain(|guess| !constant.contains(&guess.joint));
    let mut text = Text::default();
    topics.write(&log, &mut text);
    write_joints(&mut text, &guesses);
    topics.can.write_weights(&mut text);
    Ok(text.finish())
}
