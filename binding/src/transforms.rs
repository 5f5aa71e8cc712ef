//! The static transforms of a log.

use tipwatch_ingest::{Log, static_frames};
use tipwatch_mechanics::machine::StaticTransform;

use crate::error::BindError;

/// The static transforms on a log's `/tf_static`.
///
/// # Errors
/// The log cannot be read.
pub fn static_transforms(log: &Log) -> Result<Vec<StaticTransform>, BindError> {
    let frames = static_frames(log)?.into_iter();
    let transform = |f: tipwatch_ingest::StaticFrame| {
        StaticTransform::new(&f.parent, &f.child, f.translation_m, f.rotation_xyzw)
    };
    Ok(frames.map(transform).collect())
}
