//! The watch over the rotation of a platform, sample by sample.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::attitude::UpByAttitude;
use super::edges::Edges;
use super::gyro::UpByGyro;
use super::outward::{Outward, OutwardTurn, ShownUp, TRAVELS};
use super::reference::{Claim, Reference, Step};
use super::speed::Speed;
use super::spell::{RotationSpell, RotationWitness, certainty};
use super::suspension::SuspensionPlane;
use crate::machine::Machine;
use crate::state::{Sample, Sensor, Sensors};

/// Standard deviations from which a rotation is certain.
const CERTAIN: f64 = 3.3;
/// Samples for which a rotation must last to be certain, and time (ns).
const SAMPLES: u32 = 3;
const LASTING_NS: i64 = 30_000_000;
/// Time for which a platform counts as falling after an unexplained outward rotation (ns): a fall that rolls its wheels, or hits
/// something, is certain later.
const STANDS_NS: i64 = 1_000_000_000;
/// Slower than this soft ground may give way (rad/s).
const FALLS: f64 = 2.5 * DEGREE;
/// Share of a rotation that the other source must show to agree.
const AGREES: f64 = 0.5;
/// Share of a rotation that the specific force must show to support it, and the least of it (rad), standing and moving.
const SUPPORTS: f64 = 0.15;
const LEAST_SUPPORT: [f64; 2] = [2.0 * DEGREE, 12.0 * DEGREE];
/// Share of gravity by which the specific force of a machine on its wheels may differ from it.
const STEADY_WEIGHT: f64 = 0.04;
/// Largest rotation of a platform that is back (standard deviations), its largest rate (rad/s), and the time for which it stays
/// so (s).
const BACK: f64 = 1.0;
const BACK_RATE: f64 = 5.0 * DEGREE;
const BACK_S: f64 = 0.5;
/// Lengths of the machine after which a platform that drives on stands on its wheels, and its largest rotation meanwhile (rad).
const DRIVEN_LENGTHS: f64 = 5.0;
const DRIVEN: f64 = 30.0 * DEGREE;
/// Largest rate of a platform at rest on its side (rad/s), and shortest duration (ns).
const REST_RATE: f64 = 3.0 * DEGREE;
const REST_NS: i64 = 200_000_000;
/// Rotation from which a platform at rest lies on its side (rad).
const ON_SIDE: f64 = 40.0 * DEGREE;
/// Largest change of the angle of a platform at rest (rad), and shortest duration (ns). The angle of a platform that balances on
/// an edge grows from the balance by exp(t sqrt(g / height)): after this time, to more than twenty times the first one.
const KEPT: f64 = 0.3 * DEGREE;
const KEPT_NS: i64 = 1_500_000_000;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Follows the rotation of a platform about the edges of its support polygon from raw samples, in order of arrival.
///
/// It needs no filter and no masses, and works offline and live. A step never allocates.
#[derive(Debug, Clone)]
pub struct PlatformRotation {
    edges: Edges,
    /// Axes of the IMU in the base; `None` where it is not on the base.
    base_from_imu: Option<Matrix3<f64>>,
    speed: Speed,
    suspension: Option<SuspensionPlane>,
    gyro: UpByGyro,
    attitude: UpByAttitude,
    pub(super) by_gyro: Source,
    pub(super) by_attitude: Source,
    /// Outward rotation of the platform by the gyro and by the attitude.
    outward: [Outward; 2],
    /// Number of samples in a row in which neither tyres nor ground explain the outward rotation.
    unexplained: u32,
    /// Stamp of the last of several such samples in a row (ns).
    unexplained_ns: Option<i64>,
    max_gap_ns: i64,
    last_ns: Option<i64>,
    last_speed: f64,
    spell: Option<RotationSpell>,
    ended: Option<RotationSpell>,
    /// Time for which the platform has been back (s), and the stamp since which it has rested (ns).
    back_s: f64,
    still_ns: Option<i64>,
    /// An angle (rad), and the stamp since which the platform has kept it (ns).
    kept: (f64, i64),
    driven: f64,
}

/// A source of the up direction.
#[derive(Debug, Clone, Default)]
pub(super) struct Source {
    pub(super) reference: Reference,
    last: Option<Shown>,
    /// Number of samples for which the source has claimed a rotation, and the stamp of the first (ns).
    claimed: Option<(u32, i64)>,
}

