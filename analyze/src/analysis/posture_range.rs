//! The range of each joint over the valid rows.

use super::study::{KnownRow, StudiedLog, Study};

/// Smallest and largest position of each joint (rad or m).
pub(super) struct PostureRange(Vec<[f64; 2]>);

impl Study<'_> for PostureRange {
    type Found = Vec<[f64; 2]>;

    fn begin(log: &StudiedLog<'_>) -> Self {
        let joints = log.machine.joints().len();
        Self(vec![[f64::INFINITY, f64::NEG_INFINITY]; joints])
    }

    fn take_row(&mut self, row: &KnownRow<'_>) {
        if !row.reasons().leave_valid() {
            return;
        }
        for (range, joint) in self.0.iter_mut().zip(&row.state.joints) {
            *range = [range[0].min(joint.position), range[1].max(joint.position)];
        }
    }
}

impl From<PostureRange> for Vec<[f64; 2]> {
    fn from(PostureRange(ranges): PostureRange) -> Self {
        ranges
    }
}
