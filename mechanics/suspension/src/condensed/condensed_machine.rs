//! The machine at one instant, condensed: everything independent of the suspension is summed up per carrier.
//!
//! For given motion of the arm and wheel joints, the bodies on a carrier have constant moments in the carrier's
//! frame, the momenta p = sum m v and D = sum m r v' of their relative motion, and its wrench F_0. The wrench
//! that accelerates them is then affine in the carrier's acceleration and quadratic in its angular velocity w:
//! ```text
//!     S(2)   F = I (alpha, f) + w x I w + 2 w x (p, D) + F_0
//! ```

use nalgebra::{Matrix3, Vector3};

use super::carriers::Carriers;
use tipwatch_mechanics::dynamics::composite::{Composite, Field};
use tipwatch_mechanics::dynamics::kinematics::BodyMotion;
use tipwatch_mechanics::dynamics::newton_euler;
use tipwatch_mechanics::geometry::coordinate::Coordinate;
use tipwatch_mechanics::geometry::spatial::{Wrench, compose, cross, matrix, rotate_constant};
use tipwatch_mechanics::machine::{Machine, MassMoments};
use tipwatch_mechanics::number::Real;
use tipwatch_mechanics::state::State;

/// Everything on a carrier, itself included, about its origin in its axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carried {
    /// Mass, first and second moments.
    moments: MassMoments,
    /// p: sum m v of the motion relative to the carrier (kg m/s).
    momentum: Vector3<f64>,
    /// D: sum m r v' of the same (kg m^2/s).
    swept: Matrix3<f64>,
    /// F_0: wrench of the relative motion with the carrier at rest, minus the tool wrench.
    wrench: Wrench<f64>,
    /// Whether there is any relative motion or wrench.
    moves: bool,
}

impl Carried {
    fn nothing() -> Self {
        Self {
            moments: MassMoments {
                mass: 0.0,
                first: Vector3::zeros(),
                second: Matrix3::zeros(),
            },
            momentum: Vector3::zeros(),
            swept: Matrix3::zeros(),
            wrench: Wrench::zero(),
            moves: false,
        }
    }

    /// Adds the carrier's own body.
    fn add_itself(&mut self, body: &MassMoments) {
        self.moments.mass += body.mass;
        self.moments.first += body.first;
        self.moments.second += body.second;
    }

    fn add(&mut self, body: &MassMoments, motion: &BodyMotion<f64>, share: f64) {
        let moments = Composite::of(body, motion).scaled(share);
        let [xx, yy, zz, xy, xz, yz] = moments.second;
        self.moments.mass += moments.mass;
        self.moments.first += moments.first;
        self.moments.second += Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        self.momentum += moments.momentum;
        self.swept += moments.swept;
        self.wrench = self.wrench.plus(&moments.moved(motion));
    }
}

/// Moments and wrench of the whole machine, about the base origin in base axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Whole<T> {
    /// Moments, with momenta relative to the base.
    pub(crate) moments: Composite<T>,
    /// Wrench of the relative motions on a base at rest with zero specific force.
    pub(crate) wrench: Wrench<T>,
}

impl<T: Real> Whole<T> {
    pub(crate) fn nothing() -> Self {
        Self {
            moments: Composite::zero(),
            wrench: Wrench::zero(),
        }
    }

    /// Adds another one, converted from its number type.
    #[inline(always)]
    pub(crate) fn add<U: Real>(&mut self, other: &Whole<U>, convert: impl Fn(U) -> T) {
        let (sum, more) = (&mut self.moments, &other.moments);
        sum.mass += convert(more.mass);
        for k in 0..3 {
            sum.first[k] += convert(more.first[k]);
            sum.momentum[k] += convert(more.momentum[k]);
            self.wrench.force[k] += convert(other.wrench.force[k]);
            self.wrench.moment[k] += convert(other.wrench.moment[k]);
            for j in 0..3 {
                sum.swept[(k, j)] += convert(more.swept[(k, j)]);
            }
        }
        for (sum, &more) in sum.second.iter_mut().zip(&more.second) {
            *sum += convert(more);
        }
    }

    /// S(2): the ground wrench for a given base motion.
    pub(crate) fn moved(&self, base: &BodyMotion<T>) -> Wrench<T> {
        let w = &base.angular_velocity;
        let field = Field {
            angular: base.angular_acceleration,
            linear: base.specific_force,
        };
        self.moments
            .accelerated(&field)
            .plus(&self.moments.spun(w))
            .plus(&self.moments.coriolis(w))
            .plus(&self.wrench)
    }
}

/// The condensed machine; memory is reused every tick.
#[derive(Debug)]
pub(crate) struct Condensed {
    /// By carrier.
    pub(crate) carried: Vec<Carried>,
    /// Motion of every body relative to its carrier, in the carrier's frame.
    motions: Vec<BodyMotion<f64>>,
    /// Centre of each wheel in the frame of its carrier (m).
    pub(crate) wheel_centres: Vec<Vector3<f64>>,
}

