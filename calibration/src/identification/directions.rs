//! Combinations of parameters that the data tell, or cannot tell, named by their largest parameters.

use nalgebra::DMatrix;

use crate::identification::posterior::Posterior;

/// The data determine a direction from half of its variance on: they weigh as much as the prior.
const DETERMINED: f64 = 0.5;
/// Parameters named for a combination.
const NAMED: usize = 5;
/// A parameter that lies in the undetermined directions by more than this share is not determined by itself.
const UNDETERMINED: f64 = 0.98;
/// Components below this share of the largest are not named.
const SMALL: f64 = 0.1;

/// A combination of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Combination {
    /// Singular value of the whitened derivatives: prior over remaining standard deviation is the root of one plus its
    /// square.
    pub singular_value: f64,
    /// Its largest parameters.
    pub terms: Vec<Term>,
}

/// A parameter in a combination.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Index of the unknown.
    pub unknown: usize,
    /// Its part, in prior standard deviations.
    pub weight: f64,
}

/// Combinations of parameters that the data determine, and the parameters and combinations that they leave open.
#[derive(Debug)]
pub(crate) struct Named {
    pub(crate) determined: Vec<Combination>,
    /// Parameters that are determined neither by themselves nor with others.
    pub(crate) undetermined: Vec<usize>,
    /// Combinations that leave every measured number unchanged, though their parameters are determined in others.
    pub(crate) indistinguishable: Vec<Combination>,
}

pub(crate) fn named(posterior: &Posterior) -> Named {
    let size = posterior.shares.len();
    let singular = |share: f64| (share / (1.0 - share)).sqrt();
    let determined: Vec<Combination> = (0..size)
        .filter(|&place| posterior.shares[place] >= DETERMINED)
        .map(|place| Combination {
            singular_value: singular(posterior.shares[place]),
            terms: terms(posterior.directions.column(place).iter().copied()),
        })
        .collect();
    let rest: Vec<usize> = (0..size)
        .filter(|&place| posterior.shares[place] < DETERMINED)
        .collect();
    let inside = |unknown: usize| -> f64 {
        let parts = rest
            .iter()
            .map(|&place| posterior.directions[(unknown, place)].powi(2));
        parts.sum()
    };
    let (undetermined, mixed): (Vec<usize>, Vec<usize>) =
        (0..size).partition(|&unknown| inside(unknown) > UNDETERMINED);
    let basis = DMatrix::from_fn(rest.len(), mixed.len(), |row, column| {
        posterior.directions[(mixed[column], rest[row])]
    });
    let indistinguishable = sparse_rows(basis).into_iter().map(|row| {
        let mut named = terms(row.into_iter());
        for term in &mut named {
            term.unknown = mixed[term.unknown];
        }
        Combination {
            singular_value: 0.0,
            terms: named,
        }
    });
    Named {
        determined,
        undetermined,
        indistinguishable: indistinguishable.filter(|c| c.terms.len() > 1).collect(),
    }
}

/// The largest components.
fn terms(weights: impl Iterator<Item = f64>) -> Vec<Term> {
    let mut all: Vec<Term> = weights
        .enumerate()
        .map(|(unknown, weight)| Term { unknown, weight })
        .collect();
    all.sort_by(|a, b| b.weight.abs().total_cmp(&a.weight.abs()));
    let largest = all.first().map_or(0.0, |term| term.weight.abs());
    all.retain(|term| term.weight.abs() > SMALL * largest);
    all.truncate(NAMED);
    all
}

/// Rows that span those of `rows` and have few large components: Gaussian elimination on the largest ones.
fn sparse_rows(mut rows: DMatrix<f64>) -> Vec<Vec<f64>> {
    let (height, width) = rows.shape();
    let mut found: Vec<usize> = Vec::new();
    loop {
        let mut pivot = (0, 0, 0.0);
        for row in (0..height).filter(|row| !found.contains(row)) {
            for column in 0..width {
                if rows[(row, column)].abs() > pivot.2 {
                    pivot = (row, column, rows[(row, column)].abs());
                }
            }
        }
        // What is left are rests of parameters that the other directions tell.
        if pivot.2 < 0.3 {
            break;
        }
        let (row, column, _) = pivot;
        let scaled = rows.row(row) / rows[(row, column)];
        rows.row_mut(row).copy_from(&scaled);
        for other in (0..height).filter(|&other| other != row) {
            let factor = rows[(other, column)];
            let reduced = rows.row(other) - &scaled * factor;
            rows.row_mut(other).copy_from(&reduced);
        }
        found.push(row);
    }
    found
        .into_iter()
        .map(|row| rows.row(row).iter().copied().collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_that_act_alike_are_named_together() {
        // p0 + p1 is determined, p0 - p1 and p2 are not
        let root = 0.5_f64.sqrt();
        let posterior = Posterior {
            shares: vec![0.99, 0.0, 0.0],
            directions: DMatrix::from_row_slice(
                3,
                3,
                &[root, root, 0.0, root, -root, 0.0, 0.0, 0.0, 1.0],
            ),
        };
        let found = named(&posterior);
        assert_eq!(found.undetermined, [2]);
        assert_eq!(found.determined.len(), 1);
        assert!((found.determined[0].singular_value - 99.0_f64.sqrt()).abs() < 1e-9);
        let [pair] = &found.indistinguishable[..] else {
            panic!("{found:?}");
        };
        let weights: Vec<f64> = pair.terms.iter().map(|term| term.weight).collect();
        assert!((weights[0] + weights[1]).abs() < 1e-12, "{weights:?}");
    }
}
