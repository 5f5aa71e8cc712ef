//! Differences row by row, for sides with rows at the same times.

use serde::Serialize;
use tipwatch_language::{told, word};
use tipwatch_mechanics::{Quantity, QuantityKind, When};

use super::side::Side;
use crate::base::number::{in_english, readable};

/// Units that come first in the output.
const FIRST_UNITS: [&str; 3] = ["N", "-", "N m"];

/// Columns of both sides over their shared rows.
#[derive(Debug, Serialize)]
pub struct SeriesComparison {
    /// Rows at the same time that are valid on both sides.
    pub rows: usize,
    /// Columns of both, grouped by unit, the largest root mean square difference first.
    pub columns: Vec<SeriesDifference>,
    /// Columns that only A has.
    pub only_a: Vec<String>,
    /// Columns that only B has.
    pub only_b: Vec<String>,
}

/// A column on both sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SeriesDifference {
    /// Name of the column.
    pub column: String,
    /// Its unit.
    pub unit: String,
    /// Rows with a value on both sides.
    pub rows: usize,
    /// Mean of B minus A.
    pub mean: f64,
    /// Root mean square of B minus A.
    pub rms: f64,
    /// Largest absolute difference.
    pub largest: f64,
    /// Time of the largest difference (ns).
    pub largest_ns: i64,
    /// `rms` relative to the larger root mean square of the two; null if both are zero.
    pub relative: Option<f64>,
}

impl SeriesDifference {
    /// Names the quantity of the column.
    pub(super) fn in_words(&self) -> String {
        in_words(&self.column)
    }

    /// Whether the quantity is a variance or a covariance, which readers see as standard deviations.
    pub(super) fn is_variance(&self) -> bool {
        self.unit.ends_with("^2") && !self.unit.contains('/')
    }

    /// Whether the quantity is a derivative, which is shown on demand only.
    pub(super) fn is_derivative(&self) -> bool {
        quantity(&self.column).is_some_and(|(kind, _)| kind.when == When::Gradient)
    }

    /// Whether a digit that readers see differs.
    pub(super) fn differs(&self) -> bool {
        in_english(self.largest) != in_english(0.0)
    }
}

/// The quantity of a column, and what it is of.
fn quantity(column: &str) -> Option<(&'static QuantityKind, Vec<&str>)> {
    let kinds = Quantity::KINDS.iter();
    let known = kinds.filter_map(|kind| Some((kind, placed(column, kind.pattern)?)));
    // of several patterns that fit, the one that leaves least to its places
    known.min_by_key(|(_, of)| of.iter().map(|part| part.len()).sum::<usize>())
}

/// Names the quantity of a column: its label, and the wheel or edge it is of. "OTF, RL" is `otf_rl`.
pub(super) fn in_words(column: &str) -> String {
    match quantity(column) {
        Some((kind, of)) if of.is_empty() => told(kind.label).into(),
        Some((kind, of)) => {
            let of = of.iter().map(|part| match part.len() {
                // names of wheels are initials
                0..=3 => part.to_uppercase(),
                _ => readable(part),
            });
            format!(
                "{}, {}",
                told(kind.label),
                of.collect::<Vec<_>>().join(", ")
            )
        }
        None => readable(column),
    }
}

/// Returns the parts of a name at the places in braces of a pattern; `None` where the name does not fit the pattern.
fn placed<'n>(name: &'n str, pattern: &str) -> Option<Vec<&'n str>> {
    let (before, rest) = match pattern.split_once('{') {
        Some((before, rest)) => (before, rest.split_once('}').map(|(_, rest)| rest)),
        None => (pattern, None),
    };
    let name = name.strip_prefix(before)?;
    let Some(rest) = rest else {
        return name.is_empty().then(Vec::new);
    };
    // the longest part after which the rest fits: names of causes and links have underscores, those of wheels seldom
    let ends = name.char_indices().map(|(at, _)| at).chain([name.len()]);
    ends.rev().filter(|&end| end > 0).find_map(|end| {
        let (part, after) = name.split_at(end);
        let mut of = placed(after, rest)?;
        of.insert(0, part);
        Some(of)
    })
}

/// A unit as people write it: "N²" is `N^2`; nothing for a number without one.
pub(super) fn printed_unit(unit: &str) -> String {
    match unit {
        "-" => String::new(),
        "events" => word!("events").into(),
        "rows" => word!("rows").into(),
        unit => unit.replace("^2", "²").replace("^3", "³"),
    }
}

/// Indices of rows at the same time that are valid on both sides.
pub(super) fn shared_rows(a: &Side, b: &Side) -> Vec<(usize, usize)> {
    let (mut shared, mut on_b) = (Vec::new(), 0);
    for (on_a, time) in a.times_ns.iter().enumerate() {
        while b.times_ns.get(on_b).is_some_and(|other| other < time) {
            on_b += 1;
        }
        if b.times_ns.get(on_b) == Some(time) && a.valid[on_a] && b.valid[on_b] {
            shared.push((on_a, on_b));
        }
    }
    shared
}