impl Condensed {
    pub(crate) fn new(machine: &Machine, carriers: &Carriers) -> Self {
        let none = Vector3::zeros();
        Self {
            carried: vec![Carried::nothing(); carriers.carriers.len()],
            motions: vec![BodyMotion::base(none, none, none); machine.bodies().len()],
            wheel_centres: vec![none; machine.wheels().len()],
        }
    }

    /// Total mass (kg).
    pub(crate) fn mass(&self) -> f64 {
        self.carried
            .iter()
            .map(|carried| carried.moments.mass)
            .sum()
    }

    /// Condenses the machine for given coordinates of the joints.
    pub(crate) fn fill(
        &mut self,
        machine: &Machine,
        carriers: &Carriers,
        state: &State<f64>,
        coordinates: &[Coordinate<f64>],
    ) {
        let none = Vector3::zeros();
        self.carried.fill(Carried::nothing());
        for (i, body) in machine.bodies().iter().enumerate() {
            let carrier = carriers.of_body[i];
            self.motions[i] = if carriers.carriers[carrier].body == i {
                BodyMotion::base(none, none, none)
            } else {
                self.motions[body.parent].carry(body, &coordinates[i])
            };
            for (_, moments) in &body.parts {
                if carriers.carriers[carrier].body == i {
                    self.carried[carrier].add_itself(moments);
                } else {
                    self.carried[carrier].add(moments, &self.motions[i], 1.0);
                }
            }
        }
        for (payload, &share) in machine.payloads().iter().zip(&state.payload_share) {
            let carrier = carriers.of_body[payload.body];
            let motion = &self.motions[payload.body];
            self.carried[carrier].add(&payload.moments, motion, share);
        }
        if let Some(tool) = machine.tool() {
            let by_surroundings = newton_euler::tool_wrench(machine, state, &self.motions);
            let carried = &mut self.carried[carriers.of_body[tool.body]];
            carried.wrench = carried.wrench.minus(&by_surroundings);
        }
        for carried in &mut self.carried {
            carried.moves = carried.momentum != none
                || carried.swept != Matrix3::zeros()
                || carried.wrench != Wrench::zero();
        }
        for (centre, wheel) in self.wheel_centres.iter_mut().zip(machine.wheels()) {
            *centre = self.motions[wheel.body].point(&wheel.centre_in_body);
        }
    }
}

impl Carried {
    /// Adds everything on the carrier for its motion relative to a base at rest.
    #[inline(always)]
    pub(crate) fn add_moving<T: Real>(&self, motion: &BodyMotion<T>, whole: &mut Whole<T>) {
        let rigid = Composite::of(&self.moments, motion);
        whole.wrench = whole.wrench.plus(&rigid.moved(motion));
        whole.moments.add(&rigid);
        if self.moves {
            let (momentum, swept) = self.turned(motion);
            let own = Composite {
                momentum,
                swept,
                ..Composite::zero()
            };
            whole.wrench = whole.wrench.plus(&own.coriolis(&motion.angular_velocity));
            self.add_own(motion, momentum, &swept, whole);
        }
    }

    /// Adds the carrier at rest in this pose.
    #[inline(always)]
    pub(crate) fn add_resting<T: Real>(&self, pose: &BodyMotion<T>, whole: &mut Whole<T>) {
        let rigid = Composite::at_rest(&self.moments, pose);
        add_resting(&mut whole.moments, &rigid);
        if self.moves {
            let (momentum, swept) = self.turned(pose);
            self.add_own(pose, momentum, &swept, whole);
        }
    }

    /// p and D about the base origin in base axes: R p, R D R' + o (R p)'.
    fn turned<T: Real>(&self, pose: &BodyMotion<T>) -> (Vector3<T>, Matrix3<T>) {
        let (r, o) = (&pose.rotation, &pose.origin);
        let momentum = rotate_constant(r, &self.momentum);
        let half = compose(r, &self.swept);
        let swept = matrix(|i, j| {
            half[(i, 0)] * r[(j, 0)]
                + half[(i, 1)] * r[(j, 1)]
                + half[(i, 2)] * r[(j, 2)]
                + o[i] * momentum[j]
        });
        (momentum, swept)
    }

    fn add_own<T: Real>(
        &self,
        pose: &BodyMotion<T>,
        momentum: Vector3<T>,
        swept: &Matrix3<T>,
        whole: &mut Whole<T>,
    ) {
        whole.moments.momentum += momentum;
        whole.moments.swept += swept;
        let force = rotate_constant(&pose.rotation, &self.wrench.force);
        let moment = rotate_constant(&pose.rotation, &self.wrench.moment);
        whole.wrench = whole.wrench.plus(&Wrench {
            force,
            moment: moment + cross(&pose.origin, &force),
        });
    }
}

/// Adds the moments of bodies at rest.
#[inline(always)]
fn add_resting<T: Real>(moments: &mut Composite<T>, other: &Composite<T>) {
    moments.mass += other.mass;
    moments.first += other.first;
    for (sum, more) in moments.second.iter_mut().zip(other.second) {
        *sum += more;
    }
}