/// The last that a source shows.
#[derive(Debug, Clone, Copy)]
struct Shown {
    at_ns: i64,
    up: Vector3<f64>,
    rate: Vector3<f64>,
}

impl PlatformRotation {
    /// A watch before its first sample.
    #[must_use]
    pub fn new(machine: &Machine, sensors: &Sensors) -> Self {
        let imu = machine.imu();
        let base_from_imu = (sensors.imu && imu.body == 0).then(|| imu.rotation_in_body());
        let max_gap_s = machine.estimator().max_gap;
        let edges = Edges::of(machine);
        Self {
            outward: [Outward::new(&edges), Outward::new(&edges)],
            unexplained: 0,
            unexplained_ns: None,
            edges,
            speed: Speed::new(machine, sensors),
            suspension: SuspensionPlane::new(machine, sensors),
            gyro: UpByGyro::new(machine.gravity(), max_gap_s),
            attitude: UpByAttitude::new(base_from_imu.unwrap_or_else(Matrix3::identity), max_gap_s),
            base_from_imu,
            by_gyro: Source::default(),
            by_attitude: Source::default(),
            max_gap_ns: (max_gap_s * 1e9) as i64,
            last_ns: None,
            last_speed: 0.0,
            spell: None,
            ended: None,
            back_s: 0.0,
            still_ns: None,
            kept: (0.0, 0),
            driven: 0.0,
        }
    }

    /// The rotation that stands; `None` while the platform is on its supports as far as its motion shows.
    #[must_use]
    pub fn spell(&self) -> Option<&RotationSpell> {
        self.spell.as_ref()
    }

    /// The rotation that ended with the last sample.
    #[must_use]
    pub fn ended(&self) -> Option<&RotationSpell> {
        self.ended.as_ref()
    }

    /// Name of an edge.
    #[must_use]
    pub fn edge_name(&self, edge: usize) -> &str {
        self.edges.all.get(edge).map_or("", |edge| &edge.name)
    }

    /// Unit vector along an edge in base axes: a positive rotation about it is outwards.
    #[must_use]
    pub fn axis(&self, edge: usize) -> Vector3<f64> {
        (self.edges.all.get(edge)).map_or_else(Vector3::zeros, |edge| edge.axis)
    }

    /// Returns the rotation about an edge that the tyres allow, from the largest lean to one side to that to the other (rad);
    /// zero for an unknown edge.
    #[must_use]
    pub fn turn_on_tyres(&self, edge: usize) -> f64 {
        (self.edges.all.get(edge)).map_or(0.0, |edge| TRAVELS * edge.lean_on_tyres)
    }

