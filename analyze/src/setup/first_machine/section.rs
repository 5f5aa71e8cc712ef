//! The section about signals alone, for a machine file that is made otherwise.

use std::path::Path;

use anyhow::Result;
use tipwatch_ingest::Log;
use tipwatch_mechanics::machine::Outline;

use super::guesses::Guesses;
use super::render::write_joints;
use super::signals::Topics;
use super::text::Text;

/// The section `[signals]` for a log and the joints of a URDF. Joints of `constant` have a position elsewhere in the
/// machine file and are left out unless the log has them.
///
/// # Errors
/// The log cannot be read, or the text is not a URDF.
pub fn signals(log: &Path, urdf: &str, urdf_name: &str, constant: &[String]) -> Result<String> {
    let log = Log::open(log)?;
    let topics = Topics::find(&log)?;
    let outline = Outline::read(urdf, urdf_name)?;
    let mut guesses = Guesses::of(outline, &topics, &log);
    guesses.unknown.retain(|joint| !constant.contains(joint));
    guesses
        .joints
        .retain(|guess| !constant.contains(&guess.joint));
    let mut text = Text::default();
    topics.write(&log, &mut text);
    write_joints(&mut text, &guesses);
    Ok(text.finish())
}
