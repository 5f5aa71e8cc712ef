//! Ground that gives way slowly under the platform, in no relation to the arm.
//!
//! It turns the platform about an axis that is unknown and stays, one way, at a rate that changes slowly. With the direction
//! d of the turn in the plane of the base, the lean b of a window and what the joints explain of it:
//! ```text
//!     d . b = d . (T bias + s a + m d(lean per load)) + rate T + n,    d' . b = d' . (...) + n',    d' across d
//! ```
//! A platform that leans so proves nothing about a sensor: what an alternative must explain better is not only sound sensors on
//! firm ground, but also sound sensors on each of these [`WAYS`].

use nalgebra::Vector2;

use super::compared::{Compared, UNKNOWNS};
use super::likelihood::Evidence;
use super::unknowns::Unknowns;

/// Directions about which ground turns the platform: all, in steps of 22.5 degrees.
pub(super) const WAYS: usize = 16;
/// Place of the rate among the unknowns.
const RATE: usize = UNKNOWNS - 1;
/// Standard deviation of its rate when it begins (rad/s), and of the change of that in a window.
const BEGINS: f64 = 6e-3;
const CHANGES: f64 = 2e-3;
/// Share of the threshold from which on ground that gives way explains the lean, and no bias of the gyro.
const LIKELY: f64 = 0.25;
/// Tangent of half the step between two directions.
const BETWEEN: f64 = 0.2;

/// Sound sensors on ground that gives way, in one direction.
#[derive(Debug, Clone)]
pub(super) struct Yielding {
    along: Vector2<f64>,
    unknowns: Unknowns<UNKNOWNS>,
    evidence: Evidence,
}

impl Yielding {
    /// One for each direction.
    pub(super) fn all(sound: &Unknowns<UNKNOWNS>) -> Vec<Self> {
        let ways = (0..WAYS).map(|way| {
            let (y, x) = (std::f64::consts::TAU * way as f64 / WAYS as f64).sin_cos();
            Self {
                along: Vector2::new(x, y),
                unknowns: begun(sound),
                evidence: Evidence::default(),
            }
        });
        ways.collect()
    }

    /// Log density of the measured lean in a window, with `sound` that of firm ground, whose unknowns were `before` it.
    pub(super) fn take(
        &mut self,
        compared: &Compared,
        a: &Vector2<f64>,
        before: &Unknowns<UNKNOWNS>,
        sound: f64,
        threshold: f64,
    ) -> f64 {
        if self.evidence.value == 0.0 {
            self.unknowns = begun(before);
        }
        self.unknowns.drift_one(RATE, CHANGES);
        let across = Vector2::new(-self.along.y, self.along.x);
        let unknowns = &mut self.unknowns;
        let density = compared.take_along(unknowns, &self.along, a, compared.window_s, 0.0);
        // it does not come back
        unknowns.mean[RATE] = unknowns.mean[RATE].max(0.0);
        let aside = BETWEEN * unknowns.mean[RATE] * compared.window_s;
        let density = density + compared.take_along(unknowns, &across, a, 0.0, aside);
        self.evidence
            .add(compared.start_ns, density - sound, threshold);
        density
    }

    /// What has been learned beside the turn of the ground, with the evidence for it; `None` where that is small.
    pub(super) fn learned(&self, threshold: f64) -> Option<(f64, Unknowns<UNKNOWNS>)> {
        let mut firm = self.unknowns;
        firm.draw(RATE, 0.0);
        (self.evidence.value > LIKELY * threshold).then_some((self.evidence.value, firm))
    }

    /// A hole: what has begun is forgotten.
    pub(super) fn forget(&mut self) {
        self.evidence = Evidence::default();
    }
}

fn begun(sound: &Unknowns<UNKNOWNS>) -> Unknowns<UNKNOWNS> {
    let mut unknowns = *sound;
    unknowns.draw(RATE, BEGINS);
    unknowns
}
