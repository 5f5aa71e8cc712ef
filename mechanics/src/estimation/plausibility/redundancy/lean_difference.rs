//! Whether the platform leans as the arm requires: the difference between the lean b by the gyro and the lean a by the
//! joints.
//!
//! ```text
//!     b = s a + n
//! ```
//! about each of the axes x and y. The compliance s of tyres and ground, relative to that in the machine file, is known
//! roughly and follows from the lean itself, by a Kalman filter for each axis (variance P). The difference `e = b - s a`
//! is split into a part in the direction in which a load on the tool leans the platform, and one across:
//! ```text
//!     variance across       v = s0^2 + r^2 (|a|^2 + |b|^2) / 2 + (P a^2)
//!     variance by a load    v + u^2
//!     d = min(sum e^2 / (2 v), c) - k (|a|^2 + |b|^2) / (|a|^2 + |b|^2 + 4 s0^2)
//!     S <- clamp(S + d dt / T)
//! ```
//! with s0 the lean that has other causes, r what the model is off by, u the lean by a small load that nothing measures,
//! and T the time over which errors are alike. The subtrahend is the refutation: motion that the platform follows.
//! Without motion the evidence neither grows nor, once it stands, shrinks.
//!
//! While an encoder of the arm stands still bit for bit among others that flicker ([`super::standstill`]), a second
//! evidence grows with a smaller u and r: there, lean like that by a load speaks for the encoder that has stopped.
//!
//! A third evidence grows with the same while a wheel that the joints say is loaded carries next to nothing by the lean:
//! ```text
//!     load_i = k_i (z_i by the moment of the joints + e_y (x_i - x_c) / s - e_x (y_i - y_c) / s)
//! ```
//! There no unknown load is an excuse: whatever leans the platform, the computed loads are wrong where it matters. This
//! finds an encoder that has stopped though it flickers like the others.
//!
//! A stopped, swapped, shifted or scaled encoder, a wrong sign and a gyro that measures something else all leave such a
//! difference. So do a load or a force that nothing measures, if they are large: these are not told apart.

use nalgebra::{Matrix2, Vector2};

use super::evidence::Evidence;
use super::lean_model::Lean;

/// Time over which errors are alike (s).
const ALIKE_S: f64 = 0.15;
/// What the model is off by, as a share.
const MODEL: f64 = 0.15;
/// Lean by a small load that nothing measures (rad).
const SMALL_LOAD: f64 = 6e-4;
/// The same two for an encoder that stands out, and for a wheel that is light.
const STRICT_MODEL: f64 = 0.08;
const STRICT_LOAD: f64 = 1.5e-4;
/// Load of a wheel by the lean below which it is light, as a share of the mean load.
const LIGHT: f64 = 0.3;
/// Most that one moment may show.
const MOST: f64 = 9.0;
/// What a good moment refutes.
const REFUTED: f64 = 1.2;
/// What is forgotten of evidence that does not stand.
const FORGOTTEN: f64 = 0.1;
/// Time in which the compliance may change (s): the machine moves to other ground.
const OTHER_GROUND_S: f64 = 30.0;

/// What is known about the compliance beforehand.
#[derive(Debug, Clone, Copy)]
struct Prior {
    variance: f64,
    least: f64,
    greatest: f64,
}

/// Stiffness of the tyres stated: ground gives way too, and tyres may be stiffer than stated.
const STATED: Prior = Prior {
    variance: 0.16,
    least: 0.3,
    greatest: 4.0,
};
/// Stiffness unknown, or wheels on a suspension.
const UNKNOWN: Prior = Prior {
    variance: 2.25,
    least: 0.02,
    greatest: 10.0,
};

/// State of the comparison.
#[derive(Debug, Clone)]
pub(super) struct LeanDifference {
    prior: Prior,
    compliance: Vector2<f64>,
    variance: Vector2<f64>,
    evidence: Evidence,
    /// That an encoder which stands out has stopped.
    of_standstill: Evidence,
    stands_out: bool,
    /// That a wheel is lighter than the joints say.
    of_light_wheel: Evidence,
}

impl LeanDifference {
    pub(super) fn new(stiffness_is_known: bool) -> Self {
        let prior = if stiffness_is_known { STATED } else { UNKNOWN };
        Self {
            prior,
            compliance: Vector2::repeat(1.0),
            variance: Vector2::repeat(prior.variance),
            evidence: Evidence::default(),
            of_standstill: Evidence::default(),
            stands_out: false,
            of_light_wheel: Evidence::default(),
        }
    }

