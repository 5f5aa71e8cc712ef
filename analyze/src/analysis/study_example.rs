//! The example of a study that CONTRIBUTING.md shows, from its rows to all that is made of it.

use maud::Markup;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tipwatch_language::word;

use super::study::{KnownRow, StudiedLog, Study};
use crate::base::built::built;
use crate::base::frame::{Record, record};
use crate::page::table_of;

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

/// Stands for the analysis.
pub(super) struct Analysis {
    fast_turns: FastTurns,
}

built! {
    /// Stands for `summary.json`.
    #[derive(Serialize)]
    struct Summary<'a>: fn of(analysis: &'a Analysis) {} {
        // shown from here on
        /// How often the platform turned fast.
        pub fast_turns: &'a FastTurns = &analysis.fast_turns,
        // shown until here
    }
}

// shown from here on
/// How often the platform turned fast.
pub(super) fn section(analysis: &Analysis) -> Markup {
    table_of([[(word!("Rows"), analysis.fast_turns.rows.to_string())]])
}
// shown until here

built! {
    /// Stands for the facts of a log.
    #[derive(Serialize, Deserialize)]
    struct LogFacts: fn of(analysis: &Analysis) {} {
        // shown from here on
        /// Rows in which the platform turned by more than 0.5 rad/s. Absent from results of older versions.
        #[serde(default)]
        pub fast_turns: Option<u64> = Some(analysis.fast_turns.rows),
        // shown until here
    }
}

type Quantity = (&'static str, fn(&LogFacts) -> Option<f64>);

/// Stands for the numbers that a policy may limit.
const QUANTITIES: [Quantity; 1] = [
    // shown from here on
    ("fast_turns", |facts| Some(facts.fast_turns? as f64)),
    // shown until here
];

record! {
    /// Stands for a row of a fleet's data set.
    struct FleetLog of (facts: Option<&LogFacts>) {} {
        // shown from here on
        /// rows in which the platform turned by more than 0.5 rad/s
        fast_turns: Option<u64> ["rows"] = facts.and_then(|facts| facts.fast_turns),
        // shown until here
    }
}

#[test]
fn the_shown_example_is_this_one() {
    let lines = |text: &str| text.lines().map(str::trim).collect::<Vec<_>>().join("\n");
    let shown = lines(include_str!("../../../CONTRIBUTING.md"));
    // in two parts, or they would be found here
    let from = concat!("// shown", " from here on");
    let until = concat!("// shown", " until here");
    for example in include_str!("study_example.rs").split(from).skip(1) {
        let (example, _) = example.split_once(until).unwrap();
        let example = lines(example);
        assert!(shown.contains(example.trim()), "{example}");
    }
}

#[test]
fn what_an_example_finds_is_in_all_that_is_made_of_it() {
    let analysis = Analysis {
        fast_turns: FastTurns { rows: 3 },
    };
    let summary = serde_json::to_string(&Summary::of(&analysis)).unwrap();
    assert_eq!(summary, r#"{"fast_turns":{"rows":3}}"#);
    assert!(section(&analysis).0.contains(">3</td>"));
    let facts = serde_json::to_string(&LogFacts::of(&analysis)).unwrap();
    let facts: LogFacts = serde_json::from_str(&facts).unwrap();
    assert_eq!((QUANTITIES[0].1)(&facts), Some(3.0));
    assert_eq!(FleetLog::of(Some(&facts)).fast_turns, Some(3));
    let columns = FleetLog::columns();
    assert_eq!(
        (columns[0].name, columns[0].unit),
        ("fast_turns", Some("rows"))
    );
}
