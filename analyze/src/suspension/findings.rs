//! Findings of a replay: the suspension as requested compared with the suspension locked.

use std::collections::BTreeMap;

use tipwatch_language::{decimals, say, word};
use tipwatch_suspension::Status;
use tipwatch_suspension::replay::Track;

use super::mode::SuspensionMode;
use super::statistics::{mean, range};
use super::what_if::WhatIf;
use crate::base::table::Table;
use crate::events::Finding;

/// The findings: load spread, centre of mass, wheels, control.
#[must_use]
pub fn findings(what_if: &WhatIf) -> Vec<Finding> {
    let mode = match what_if.options.suspension {
        SuspensionMode::Locked => word!("locked"),
        SuspensionMode::Recorded => word!("as recorded"),
        SuspensionMode::Literal | SuspensionMode::LookAhead => word!("controlled"),
    };
    let (spread, offset) = (spread(what_if, mode), offset(what_if, mode));
    let wheels = 0..what_if.analysis.machine.wheels().len();
    let wheels = wheels.map(|wheel| loads(what_if, wheel, mode));
    let status = &what_if.comparison.moved.status;
    [spread, offset]
        .into_iter()
        .chain(wheels)
        .chain(alarms(status))
        .chain(stops(status))
        .collect()
}

fn spread(what_if: &WhatIf, mode: &str) -> Finding {
    let comparison = &what_if.comparison;
    let [fixed, moved] = [&comparison.fixed, &comparison.moved].map(|track| mean(&track.spread));
    let change = 100.0 * (moved / fixed - 1.0);
    let best = comparison.best.mean_spread();
    Finding {
        headline: say!(
            "Mean load spread {moved:.0} N with the suspension {mode}, {fixed:.0} N locked ({change:+.1} %)"
        ),
        evidence: vec![
            word!("load spread: equation (35) of the second paper, each pair of wheels once")
                .into(),
            say!("best posture at rest within the stroke, at each sample: {best:.0} N"),
            match comparison.gain_share() {
                Some(share) => {
                    say!("achieved: {:.0} % of the possible reduction", 100.0 * share)
                }
                None => word!(
                    "no posture within the stroke has a smaller mean spread than the locked one"
                )
                .into(),
            },
        ],
    }
}

fn offset(what_if: &WhatIf, mode: &str) -> Finding {
    let comparison = &what_if.comparison;
    let offsets = [&comparison.fixed, &comparison.moved].map(Track::com_offset);
    let [fixed, moved] = offsets.each_ref().map(|offset| 100.0 * mean(offset));
    let [most_fixed, most_moved] = offsets.each_ref().map(|offset| 100.0 * range(offset)[1]);
    Finding {
        headline: say!(
            "Mean offset of the centre of mass {moved:.1} cm with the suspension {mode}, {fixed:.1} cm locked"
        ),
        evidence: vec![
            word!(
                "offset: distance from the centre of the contact points, along the contact plane"
            )
            .into(),
            say!("largest offset: {most_moved:.1} cm {mode}, {most_fixed:.1} cm locked"),
        ],
    }
}

fn loads(what_if: &WhatIf, wheel: usize, mode: &str) -> Finding {
    let (comparison, rows) = (&what_if.comparison, &what_if.analysis.rows);
    let loads = [&comparison.moved, &comparison.fixed].map(|track| track.load[wheel].as_slice());
    let name = &what_if.analysis.machine.wheels()[wheel].name;
    let unloaded = loads.map(|load| load.iter().filter(|&&load| load == 0.0).count());
    let least = loads.map(|load| range(load)[0]);
    let [moved_s, fixed_s] = loads.map(|load| least_load_time(rows, load));
    Finding {
        headline: match (unloaded, least) {
            ([0, 0], [moved, fixed]) => say!(
                "Wheel {name}: smallest load {moved:.0} N with the suspension {mode}, {fixed:.0} N locked"
            ),
            ([moved, fixed], _) => say!(
                "Wheel {name}: unloaded in {moved} rows with the suspension {mode}, in {fixed} locked"
            ),
        },
        evidence: vec![say!(
            "smallest load first reached at {moved_s} {mode}, at {fixed_s} locked"
        )],
    }
}

/// Time of the first row with the smallest load, as text.
fn least_load_time(rows: &Table, load: &[f64]) -> String {
    let least = range(load)[0];
    match load.iter().position(|&load| load == least) {
        Some(row) => decimals(format!("t = {:.2} s", rows.seconds(row))),
        None => word!("unknown time").into(),
    }
}

fn alarms(status: &[Option<Status>]) -> Option<Finding> {
    let mut rows: BTreeMap<Status, usize> = BTreeMap::new();
    for status in status.iter().flatten().filter(|status| status.is_alarm()) {
        *rows.entry(*status).or_default() += 1;
    }
    let count: usize = rows.values().sum();
    (count > 0).then(|| Finding {
        headline: say!("The control raised an alarm in {count} rows"),
        evidence: (rows.iter())
            .map(|(status, rows)| say!("status {} in {rows} rows", status.name()))
            .collect(),
    })
}

fn stops(status: &[Option<Status>]) -> Option<Finding> {
    let short = status.iter().flatten();
    let short = short.filter(|&&status| status == Status::StepTooShort);
    let count = short.count();
    (count > 0).then(|| Finding {
        headline: say!("The control stopped the rods in {count} rows"),
        evidence: vec![say!(
            "status {}: the control period is too short for the posture of the arm",
            Status::StepTooShort.name()
        )],
    })
}