    /// Whether an encoder of the arm stands out. One that moves again refutes its standstill.
    pub(super) fn expect_standstill(&mut self, stands_out: bool) {
        self.stands_out = stands_out;
        if !stands_out {
            self.of_standstill = Evidence::default();
        }
    }

    /// The evidence of another lean, of an encoder that has stopped, and of a wheel that is lighter than the joints say.
    pub(super) fn evidences(&mut self) -> [&mut Evidence; 3] {
        [
            &mut self.evidence,
            &mut self.of_standstill,
            &mut self.of_light_wheel,
        ]
    }

    /// What has just begun is forgotten.
    pub(super) fn forget(&mut self) {
        self.evidences().into_iter().for_each(Evidence::forget);
    }

    /// All evidence is forgotten.
    pub(super) fn clear(&mut self) {
        for evidence in self.evidences() {
            *evidence = Evidence::default();
        }
    }

    /// Weighs a sample. `noise`: variance of the lean that has other causes, and of that where the strict limits hold;
    /// `rocking`: how much of it the ground may cause, 0 to 1. `least_load` gives the smallest load of a wheel, as a share of
    /// the mean load, if the platform leans by so much (rad) more than the joints say.
    pub(super) fn weigh(
        &mut self,
        [stamp_ns, step_ns]: [i64; 2],
        lean: &Lean,
        [a, b]: [&Vector2<f64>; 2],
        [noise, strict_noise]: [f64; 2],
        rocking: f64,
        least_load: impl Fn(&Vector2<f64>) -> f64,
    ) {
        let step_s = step_ns as f64 * 1e-9;
        let size = a.norm_squared() + b.norm_squared();
        let difference = b - self.compliance.component_mul(a);
        let common = noise + MODEL * MODEL * size / 2.0;
        // The ground turns a machine that travels.
        let can_show = if lean.is_beyond_model {
            0.0
        } else {
            1.0 - rocking
        };
        let shows = |evidence: &Evidence, noise: f64, [model, load]: [f64; 2]| {
            let common = noise + model * model * size / 2.0;
            let against = self.against(lean, [a, &difference], common, load);
            let mut gained = against.min(MOST) - REFUTED * size / (size + 4.0 * noise);
            if gained > 0.0 {
                gained *= can_show;
            }
            if !evidence.stands {
                gained -= FORGOTTEN;
            }
            gained * step_s / ALIKE_S
        };
        let gained = shows(&self.evidence, noise, [MODEL, SMALL_LOAD]);
        let strict = [STRICT_MODEL, STRICT_LOAD];
        let of_standstill =
            (self.stands_out).then(|| shows(&self.of_standstill, strict_noise, strict));
        let of_light_wheel = shows(&self.of_light_wheel, strict_noise, strict);
        let counts = of_light_wheel < 0.0 || self.unloads(&difference, least_load);
        self.evidence.add(stamp_ns, gained);
        if let Some(gained) = of_standstill {
            self.of_standstill.add(stamp_ns, gained);
        }
        if counts {
            self.of_light_wheel.add(stamp_ns, of_light_wheel);
        }
        if can_show > 0.7 {
            self.learn(step_s, [a, &difference], common);
        }
    }

    /// Whether a wheel is light by the lean, and lighter than the joints say.
    fn unloads(
        &self,
        difference: &Vector2<f64>,
        least_load: impl Fn(&Vector2<f64>) -> f64,
    ) -> bool {
        // Before the lean has told the stiffness, it tells no load.
        if self.variance.max() > STATED.variance {
            return false;
        }
        let by_lean = least_load(&difference.component_div(&self.compliance));
        by_lean < LIGHT && by_lean < least_load(&Vector2::zeros())
    }

    /// What the difference shows across the direction of a load, and along it.
    fn against(
        &self,
        lean: &Lean,
        [a, difference]: [&Vector2<f64>; 2],
        common: f64,
        load: f64,
    ) -> f64 {
        let doubt = Matrix2::from_diagonal(&self.variance.component_mul(&a.component_mul(a)));
        let along = lean.by_load;
        let across = Vector2::new(-along.y, along.x);
        let is_known = along != Vector2::zeros();
        let (axes, small_load) = match is_known {
            true => ([across, along], load * load),
            false => ([Vector2::x(), Vector2::y()], 0.0),
        };
        let mut against = 0.0;
        for (axis, extra) in axes.into_iter().zip([0.0, small_load]) {
            let variance = common + extra + (doubt * axis).dot(&axis);
            against += difference.dot(&axis).powi(2) / (2.0 * variance);
        }
        against
    }

