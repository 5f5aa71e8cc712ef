//! Quantities that follow from the numbers of a checked sheet.

use super::spec::{Axle, Sheet};

impl Sheet {
    /// Places of the axles: 0 for the first one, negative behind it (m).
    pub(crate) fn axle_positions(&self) -> Vec<f64> {
        let behind = self.axles.iter().map(|a| a.behind.map_or(0.0, |b| b.si));
        behind
            .scan(0.0, |x, behind| {
                *x -= behind;
                Some(*x)
            })
            .collect()
    }

    /// Distance between the first and the last axle (m).
    pub(super) fn wheelbase(&self) -> f64 {
        self.axle_positions().last().map_or(0.0, |x| -x)
    }

    /// The wheelbase, or the length of the tracks (m).
    pub(super) fn length_on_ground(&self) -> f64 {
        let of_tracks = self.tracks.as_ref().map_or(0.0, |tracks| tracks.length.si);
        self.wheelbase().max(of_tracks)
    }

    /// The widest track of an axle, or the gauge of the tracks (m).
    pub(super) fn widest_track(&self) -> f64 {
        let tracks = self.axles.iter().filter_map(|axle| axle.track);
        let gauge = self.tracks.as_ref().map(|tracks| tracks.gauge);
        let all = tracks.chain(gauge).map(|track| track.si);
        all.fold(0.0, f64::max)
    }

    /// Radius of the tyre of a checked axle (m).
    pub(crate) fn tyre_radius(&self, axle: &Axle) -> f64 {
        let stated = axle.tyre_radius.map(|r| r.si);
        stated
            .or(axle.tyre().map(|tyre| tyre.radius))
            .unwrap_or(0.5)
    }
}

impl Axle {
    /// Number of its wheels.
    pub(crate) fn wheels(&self) -> usize {
        match (self.track, self.bogie) {
            (None, _) => 1,
            (Some(_), None) => 2,
            (Some(_), Some(_)) => 4,
        }
    }

    /// The tyre that its designation describes.
    pub(crate) fn tyre(&self) -> Option<super::Tyre> {
        self.tyre.as_deref().and_then(super::Tyre::parse)
    }
}
