//! The static transforms of a log.

use tipwatch_ingest::{Log, static_frames};
use tipwatch_language::say;
use tipwatch_mechanics::machine::StaticTransform;

use crate::error::BindError;

/// Poses that differ by less are one pose, written with other digits (m, rad).
const SAME_POSE: f64 = 1e-6;
/// Most frames that are named.
const MOST_NAMED: usize = 10;

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

/// A note on frames that have several static transforms which differ: the last one counts.
pub(crate) fn twice_noted(transforms: &[StaticTransform]) -> Option<String> {
    let mut frames: Vec<String> = Vec::new();
    for (index, earlier) in transforms.iter().enumerate() {
        let last = transforms[index + 1..]
            .iter()
            .rev()
            .find(|t| t.child == earlier.child);
        let is_other = last.is_some_and(|last| !is_same(earlier, last));
        if is_other && !frames.contains(&earlier.child) {
            frames.push(earlier.child.clone());
        }
    }
    let more = match frames.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        more => say!(" and {more} more"),
    };
    frames.truncate(MOST_NAMED);
    (!frames.is_empty()).then(|| {
        say!(
            "Static transforms of a frame differ within the log, and the last one of each counts: {}{more}.",
            frames.join(", ")
        )
    })
}

fn is_same(a: &StaticTransform, b: &StaticTransform) -> bool {
    let apart = a.parent_from_child.inverse() * b.parent_from_child;
    a.parent == b.parent
        && apart.translation.vector.norm() <= SAME_POSE
        && apart.rotation.angle() <= SAME_POSE
}