    /// Kalman filter of the compliance about each axis.
    fn learn(&mut self, step_s: f64, [a, difference]: [&Vector2<f64>; 2], noise: f64) {
        if step_s <= 0.0 {
            return;
        }
        let Prior {
            variance: most,
            least,
            greatest,
        } = self.prior;
        for axis in 0..2 {
            let (known, a) = (self.variance[axis], a[axis]);
            let gain = known * a / (noise * ALIKE_S / step_s + known * a * a);
            let better = self.compliance[axis] + gain * difference[axis];
            // Written so that NaN is not learned.
            if !better.is_finite() {
                continue;
            }
            self.compliance[axis] = better.clamp(least, greatest);
            let changed = most * step_s / OTHER_GROUND_S;
            self.variance[axis] = ((1.0 - gain * a) * known + changed).min(most);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: f64 = 8.0;
    /// Step of the samples (ns).
    const STEP_NS: i64 = 8_000_000;

    /// Time after which `stands` holds (s), in 20 s. `leans` gives predicted and measured lean (rad) at a time.
    fn first_s(
        mut difference: LeanDifference,
        rocking: f64,
        least_load: fn(&Vector2<f64>) -> f64,
        leans: impl Fn(f64) -> [Vector2<f64>; 2],
        stands: impl Fn(&mut LeanDifference) -> bool,
    ) -> Option<f64> {
        (0..2500_i64).find_map(|step| {
            let (stamp_ns, time_s) = (step * STEP_NS, step as f64 * 8e-3);
            let lean = Lean {
                angle: Vector2::zeros(),
                by_load: Vector2::x(),
                moment: Vector2::zeros(),
                is_beyond_model: false,
            };
            let [a, b] = leans(time_s);
            let stamps = [stamp_ns, STEP_NS];
            difference.weigh(stamps, &lean, [&a, &b], [4e-8; 2], rocking, least_load);
            stands(&mut difference).then_some(time_s)
        })
    }

    /// Wheels that stay loaded.
    fn heavy(_: &Vector2<f64>) -> f64 {
        0.9
    }

    /// Time after which a wheel counts as lighter than the joints say (s). `least_load` gives the smallest load of a wheel for
    /// a lean beyond that by the joints.
    fn light_after_s(
        least_load: fn(&Vector2<f64>) -> f64,
        leans: impl Fn(f64) -> [Vector2<f64>; 2],
    ) -> Option<f64> {
        let difference = LeanDifference::new(true);
        first_s(difference, 0.0, least_load, leans, |difference| {
            difference.of_light_wheel.stands(LIMIT).is_some()
        })
    }

    /// Time after which the evidence stands (s).
    fn found_after_s(
        known: bool,
        rocking: f64,
        leans: impl Fn(f64) -> [Vector2<f64>; 2],
    ) -> Option<f64> {
        let difference = LeanDifference::new(known);
        first_s(difference, rocking, heavy, leans, |difference| {
            difference.evidence.stands(LIMIT).is_some()
        })
    }

    /// Time after which an encoder that stands out counts as stopped (s).
    fn standstill_after_s(
        stands_out: bool,
        leans: impl Fn(f64) -> [Vector2<f64>; 2],
    ) -> Option<f64> {
        let mut difference = LeanDifference::new(true);
        difference.expect_standstill(stands_out);
        first_s(difference, 0.0, heavy, leans, |difference| {
            difference.of_standstill.stands(LIMIT).is_some()
        })
    }

    /// An arm that swings and reaches out (rad).
    fn arm(time_s: f64) -> Vector2<f64> {
        Vector2::new(
            2e-3 * (1.5 * time_s).sin(),
            1.5e-3 * (1.1 * time_s + 0.7).sin(),
        )
    }

    fn noise(time_s: f64) -> Vector2<f64> {
        Vector2::new((37.0 * time_s).sin(), (41.0 * time_s).cos()) * 2e-4
    }

    #[test]
    fn platform_that_follows_is_right_on_soft_and_stiff_ground() {
        for compliance in [0.6, 1.0, 2.0] {
            let follows = |t: f64| [arm(t), arm(t) * compliance + noise(t)];
            assert_eq!(found_after_s(true, 0.0, follows), None, "{compliance}");
        }
        for compliance in [0.1, 5.0] {
            let follows = |t: f64| [arm(t), arm(t) * compliance + noise(t)];
            assert_eq!(found_after_s(false, 0.0, follows), None, "{compliance}");
        }
    }

    #[test]
    fn other_motion_is_found() {
        type Leans = fn(f64) -> [Vector2<f64>; 2];
        let wrong: [Leans; 4] = [
            |t| [arm(t), -arm(t)],
            |t| [arm(t), arm(t).yx()],
            |t| [Vector2::zeros(), arm(t)],
            |t| [arm(t), Vector2::new(arm(t).x, -arm(t).y)],
        ];
        // During the first two seconds the swapped axes move alike.
        for (leans, latest_s) in wrong.into_iter().zip([1.5, 5.0, 1.5, 3.0]) {
            let found_s = found_after_s(true, 0.0, leans);
            assert!(
                found_s.is_some_and(|s| s < latest_s),
                "{found_s:?}, not by {latest_s}"
            );
        }
        // Without a stated stiffness, a platform that hardly leans proves nothing.
        assert_eq!(found_after_s(false, 0.0, |t| [arm(t), noise(t)]), None);
    }

    #[test]
    fn a_stopped_encoder_that_stands_out_is_found_where_a_load_would_be_excused() {
        // The arm reaches out by 0.9 mrad within two seconds; its encoder says that it does not.
        let reach = |t: f64| Vector2::new(9e-4 * ((t - 4.0) / 2.0).clamp(0.0, 1.0), 0.0);
        let leans = |t: f64| [arm(t) * 0.3, arm(t) * 0.3 + reach(t) + noise(t) * 0.3];
        assert_eq!(found_after_s(true, 0.0, leans), None);
        let found = standstill_after_s(true, leans);
        assert!(found.is_some_and(|s| (4.5..6.5).contains(&s)), "{found:?}");
        // Whether one stands out or not: a platform that follows contradicts nothing.
        for compliance in [0.6, 1.0, 1.5] {
            let follows = |t: f64| [arm(t), arm(t) * compliance + noise(t)];
            assert_eq!(standstill_after_s(true, follows), None, "{compliance}");
        }
        assert_eq!(standstill_after_s(false, leans), None);
    }

    #[test]
    fn no_load_excuses_a_wheel_that_is_light_by_the_lean() {
        // The arm reaches out by 0.9 mrad within two seconds; its encoder flickers like the others, and says that it does not.
        let reach = |t: f64| Vector2::new(9e-4 * ((t - 4.0) / 2.0).clamp(0.0, 1.0), 0.0);
        let leans = |t: f64| [arm(t) * 0.3, arm(t) * 0.3 + reach(t) + noise(t) * 0.3];
        // One wheel gets light by it, one stays loaded, and one is light by the joints alone.
        let lighter = |more: &Vector2<f64>| 0.35 - 400.0 * more.x;
        let found = light_after_s(lighter, leans);
        assert!(found.is_some_and(|s| (4.5..6.5).contains(&s)), "{found:?}");
        assert_eq!(light_after_s(heavy, leans), None);
        assert_eq!(light_after_s(|more| 0.2 + 400.0 * more.x, leans), None);
        // A platform that follows contradicts nothing, however light its wheels are.
        for compliance in [0.6, 1.0, 1.5] {
            let follows = |t: f64| [arm(t), arm(t) * compliance + noise(t)];
            assert_eq!(light_after_s(lighter, follows), None, "{compliance}");
        }
        // Where the stiffness is not known, the lean tells no load.
        let unknown = LeanDifference::new(false);
        let stands = |it: &mut LeanDifference| it.of_light_wheel.stands(LIMIT).is_some();
        let still = |t: f64| [Vector2::zeros(), reach(t)];
        assert_eq!(first_s(unknown, 0.0, lighter, still, stands), None);
    }

    #[test]
    fn neither_noise_nor_uneven_ground_nor_a_small_load_is_evidence() {
        assert_eq!(
            found_after_s(true, 0.0, |t| [Vector2::zeros(), noise(t)]),
            None
        );
        assert_eq!(
            found_after_s(true, 1.0, |t| [Vector2::zeros(), arm(t)]),
            None
        );
        // 0.7 mrad in the direction of the tool.
        let loaded = |t: f64| {
            let taken = if (4.0..6.0).contains(&t) { 7e-4 } else { 0.0 };
            [arm(t), arm(t) + Vector2::new(taken, 0.0)]
        };
        assert_eq!(found_after_s(true, 0.0, loaded), None);
    }
}