/// Compares all shared columns.
///
/// # Errors
/// There is no shared valid row; the text explains why.
pub(super) fn compare(a: &Side, b: &Side) -> Result<SeriesComparison, String> {
    let rows = shared_rows(a, b);
    if rows.is_empty() {
        return Err(word!("the results have no valid row at the same time").into());
    }
    let mut columns: Vec<SeriesDifference> = a
        .columns
        .iter()
        .filter_map(|column| {
            let other = b.column(&column.name)?;
            // rounding alone is no difference
            let is_single = column.is_single || other.is_single;
            let rounded = |value: f64| match is_single {
                true => f64::from(value as f32),
                false => value,
            };
            let values = rows.iter().map(|&(i, j)| {
                let (on_a, on_b) = (column.values[i], other.values[j]);
                (a.times_ns[i], rounded(on_a), rounded(on_b))
            });
            difference(&column.name, &column.unit, values)
        })
        .collect();
    let place = |column: &SeriesDifference| {
        let known = FIRST_UNITS.iter().position(|unit| *unit == column.unit);
        (known.unwrap_or(FIRST_UNITS.len()), column.unit.clone())
    };
    columns.sort_by(|x, y| {
        place(x)
            .cmp(&place(y))
            .then_with(|| y.rms.total_cmp(&x.rms))
    });
    let only = |one: &Side, other: &Side| -> Vec<String> {
        let alone = one
            .columns
            .iter()
            .filter(|column| other.column(&column.name).is_none());
        alone.map(|column| column.name.clone()).collect()
    };
    Ok(SeriesComparison {
        rows: rows.len(),
        columns,
        only_a: only(a, b),
        only_b: only(b, a),
    })
}

/// `None` if no row has both values.
fn difference(
    column: &str,
    unit: &str,
    values: impl Iterator<Item = (i64, f64, f64)>,
) -> Option<SeriesDifference> {
    let (mut rows, mut sum, mut squares, mut largest) = (0, 0.0, 0.0, (-1.0, 0));
    let (mut squares_a, mut squares_b) = (0.0, 0.0);
    for (time, a, b) in values.filter(|(_, a, b)| a.is_finite() && b.is_finite()) {
        let difference = b - a;
        rows += 1;
        sum += difference;
        squares += difference * difference;
        squares_a += a * a;
        squares_b += b * b;
        if difference.abs() > largest.0 {
            largest = (difference.abs(), time);
        }
    }
    let count = f64::from(u32::try_from(rows).ok().filter(|&rows| rows > 0)?);
    let scale = f64::max(squares_a, squares_b);
    Some(SeriesDifference {
        column: column.into(),
        unit: unit.into(),
        rows,
        mean: sum / count,
        rms: (squares / count).sqrt(),
        largest: largest.0,
        largest_ns: largest.1,
        relative: (scale > 0.0).then(|| (squares / scale).sqrt()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_use_rows_with_values_on_both_sides() {
        let rows = [(0, 1.0, 4.0), (1, f64::NAN, 9.0), (2, 3.0, -1.0)];
        let Some(found) = difference("x", "N", rows.into_iter()) else {
            panic!("expected shared rows");
        };
        assert_eq!(
            (found.rows, found.mean, found.largest, found.largest_ns),
            (2, -0.5, 4.0, 2)
        );
        assert_eq!(found.rms, 12.5_f64.sqrt());
        assert_eq!(found.relative, Some((25.0_f64 / 17.0).sqrt()));
        assert!(difference("x", "N", [(0, f64::NAN, 1.0)].into_iter()).is_none());
    }

    #[test]
    fn a_column_that_differs_by_rounding_alone_is_alike() {
        let differs = |change: f64| {
            let rows = [(0, 1e3, 1e3 + change), (1, 2e3, 2e3)];
            difference("cause_wheel_weight_fl", "N", rows.into_iter())
                .is_some_and(|of| of.differs())
        };
        assert!(!differs(0.0) && !differs(7e-13));
        assert!(differs(0.01));
    }

    #[test]
    fn derivatives_are_known_by_their_quantity() {
        let is_derivative = |column: &str| {
            let of = difference(column, "N", [(0, 1.0, 2.0)].into_iter());
            of.is_some_and(|of| of.is_derivative())
        };
        assert!(is_derivative("dsigma_dvx") && is_derivative("dsigma_dyaw_rate_dot"));
        assert!(!is_derivative("sigma") && !is_derivative("otf_rl"));
    }

    #[test]
    fn columns_are_told_by_their_quantity() {
        let expected = [
            ("otf_rl", "OTF, RL"),
            ("load_rl_min", "smallest load, RL"),
            ("otf_rl_sigma", "σ of the OTF, RL"),
            ("itom_full_left", "ITOM with wheels, left"),
            ("cause_arm_weight_fr", "contribution, arm weight, FR"),
            ("zmp_margin", "ZMP margin"),
            ("a_column_of_nobody", "a column of nobody"),
        ];
        for (column, words) in expected {
            assert_eq!(in_words(column), words, "{column}");
        }
        assert_eq!([printed_unit("N^2"), printed_unit("-")], ["N²", ""]);
    }
}
