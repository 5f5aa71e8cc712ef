//! The joint uncertainty of the unknowns after the data.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use tipwatch_mechanics::machine::{Identified, IdentifiedDirection};

use crate::identification::fit::Fit;
use crate::identification::prior::Prior;

/// Directions whose variance the data lower by less than this share are left out.
const LEAST_SHARE: f64 = 0.01;
/// Most of a variance that is ever removed: beyond, rounding decides.
const MOST_SHARE: f64 = 1.0 - 1e-12;

/// The directions in the space of unknowns, in prior standard deviations, by what the data tell of them.
#[derive(Debug)]
pub(crate) struct Posterior {
    /// Share of the prior variance that the data removed along each direction.
    pub(crate) shares: Vec<f64>,
    /// Directions of length one, one in each column.
    pub(crate) directions: DMatrix<f64>,
}

impl Posterior {
    pub(crate) fn of(prior: &Prior, fit: &Fit) -> Self {
        let size = prior.unknowns.len();
        let biases = fit.precision.nrows() - size;
        let own = fit.precision.view((0, 0), (size, size)).into_owned();
        // What the constant errors of the sensors leave: the Schur complement.
        let left = match biases {
            0 => own,
            _ => {
                let cross = fit.precision.view((0, size), (size, biases)).into_owned();
                let of_biases = fit
                    .precision
                    .view((size, size), (biases, biases))
                    .into_owned();
                let solved = of_biases
                    .cholesky()
                    .map(|root| root.solve(&cross.transpose()));
                solved.map_or(own.clone(), |solved| own - cross * solved)
            }
        };
        let gained = left - DMatrix::identity(size, size);
        let gained = (&gained + gained.transpose()) * 0.5;
        let decomposed = SymmetricEigen::new(gained);
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|&a, &b| decomposed.eigenvalues[b].total_cmp(&decomposed.eigenvalues[a]));
        let share = |place: usize| {
            let gain = decomposed.eigenvalues[place].max(0.0);
            (gain / (1.0 + gain)).min(MOST_SHARE)
        };
        let columns: Vec<DVector<f64>> = (order.iter())
            .map(|&place| decomposed.eigenvectors.column(place).into_owned())
            .collect();
        Self {
            shares: order.iter().map(|&place| share(place)).collect(),
            directions: DMatrix::from_columns(&columns),
        }
    }

    /// The identified parameters.
    pub(crate) fn identified(&self, prior: &Prior, fit: &Fit) -> Identified {
        let told = self.shares.iter().enumerate();
        let told = told.filter(|(_, share)| **share > LEAST_SHARE);
        Identified {
            unknowns: prior.unknowns.clone(),
            change: prior.changes(&fit.unknowns),
            prior_sigma: prior.sigmas.clone(),
            model_share: None,
            sigma_factor: None,
            directions: told
                .map(|(place, &share)| IdentifiedDirection {
                    share,
                    weights: self.directions.column(place).iter().copied().collect(),
                })
                .collect(),
        }
    }
}
