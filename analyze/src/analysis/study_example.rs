//! The example of a study that CONTRIBUTING.md shows.

use schemars::JsonSchema;
use serde::Serialize;

use super::study::{KnownRow, StudiedLog, Study};

// shown from here on
/// How often the platform turned fast.
#[derive(Debug, Default, Serialize, JsonSchema)]
pub(super) struct FastTurns {
    /// Rows in which it turned by more than 0.5 rad/s.
    pub(super) rows: u64,
}

impl Study<'_> for FastTurns {
    type Found = Self;

    fn begin(_: &StudiedLog<'_>) -> Self {
        Self::default()
    }

    fn take_row(&mut self, row: &KnownRow<'_>) {
        let turn = row.state.imu.angular_velocity.norm();
        self.rows += u64::from(turn > 0.5);
    }
}
// shown until here

#[test]
fn the_shown_example_is_this_one() {
    let own = include_str!("study_example.rs");
    let shown = own.split("// shown ").nth(1).unwrap();
    let (_, example) = shown.split_once('\n').unwrap();
    assert!(include_str!("../../../CONTRIBUTING.md").contains(example));
    let found = serde_json::to_string(&FastTurns { rows: 3 }).unwrap();
    assert_eq!(found, r#"{"rows":3}"#);
}
