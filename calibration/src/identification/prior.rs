//! Prior knowledge of the unknowns, before the data: the machine file's standard deviations, or an earlier identification.

use nalgebra::{DMatrix, DVector};
use tipwatch_mechanics::machine::{Identified, Machine, Unknown};

/// The prior, in units of the standard deviations `sigmas`.
#[derive(Debug, Clone)]
pub(crate) struct Prior {
    pub(crate) unknowns: Vec<Unknown>,
    /// Standard deviation of each unknown, in the unknown's unit.
    pub(crate) sigmas: Vec<f64>,
    /// Expected changes.
    pub(crate) mean: DVector<f64>,
    /// Inverse of their covariance.
    pub(crate) precision: DMatrix<f64>,
}

impl Prior {
    /// For a machine without identified parameters, and those of an earlier identification.
    pub(crate) fn new(machine: &Machine, earlier: Option<&Identified>) -> Self {
        let unknowns = Unknown::all(machine);
        let size = unknowns.len();
        let nothing = Identified::default();
        let earlier = earlier.unwrap_or(&nothing);
        let place = |unknown: &Unknown| earlier.unknowns.iter().position(|u| u == unknown);
        let places: Vec<Option<usize>> = unknowns.iter().map(place).collect();
        let pairs = unknowns.iter().zip(&places);
        let sigmas: Vec<f64> = pairs
            .map(|(unknown, place)| match place {
                Some(place) => earlier.prior_sigma[*place],
                None => unknown.stated_sigma(machine),
            })
            .collect();
        let mean = places.iter().zip(&sigmas);
        let mean =
            mean.map(|(place, sigma)| place.map_or(0.0, |place| earlier.change[place] / sigma));
        let mean = DVector::from_iterator(size, mean);
        let mut covariance = DMatrix::identity(size, size);
        for direction in &earlier.directions {
            let weights = places
                .iter()
                .map(|place| place.map_or(0.0, |p| direction.weights[p]));
            let weights = DVector::from_iterator(size, weights);
            covariance -= &weights * weights.transpose() * direction.share;
        }
        Self {
            unknowns,
            sigmas,
            mean,
            precision: covariance
                .cholesky()
                .map_or_else(|| DMatrix::identity(size, size), |root| root.inverse()),
        }
    }

    /// Changes in their units.
    pub(crate) fn changes(&self, scaled: &DVector<f64>) -> Vec<f64> {
        let pairs = scaled.iter().zip(&self.sigmas);
        pairs.map(|(z, sigma)| z * sigma).collect()
    }
}
