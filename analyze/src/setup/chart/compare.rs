//! A chart of a maker, point by point beside the computed one.

use anyhow::{Result, bail};
use nalgebra::{DMatrix, DVector};

use super::points::{Chart, ChartPoint};

/// A posture is found when the load is this near to the place of the sheet (m).
const FOUND_M: f64 = 0.01;
/// Step of a joint for differences (rad or m), and most steps of a search.
const STEP: f64 = 1e-5;
const MOST_STEPS: usize = 40;

/// A point of a maker's chart.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetPoint {
    /// Line of the file.
    pub line: usize,
    /// Positions of swept joints by their index (rad or m), as far as stated.
    joints: Vec<Option<f64>>,
    /// Reach and height of the load (m), as far as stated.
    place: [Option<f64>; 2],
    /// The load (kg).
    pub load_kg: f64,
}

/// A point of a maker's chart beside the computed one.
#[derive(Debug, Clone)]
pub struct Compared {
    /// Point on the sheet.
    pub sheet: SheetPoint,
    /// The computed posture; `None` where the load does not get to that place.
    pub point: Option<ChartPoint>,
}

impl Compared {
    /// Computed load, as the chart states it (kg).
    #[must_use]
    pub fn computed_kg(&self, share: f64) -> Option<f64> {
        let tipping = self.point.as_ref()?.tipping.as_ref()?;
        Some(share * tipping.mass_kg)
    }

    /// Computed less stated load, as a share of the latter.
    #[must_use]
    pub fn difference_share(&self, share: f64) -> Option<f64> {
        let computed = self.computed_kg(share)?;
        Some((computed - self.sheet.load_kg) / self.sheet.load_kg)
    }
}

/// Reads a maker's chart: a table with a head of `load_kg`, `reach_m`, `height_m` and names of swept joints, in rad, m, or
/// degrees with `_deg`.
///
/// # Errors
/// The table has another form.
pub fn sheet_points(chart: &Chart, text: &str, name: &str) -> Result<Vec<SheetPoint>> {
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty());
    let Some((_, head)) = lines.next() else {
        bail!("{name}: expected a head such as reach_m,height_m,load_kg, found an empty file");
    };
    let separator = [';', '\t', ',']
        .into_iter()
        .find(|sign| head.contains(*sign));
    let separator = separator.unwrap_or(',');
    let cells = |line: &str| -> Vec<String> {
        let cells = line.split(separator);
        cells
            .map(|cell| cell.trim().trim_matches('"').to_owned())
            .collect()
    };
    let columns: Vec<Column> = (cells(head).iter())
        .map(|title| Column::of(chart, title, name))
        .collect::<Result<_>>()?;
    if !columns.contains(&Column::Load) {
        bail!("{name}, line 1: expected a column load_kg, found \"{head}\"");
    }
    let mut points = Vec::new();
    for (index, line) in lines {
        let line_number = index + 1;
        let cells = cells(line);
        if cells.len() != columns.len() {
            bail!(
                "{name}, line {line_number}: expected {} numbers, found {}",
                columns.len(),
                cells.len()
            );
        }
        let mut point = SheetPoint {
            line: line_number,
            joints: vec![None; chart.sweeps.len()],
            place: [None; 2],
            load_kg: f64::NAN,
        };
        for (column, cell) in columns.iter().zip(&cells) {
            if cell.is_empty() && *column != Column::Load {
                continue;
            }
            let Some(value) = cell.parse().ok().filter(|value: &f64| value.is_finite()) else {
                bail!("{name}, line {line_number}: expected a number, found \"{cell}\"");
            };
            match *column {
                Column::Load => point.load_kg = value,
                Column::Place(axis) => point.place[axis] = Some(value),
                Column::Joint(sweep, factor) => point.joints[sweep] = Some(value * factor),
            }
        }
        if !(point.load_kg > 0.0) {
            bail!(
                "{name}, line {line_number}: expected a positive load, found {}",
                point.load_kg
            );
        }
        points.push(point);
    }
    Ok(points)
}

/// Content of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Column {
    Load,
    /// 0 the reach, 1 the height.
    Place(usize),
    /// The joint of a sweep, and the factor to rad or m.
    Joint(usize, f64),
}