    /// Returns the outward rotations of the platform about its edges, by the gyro, or else the attitude, at this stamp.
    pub fn outward_turns(&self, stamp_ns: i64) -> impl Iterator<Item = OutwardTurn> + '_ {
        self.turns_in(self.shown_at(stamp_ns))
    }

    fn turns_in(&self, shown: [Option<ShownUp>; 2]) -> impl Iterator<Item = OutwardTurn> + '_ {
        let which = shown.iter().position(Option::is_some);
        let attitude = shown[1];
        which.into_iter().flat_map(move |which| {
            let source = self.by(which == 0);
            let by_ground = |driven: f64, by_step: f64, settled: f64, width: f64| {
                let length = self.edges.length;
                (source.reference).by_ground(driven, by_step, settled, width, length)
            };
            (self.outward[which]).turns(&self.edges, attitude, which == 0, by_ground)
        })
    }

    /// Whether the platform falls: it rotates about an edge for certain, or turns outwards, or did shortly before, farther than
    /// tyres, suspension and the ground on the way of its wheels explain. False where neither gyro nor attitude has been measured
    /// for longer than the longest gap that is bridged.
    #[must_use]
    pub fn falls(&self, now_ns: i64) -> bool {
        let stands = |at_ns: i64| now_ns.saturating_sub(at_ns) < STANDS_NS;
        match &self.spell {
            Some(spell) => self.source_of(spell, now_ns).is_some(),
            None => {
                let is_measured = [true, false].map(|of| self.source(of, now_ns).is_some());
                self.unexplained_ns.is_some_and(stands) && is_measured.contains(&true)
            }
        }
    }

    /// Returns attitude and motion of the platform by the gyro and by the attitude; `None` for a source that was not measured at
    /// this stamp.
    #[must_use]
    pub fn shown_at(&self, stamp_ns: i64) -> [Option<ShownUp>; 2] {
        let of = |source: &Source| {
            let shown = source.last.filter(|shown| shown.at_ns == stamp_ns)?;
            Some(ShownUp {
                up: shown.up,
                reference_up: source.reference.up()?,
                rate: shown.rate,
            })
        };
        [of(&self.by_gyro), of(&self.by_attitude)]
    }

    /// Takes a sample as it was measured.
    pub fn step(&mut self, sample: &Sample<'_>) {
        self.ended = None;
        match sample.sensor {
            Sensor::Joints(_) => {
                self.speed.take(sample);
                let leant = self.suspension.as_mut().and_then(|it| it.take(sample));
                if let Some(leant) = leant {
                    self.by_gyro.reference.lean(&leant);
                    self.by_attitude.reference.lean(&leant);
                    for outward in &mut self.outward {
                        outward.lean(&leant);
                    }
                }
            }
            Sensor::Odometry => {
                self.speed.take(sample);
                if self.base_from_imu.is_none() {
                    self.take_motion(sample, &Matrix3::identity());
                }
            }
            Sensor::Imu => {
                if let Some(base_from_imu) = self.base_from_imu {
                    self.take_motion(sample, &base_from_imu);
                }
            }
            Sensor::ToolWrench | Sensor::Number(..) => {}
        }
    }

    /// Takes the ten values of an IMU or of odometry: three, angular velocity, orientation.
    fn take_motion(&mut self, sample: &Sample<'_>, base_from_sensor: &Matrix3<f64>) {
        let &[x, y, z, turning_x, turning_y, turning_z, ref xyzw @ ..] = sample.values else {
            return;
        };
        let now_ns = sample.stamp_ns;
        let force = (sample.sensor == Sensor::Imu)
            .then(|| base_from_sensor * Vector3::new(x, y, z))
            .filter(|force| force.iter().all(|f| f.is_finite()));
        let turning = base_from_sensor * Vector3::new(turning_x, turning_y, turning_z);
        let speed = self.speed.at(now_ns);
        let assumed = Speed::assumed(speed);
        let stands = self.spell.is_some();
        let by_attitude = self.attitude.step(now_ns, xyzw, speed);
        let of_attitude = self.attitude.up(now_ns);
        self.skip_gap(now_ns, assumed);
        // the angular velocity of an odometry is part of its attitude, or that of a plane
        let by_gyro = match sample.sensor {
            Sensor::Imu => (self.gyro).step(now_ns, &turning, force, speed, of_attitude),
            _ => None,
        };
        if let (Sensor::Odometry, Some(shown)) = (sample.sensor, &by_attitude)
            && turning.z.is_finite()
        {
            self.by_attitude.reference.turn(turning.z * shown.dt);
        }
        if let Some(shown) = by_gyro {
            let yaw = shown.rate.z * shown.dt;
            self.by_gyro.reference.turn(yaw);
            self.by_attitude.reference.turn(yaw);
            let across = shown.rate - shown.up * shown.up.dot(&shown.rate);
            let step = Step {
                now_ns,
                dt: shown.dt,
                up: shown.up,
                sigma: shown.sigma,
                rate: across.norm(),
                speed: assumed,
                is_quiet: shown.is_quiet,
            };
            self.by_gyro.take(&step, shown.rate, &self.edges, stands);
        }
        if let Some(shown) = by_attitude {
            let step = Step {
                now_ns,
                dt: shown.dt,
                up: shown.up,
                sigma: shown.sigma,
                rate: shown.rate.norm(),
                speed: assumed,
                is_quiet: shown.is_quiet,
            };
            self.by_attitude
                .take(&step, shown.rate, &self.edges, stands);
        }
        if by_gyro.is_none() && by_attitude.is_none() {
            return;
        }
        let dt = by_gyro.map_or_else(|| by_attitude.map_or(0.0, |it| it.dt), |it| it.dt);
        let shown = self.shown_at(now_ns);
        // a platform that turns over its wheels moves without travelling
        let turning = (shown.iter().flatten().next()).map_or(Vector2::zeros(), |of| of.rate.xy());
        let moved = Vector2::new(turning.y, -turning.x) * self.edges.height;
        let rolling = self.speed.rolling(now_ns, &moved);
        let settled = [&self.by_gyro, &self.by_attitude].map(|it| it.reference.settled());
        let of_sources = shown.iter().zip(settled);
        for (outward, (of_source, settled)) in self.outward.iter_mut().zip(of_sources) {
            if let Some(of_source) = of_source {
                let attitude = shown[1].as_ref();
                outward.take(&self.edges, now_ns, of_source, attitude, rolling, settled);
            }
        }
        let is_unexplained =
            (self.turns_in(shown)).any(|turn| turn.has_left_ground() && turn.rate > FALLS);
        self.unexplained = match is_unexplained {
            true => self.unexplained.saturating_add(1),
            false => 0,
        };
        if self.unexplained >= SAMPLES {
            self.unexplained_ns = Some(now_ns);
        }
        match self.spell {
            Some(spell) => {
                self.driven += assumed * dt;
                self.go_on(spell, now_ns, dt);
            }
            None => self.begin(now_ns, speed),
        }
    }

    /// Skips a gap: the ground under the machine is as unknown after it as the distance travelled in it.
    fn skip_gap(&mut self, now_ns: i64, speed: f64) {
        let last_ns = self.last_ns.replace(now_ns);
        let speed = std::mem::replace(&mut self.last_speed, speed).max(speed);
        let gap_ns = last_ns.map_or(0, |last_ns| now_ns.saturating_sub(last_ns));
        if gap_ns > self.max_gap_ns {
            let travelled = speed * gap_ns as f64 * 1e-9;
            self.by_gyro.reference.skip(travelled);
            self.by_attitude.reference.skip(travelled);
        }
    }

    /// The source by the gyro, or by the attitude.
    fn by(&self, is_gyro: bool) -> &Source {
        if is_gyro {
            &self.by_gyro
        } else {
            &self.by_attitude
        }
    }

    /// The source that shows a rotation or the other one, if it is up to date.
    fn source(&self, is_gyro: bool, now_ns: i64) -> Option<(&Source, Shown)> {
        let source = self.by(is_gyro);
        let shown =
            (source.last).filter(|shown| now_ns.saturating_sub(shown.at_ns) <= self.max_gap_ns)?;
        Some((source, shown))
    }

    /// Returns the source that a spell is followed by (true: the gyro) and its measurement: that of the witness, or the other
    /// source where both had shown the rotation and the witness is silent.
    fn source_of(&self, spell: &RotationSpell, now_ns: i64) -> Option<(bool, &Source, Shown)> {
        let is_gyro = spell.witness.is_by_gyro();
        let of = |is_gyro| {
            let (source, shown) = self.source(is_gyro, now_ns)?;
            Some((is_gyro, source, shown))
        };
        of(is_gyro).or_else(|| of(!is_gyro).filter(|_| spell.witness == RotationWitness::Both))
    }

    /// Begins a spell where a source shows one that is not refuted.
    fn begin(&mut self, now_ns: i64, speed: Option<f64>) {
        let mut best: Option<(bool, RotationWitness)> = None;
        for is_gyro in [true, false] {
            let source = self.by(is_gyro);
            let lasts = source.claimed.is_some_and(|(samples, since_ns)| {
                samples >= SAMPLES && now_ns.saturating_sub(since_ns) >= LASTING_NS
            });
            if !lasts {
                continue;
            }
            let witness = self.witness(is_gyro, now_ns, speed);
            let is_better = |(_, before): (bool, RotationWitness)| {
                witness.is_some_and(|witness| witness.soundness() > before.soundness())
            };
            if let Some(witness) = witness.filter(|_| best.is_none_or(is_better)) {
                best = Some((is_gyro, witness));
            }
        }
        let Some((is_gyro, witness)) = best else {
            return;
        };
        let source = self.by(is_gyro);
        let (reference, claim) = (&source.reference, source.reference.claim);
        let axis = self.edges.all[claim.edge].axis;
        self.spell = Some(RotationSpell {
            edge: claim.edge,
            other_edge: self
                .other_edge(now_ns)
                .filter(|_| witness == RotationWitness::OtherEdges),
            left_ns: reference.left_ns.unwrap_or(now_ns),
            certain_ns: now_ns,
            angle: claim.angle,
            rate: source.last.map_or(0.0, |shown| axis.dot(&shown.rate)),
            largest: claim.angle,
            largest_ns: now_ns,
            sigma: claim.sigma,
            witness,
            by_ground: claim.by_ground,
            certainty: certainty(&claim, witness),
            at_rest_ns: None,
            rested_ns: None,
            is_from_start: reference.is_assumed(),
            last_ns: now_ns,
        });
        (self.back_s, self.still_ns, self.driven) = (0.0, None, 0.0);
        self.kept = (claim.angle, now_ns);
    }

    /// Returns the witness of a source's claim; `None` if the other source and the specific force refute the claim.
    fn witness(&self, is_gyro: bool, now_ns: i64, speed: Option<f64>) -> Option<RotationWitness> {
        use RotationWitness::{
            AttitudeAlone, AttitudeNotGyro, Both, GyroAlone, GyroNotAttitude, OtherEdges,
        };
        let source = self.by(is_gyro);
        let claim = source.reference.claim;
        let axis = self.edges.all[claim.edge].axis;
        let is_measured = !is_gyro || !self.attitude.is_frozen(now_ns);
        let other = self.source(!is_gyro, now_ns).filter(|_| is_measured);
        let [alone, against] = match is_gyro {
            true => [GyroAlone, GyroNotAttitude],
            false => [AttitudeAlone, AttitudeNotGyro],
        };
        let Some((other, shown)) = other else {
            let refuted = is_gyro && speed == Some(0.0) && self.is_force_steady(&claim, source);
            return (!refuted).then_some(alone);
        };
        let angle = other.reference.rotation(&shown.up, &axis).unwrap_or(0.0);
        if angle >= AGREES * claim.angle {
            return Some(Both);
        }
        if self.other_edge(now_ns).is_some() {
            // the numbers are those of the attitude
            return (!is_gyro).then_some(OtherEdges);
        }
        let Some(force) = self.gyro.force_direction() else {
            // nothing decides between both: a gyro may drift, an attitude does not
            return (!is_gyro).then_some(against);
        };
        let by_force = source.reference.rotation(&force, &axis)?;
        let least = LEAST_SUPPORT[usize::from(speed != Some(0.0))];
        (by_force >= least.max(SUPPORTS * claim.angle)).then_some(against)
    }

    /// The edge that the gyro shows where the attitude shows another one, and neither tyres nor ground explain either of them:
    /// no error of a sensor turns both as far at the same time, but one with wrong axes shows a fall about another edge.
    fn other_edge(&self, now_ns: i64) -> Option<usize> {
        let (gyro, by_gyro) = self.source(true, now_ns)?;
        let (attitude, by_attitude) = self.source(false, now_ns)?;
        (gyro.claimed.and(attitude.claimed)).filter(|_| !self.attitude.is_frozen(now_ns))?;
        let [one, other] = [
            gyro.reference.apart(&by_gyro.up)?,
            attitude.reference.apart(&by_attitude.up)?,
        ];
        let (edge, claim) = (gyro.reference.claim.edge, attitude.reference.claim);
        let axis = self.edges.all[claim.edge].axis;
        let about_same = gyro.reference.rotation(&by_gyro.up, &axis)?;
        (one.min(other) >= AGREES * one.max(other)
            && edge != claim.edge
            && about_same < AGREES * claim.angle)
            .then_some(edge)
    }

    /// Whether the specific force stays where it is on a machine on its wheels: in a falling machine it turns or changes its
    /// length, whichever way the machine falls.
    fn is_force_steady(&self, claim: &Claim, source: &Source) -> bool {
        let Some(share) = self.gyro.weight_share() else {
            return false;
        };
        let turned = (self.gyro.force_direction())
            .and_then(|force| source.reference.apart(&force))
            .unwrap_or(0.0);
        turned < LEAST_SUPPORT[0].max(SUPPORTS * claim.angle) && share.abs() < STEADY_WEIGHT
    }

    /// Follows a spell, and ends it once the platform is back.
    fn go_on(&mut self, mut spell: RotationSpell, now_ns: i64, dt: f64) {
        use RotationWitness::{AttitudeNotGyro, Both, GyroNotAttitude, OtherEdges};
        if !spell.witness.is_both()
            && let Some(edge) = self.other_edge(now_ns)
        {
            let claim = self.by_attitude.reference.claim;
            (spell.witness, spell.edge, spell.other_edge) = (OtherEdges, claim.edge, Some(edge));
            (spell.sigma, spell.by_ground) = (claim.sigma, claim.by_ground);
            (spell.largest, spell.largest_ns) = (claim.angle, now_ns);
        }
        let Some((is_gyro, source, shown)) = self.source_of(&spell, now_ns) else {
            return;
        };
        // a platform that falls over a corner ends on the edge that it rotates about most; one that tumbles on rotates about
        // no edge of its wheels
        if self.edges.all.len() > 1
            && shown.at_ns == now_ns
            && spell.largest < RotationSpell::TUMBLES
        {
            let claim = source.reference.claim;
            if claim.angle > 1.2 * spell.angle.max(spell.largest) && claim.edge != spell.edge {
                // about an edge that the other source shows, it is about that or the one before
                if spell.other_edge == Some(claim.edge) {
                    spell.other_edge = Some(spell.edge);
                }
                spell.edge = claim.edge;
                // they belong to an edge
                (spell.sigma, spell.by_ground) = (claim.sigma, claim.by_ground);
            }
        }
        let axis = self.edges.all[spell.edge].axis;
        let Some(angle) = source.reference.rotation(&shown.up, &axis) else {
            return;
        };
        spell.angle = angle;
        spell.rate = axis.dot(&shown.rate);
        spell.last_ns = now_ns;
        if angle > spell.largest {
            (spell.largest, spell.largest_ns) = (angle, now_ns);
        }
        let is_measured = !is_gyro || !self.attitude.is_frozen(now_ns);
        let other = self.source(!is_gyro, now_ns).filter(|_| is_measured);
        if let Some((other, shown)) = other {
            let of_other = other.reference.rotation(&shown.up, &axis).unwrap_or(0.0);
            let agrees = of_other >= AGREES * spell.largest;
            spell.witness = match spell.witness {
                _ if agrees => Both,
                // what agreed before does not count as a contradiction while the platform comes back
                both if both.is_both() => both,
                _ if angle < AGREES * spell.largest => spell.witness,
                _ if is_gyro => GyroNotAttitude,
                _ => AttitudeNotGyro,
            };
            spell.other_edge = spell.other_edge.filter(|_| spell.witness == OtherEdges);
            if spell.witness.is_by_gyro() != is_gyro && other.reference.claim.edge == spell.edge {
                let claim = other.reference.claim;
                (spell.sigma, spell.by_ground) = (claim.sigma, claim.by_ground);
            }
        }
        let largest = Claim {
            edge: spell.edge,
            angle: spell.largest,
            sigma: spell.sigma,
            by_ground: spell.by_ground,
        };
        spell.certainty = certainty(&largest, spell.witness);
        // about the edge, a platform on its roof is turned by anything: the rotation passes from half a turn to minus half a turn
        let tilt = source.reference.apart(&shown.up).unwrap_or(angle);
        let is_still = spell.rate.abs() < REST_RATE && tilt >= ON_SIDE;
        if !is_still {
            self.still_ns = None;
            spell.at_rest_ns = None;
        } else {
            let since_ns = *self.still_ns.get_or_insert(now_ns);
            if now_ns.saturating_sub(since_ns) >= REST_NS {
                spell.at_rest_ns.get_or_insert(since_ns);
            }
        }
        if (angle - self.kept.0).abs() > KEPT {
            self.kept = (angle, now_ns);
        }
        let rests = now_ns.saturating_sub(self.kept.1) >= KEPT_NS;
        if rests && angle > BACK * spell.sigma && tilt < ON_SIDE {
            spell.rested_ns.get_or_insert(self.kept.1);
        } else if tilt >= ON_SIDE {
            spell.rested_ns = None;
        }
        let is_back = angle < BACK * spell.sigma && tilt < ON_SIDE && spell.rate.abs() < BACK_RATE;
        self.back_s = if is_back { self.back_s + dt } else { 0.0 };
        let is_driven = self.driven > DRIVEN_LENGTHS * self.edges.length && tilt < DRIVEN;
        if self.back_s >= BACK_S || is_driven {
            self.ended = Some(spell);
            self.spell = None;
            for source in [&mut self.by_gyro, &mut self.by_attitude] {
                source.claimed = None;
                if let Some(shown) = source.last {
                    source.reference.begin(shown.up);
                }
            }
            return;
        }
        self.spell = Some(spell);
    }
}

impl Source {
    fn take(&mut self, step: &Step, rate: Vector3<f64>, edges: &Edges, stands: bool) {
        self.reference.step(step, edges, stands);
        self.last = Some(Shown {
            at_ns: step.now_ns,
            up: step.up,
            rate,
        });
        self.claimed = match self.reference.claim.sigmas_beyond_ground() >= CERTAIN {
            true => {
                let (samples, since_ns) = self.claimed.unwrap_or((0, step.now_ns));
                Some((samples.saturating_add(1), since_ns))
            }
            false => None,
        };
    }
}
