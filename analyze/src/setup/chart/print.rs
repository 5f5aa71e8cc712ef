//! A chart as text and as CSV (comma-separated values).

use std::fmt::Write;

use tipwatch_mechanics::studies::load_capacity::Carried;

use super::compare::Compared;
use super::points::Chart;
use crate::base::number::short;

/// Names of the columns.
fn head(chart: &Chart) -> Vec<String> {
    let joints = chart.sweeps.iter().map(|sweep| sweep.joint.clone());
    let fixed = [
        "reach_m",
        "height_m",
        "load_kg",
        "tipping_kg",
        "tips_over",
        "limit_kg",
        "limit_wheel",
    ];
    let payloads = chart
        .points
        .first()
        .map_or(&[][..], |point| &point.payloads);
    let payloads = payloads.iter().flat_map(|payload| {
        let mass = short(payload.mass_kg);
        [format!("worst_wheel_{mass}kg"), format!("otf_{mass}kg_n")]
    });
    joints
        .chain(fixed.map(Into::into))
        .chain(payloads)
        .collect()
}

fn carried(carried: Option<&Carried>) -> [String; 2] {
    carried.map_or_else(Default::default, |carried| {
        [format!("{:.1}", carried.mass_kg), carried.by.clone()]
    })
}

fn rows(chart: &Chart) -> impl Iterator<Item = Vec<String>> + '_ {
    chart.points.iter().map(|point| {
        let mut cells: Vec<String> = (point.positions.iter())
            .map(|position| format!("{position:.4}"))
            .collect();
        let load = point
            .tipping
            .as_ref()
            .map(|tipping| chart.share * tipping.mass_kg);
        cells.push(format!("{:.3}", point.reach_m));
        cells.push(format!("{:.3}", point.height_m));
        cells.push(load.map_or(String::new(), |load| format!("{load:.1}")));
        cells.extend(carried(point.tipping.as_ref()));
        cells.extend(carried(point.limit.as_ref()));
        for payload in &point.payloads {
            cells.push(payload.wheel.clone());
            cells.push(match payload.tips {
                true => "tips".into(),
                false => format!("{:.0}", payload.otf_n),
            });
        }
        cells
    })
}

/// The chart as CSV: an empty cell where no load is the limit.
#[must_use]
pub fn csv(chart: &Chart) -> String {
    let mut out = head(chart).join(",") + "\n";
    for row in rows(chart) {
        out += &row.join(",");
        out.push('\n');
    }
    out
}

/// The chart, or its comparison with a sheet, as a table for a terminal.
#[must_use]
pub fn text(chart: &Chart, compared: Option<&[Compared]>) -> String {
    let mut out = String::new();
    let machine = &chart.machine;
    let _ = writeln!(
        out,
        "{} at rest on level ground, on {}; the load hangs on {}",
        machine.name(),
        machine.supports().names(machine.stands_on()),
        chart.link
    );
    let table: Vec<Vec<String>> = match compared {
        Some(compared) => comparison(chart, compared),
        None => std::iter::once(head(chart)).chain(rows(chart)).collect(),
    };
    let columns = table.first().map_or(0, Vec::len);
    let width = |column: usize| table.iter().map(|row| row[column].chars().count()).max();
    let widths: Vec<usize> = (0..columns)
        .map(|column| width(column).unwrap_or(0))
        .collect();
    for row in &table {
        let cells = row
            .iter()
            .zip(&widths)
            .map(|(cell, width)| format!("{cell:>width$}"));
        let line: Vec<String> = cells.collect();
        let _ = writeln!(out, "{}", line.join("  ").trim_end());
    }
    if chart.left_out > 0 {
        let _ = writeln!(
            out,
            "{} postures left out: a linkage cannot close",
            chart.left_out
        );
    }
    if chart.limits_n.is_none() {
        let _ = writeln!(
            out,
            "limit of the wheels unknown: the machine does not stand on all supports in its reference posture"
        );
    }
    if let Some(compared) = compared {
        out += &summary(chart, compared);
    }
    out
}

fn comparison(chart: &Chart, compared: &[Compared]) -> Vec<Vec<String>> {
    let mut table = vec![
        [
            "line",
            "reach_m",
            "height_m",
            "sheet_kg",
            "computed_kg",
            "difference",
        ]
        .map(String::from)
        .to_vec(),
    ];
    for point in compared {
        let place = point
            .point
            .as_ref()
            .map(|found| [found.reach_m, found.height_m]);
        let known = |value: Option<String>| value.unwrap_or_else(|| "-".into());
        table.push(vec![
            point.sheet.line.to_string(),
            known(place.map(|[reach, _]| format!("{reach:.2}"))),
            known(place.map(|[_, height]| format!("{height:.2}"))),
            format!("{:.0}", point.sheet.load_kg),
            match (&point.point, point.computed_kg(chart.share)) {
                (None, _) => "not reached".into(),
                (_, None) => "does not tip".into(),
                (_, Some(load)) => format!("{load:.0}"),
            },
            known(
                (point.difference_share(chart.share))
                    .map(|share| format!("{:+.1} %", 100.0 * share)),
            ),
        ]);
    }
    table
}

fn summary(chart: &Chart, compared: &[Compared]) -> String {
    let known = compared
        .iter()
        .filter_map(|point| point.difference_share(chart.share));
    let known: Vec<f64> = known.collect();
    if known.is_empty() {
        return "not decided: no point of the sheet could be compared\n".into();
    }
    let count = known.len() as f64;
    let mean = known.iter().sum::<f64>() / count;
    let rms = (known.iter().map(|share| share * share).sum::<f64>() / count).sqrt();
    let worst = known
        .iter()
        .fold(0.0, |worst: f64, share| match share.abs() > worst.abs() {
            true => *share,
            false => worst,
        });
    format!(
        "{} of {} points compared: computed less stated {:+.1} % in the mean, {:.1} % root mean square, {:+.1} % at worst\n",
        known.len(),
        compared.len(),
        100.0 * mean,
        100.0 * rms,
        100.0 * worst
    )
}