impl Column {
    fn of(chart: &Chart, title: &str, name: &str) -> Result<Self> {
        let sweep = |joint: &str| chart.sweeps.iter().position(|sweep| sweep.joint == joint);
        let in_degrees = title.strip_suffix("_deg").and_then(sweep);
        Ok(match (title, sweep(title), in_degrees) {
            ("load_kg", ..) => Self::Load,
            ("reach_m", ..) => Self::Place(0),
            ("height_m", ..) => Self::Place(1),
            (_, Some(joint), _) => Self::Joint(joint, 1.0),
            (_, None, Some(joint)) => Self::Joint(joint, 1.0_f64.to_radians()),
            _ => {
                let known: Vec<&str> = chart.sweeps.iter().map(|it| it.joint.as_str()).collect();
                bail!(
                    "{name}, line 1: expected load_kg, reach_m, height_m or a swept joint ({}; in degrees with _deg), found \"{title}\"",
                    known.join(", ")
                )
            }
        })
    }
}

/// Computes the posture of each point and the load that the machine carries there.
///
/// # Errors
/// A point states too little to find its posture.
pub fn compare(chart: &Chart, points: Vec<SheetPoint>) -> Result<Vec<Compared>> {
    let compared = points.into_iter().map(|sheet| {
        let open: Vec<usize> = (0..chart.sweeps.len())
            .filter(|&sweep| sheet.joints[sweep].is_none() && chart.sweeps[sweep].positions.len() > 1)
            .collect();
        let stated = sheet.place.iter().flatten().count();
        if open.len() > stated {
            let names: Vec<&str> = open.iter().map(|&k| chart.sweeps[k].joint.as_str()).collect();
            bail!(
                "line {}: expected reach_m and height_m, or the positions of joints, as many as there are open ones ({}); found {stated}. \
                 A joint that the sheet leaves alone takes one position: --sweep JOINT=POSITION",
                sheet.line,
                names.join(", ")
            );
        }
        let positions = posture(chart, &sheet, &open);
        let limits_n = chart.limits_n.as_deref();
        let point = positions.and_then(|positions| chart.placing.point(&chart.machine, limits_n, positions));
        Ok(Compared { sheet, point })
    });
    compared.collect()
}

/// Positions of the swept joints with which the load is at the place of the sheet, by Gauss-Newton steps from the nearest
/// point of the chart; `None` if it does not get there within the sweeps.
fn posture(chart: &Chart, sheet: &SheetPoint, open: &[usize]) -> Option<Vec<f64>> {
    let off = |place: [f64; 2]| -> Vec<f64> {
        let pairs = place.iter().zip(&sheet.place);
        pairs
            .filter_map(|(is, wanted)| Some(is - (*wanted)?))
            .collect()
    };
    let distance = |off: &[f64]| off.iter().map(|off| off * off).sum::<f64>().sqrt();
    let stated = |positions: &[f64]| -> Vec<f64> {
        let pairs = positions.iter().zip(&sheet.joints);
        pairs
            .map(|(&position, stated)| stated.unwrap_or(position))
            .collect()
    };
    let at = |positions: &[f64]| Some(off(chart.placing.place(&chart.machine, positions)?));
    let starts = chart.points.iter().map(|point| stated(&point.positions));
    let start = starts
        .filter_map(|positions| Some((distance(&at(&positions)?), positions)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, mut positions) = start?;
    let mut here = at(&positions)?;
    for _ in 0..MOST_STEPS {
        if open.is_empty() || distance(&here) < 0.1 * FOUND_M {
            break;
        }
        let mut jacobian = DMatrix::zeros(here.len(), open.len());
        for (column, &sweep) in open.iter().enumerate() {
            let mut moved = positions.clone();
            moved[sweep] += STEP;
            let there = at(&moved)?;
            for row in 0..here.len() {
                jacobian[(row, column)] = (there[row] - here[row]) / STEP;
            }
        }
        let step = jacobian
            .svd(true, true)
            .solve(&DVector::from_vec(here.clone()), 1e-6)
            .ok()?;
        let mut share = 1.0;
        loop {
            let mut next = positions.clone();
            for (k, &sweep) in open.iter().enumerate() {
                let all = &chart.sweeps[sweep].positions;
                let (first, last) = (all[0], all[all.len() - 1]);
                let wanted = next[sweep] - share * step[k];
                next[sweep] = wanted.clamp(first.min(last), first.max(last));
            }
            if let Some(there) = at(&next)
                && distance(&there) < distance(&here)
            {
                (positions, here) = (next, there);
                break;
            }
            share *= 0.5;
            if share < 1e-4 {
                return (distance(&here) < FOUND_M).then_some(positions);
            }
        }
    }
    (distance(&here) < FOUND_M).then_some(positions)
}
