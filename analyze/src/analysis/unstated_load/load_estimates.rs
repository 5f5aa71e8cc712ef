//! The unstated mass on the tool, from each part of a fall alone and from all of it.
//!
//! Each estimate is a weighted sum of the residuals, so that their joint covariance contains the errors that they share:
//! ```text
//!     m_i = w_i' y,   w_i = C_i^-1 s_i / (s_i' C_i^-1 s_i),   cov(m_i, m_j) = w_i' C w_j
//!     chi^2 = (m - m0)' V^-1 (m - m0),   m0 = 1' V^-1 m / (1' V^-1 1)
//! ```

use nalgebra::{DMatrix, DVector};
use tipwatch_language::word;

use super::equations::{Equations, Part};
use super::explanations::Fitted;
use super::regression::factor;
use super::result::{Agreement, LoadEstimates, MassEstimate};

/// Estimates whose agreement is less probable are not combined.
const LEAST_AGREEMENT: f64 = 0.01;

/// The estimates by a fitted load; `largest_sigma_kg` is how uncertain an estimate by the lean may be.
pub(super) fn estimates(
    link: String,
    equations: &Equations,
    fitted: &Fitted,
    no_lean: Option<String>,
    largest_sigma_kg: f64,
) -> LoadEstimates {
    let errors = equations.covariance(fitted.error) + &fitted.uncertain;
    let weights_of = |part: Part| weights(&equations.of_part(part), fitted, &errors);
    let estimate = |weights: &DVector<f64>| MassEstimate {
        mass_kg: weights.dot(&fitted.y),
        sigma_kg: weights.dot(&(&errors * weights)).max(0.0).sqrt(),
    };
    let mut parts = [Part::Lean, Part::Onset, Part::Fall].map(weights_of);
    let mut no_lean = no_lean;
    let lean = parts[0].as_ref().map(estimate);
    if lean.is_some_and(|lean| lean.sigma_kg > largest_sigma_kg) {
        parts[0] = None;
        no_lean = Some(word!("the lean hardly changed before the lift").into());
    }
    let [by_lean, by_onset, by_fall] =
        [0, 1, 2].map(|part: usize| parts[part].as_ref().map(estimate));
    let agreement = agreement(&parts, &fitted.y, &errors);
    let places: Vec<usize> = (0..equations.all.len()).collect();
    let agrees = agreement.is_none_or(|agreement| agreement.probability >= LEAST_AGREEMENT);
    let combined = weights(&places, fitted, &errors).map(|weights| estimate(&weights));
    LoadEstimates {
        link,
        by_lean,
        by_onset,
        by_fall,
        combined: combined.filter(|_| agrees),
        agreement,
        no_lean: by_lean.is_none().then_some(no_lean).flatten(),
    }
}

/// Weights of the residuals in the estimate by some equations.
fn weights(places: &[usize], fitted: &Fitted, errors: &DMatrix<f64>) -> Option<DVector<f64>> {
    if places.is_empty() {
        return None;
    }
    let by_mass = fitted.derivatives.column(0);
    let derivatives = DVector::from_iterator(places.len(), places.iter().map(|&p| by_mass[p]));
    let of_part = DMatrix::from_fn(places.len(), places.len(), |a, b| {
        errors[(places[a], places[b])]
    });
    let weighed = factor(of_part)?.solve(&derivatives);
    let scale = derivatives.dot(&weighed);
    let mut weights = DVector::zeros(fitted.y.len());
    for (place, weight) in places.iter().zip(&weighed) {
        weights[*place] = weight / scale;
    }
    weights
        .iter()
        .all(|weight| weight.is_finite())
        .then_some(weights)
}

fn agreement(
    parts: &[Option<DVector<f64>>; 3],
    y: &DVector<f64>,
    errors: &DMatrix<f64>,
) -> Option<Agreement> {
    let known: Vec<&DVector<f64>> = parts.iter().flatten().collect();
    let count = known.len();
    if count < 2 {
        return None;
    }
    let masses = DVector::from_iterator(count, known.iter().map(|weights| weights.dot(y)));
    let covariance = DMatrix::from_fn(count, count, |a, b| known[a].dot(&(errors * known[b])));
    let factor = factor(covariance)?;
    let ones = DVector::from_element(count, 1.0);
    let weighed = factor.solve(&ones);
    let common = weighed.dot(&masses) / weighed.dot(&ones);
    let off = masses.add_scalar(-common);
    let chi_square = off.dot(&factor.solve(&off));
    // upper tail of chi-square with one and two degrees of freedom
    let probability = match count {
        2 => libm::erfc((0.5 * chi_square).max(0.0).sqrt()),
        _ => (-0.5 * chi_square).exp(),
    };
    Some(Agreement {
        chi_square,
        degrees: count - 1,
        probability,
    })
    .filter(|agreement| agreement.chi_square.is_finite())
}
