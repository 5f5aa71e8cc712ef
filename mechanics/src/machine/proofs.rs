//! What the loads hang on and what a commissioning or a motion can prove of it: signals, and the ground under the wheels.

use std::f64::consts::{PI, TAU};

use super::checked::Machine;
use super::parameter::Parameter;
use super::stated_sigma::stated_sigma;
use crate::geometry::coordinate::Motion;

/// Something that the loads hang on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Proof {
    /// Mounting, axes, signs and scale of the specific force.
    SpecificForce,
    /// Axes, signs and scale of the angular velocity.
    AngularVelocity,
    /// Axes, signs and scale of the odometry, where it replaces the inertial measurement unit.
    Odometry,
    /// Axes, signs and scale of the wrench on the tool.
    ToolWrench,
    /// Signs and scale of the forces of actuators.
    ActuatorForces,
    /// How the ground lies under a frame that equilibrium leaves open: it is unknown, so the split of the load is assumed.
    Ground,
    /// That signals tell the masses of payloads: by a scale, or by the force of what lifts them.
    Payload,
    /// That signals tell which supports are on the ground.
    Supports,
    /// Sign, order and scale of the joint with this index, and that its encoder follows it.
    Joint(usize),
}

/// Number of proofs that are not of a joint, and places that are kept for them.
const OTHERS: usize = 8;
const FIRST_JOINT: u32 = 8;
/// The place of all joints that have none of their own.
const LAST_PLACE: u32 = u64::BITS - 1;

impl Proof {
    /// All proofs that are not of a joint, in order.
    pub const OTHERS: [Self; OTHERS] = [
        Self::SpecificForce,
        Self::AngularVelocity,
        Self::Odometry,
        Self::ToolWrench,
        Self::ActuatorForces,
        Self::Ground,
        Self::Payload,
        Self::Supports,
    ];

    /// The signals of an inertial measurement unit (IMU).
    pub const OF_IMU: [Self; 2] = [Self::SpecificForce, Self::AngularVelocity];

    /// All proofs of a machine with so many joints, in order.
    pub fn all(joints: usize) -> impl Iterator<Item = Self> {
        let of_joints = (0..joints).map(Self::Joint);
        Self::OTHERS.into_iter().chain(of_joints)
    }

    /// Its number in messages and files.
    #[must_use]
    pub fn number(self) -> u32 {
        match self {
            Self::SpecificForce => 0,
            Self::AngularVelocity => 1,
            Self::Odometry => 2,
            Self::ToolWrench => 3,
            Self::ActuatorForces => 4,
            Self::Ground => 5,
            Self::Payload => 6,
            Self::Supports => 7,
            Self::Joint(joint) => {
                let joint = u32::try_from(joint).unwrap_or(u32::MAX);
                joint.saturating_add(FIRST_JOINT)
            }
        }
    }

    /// The proof with this number; `None` if there is none.
    #[must_use]
    pub fn from_number(number: u32) -> Option<Self> {
        let joint = number
            .checked_sub(FIRST_JOINT)
            .map(|joint| Self::Joint(joint as usize));
        joint.or_else(|| Self::OTHERS.get(number as usize).copied())
    }

    /// The number of its bit in sets. All joints from the 56th on share the last.
    #[must_use]
    pub fn place(self) -> u32 {
        self.number().min(LAST_PLACE)
    }

    /// What begins its name; of a joint, a dot and the name of the joint follow.
    #[must_use]
    pub fn stem(self) -> &'static str {
        match self {
            Self::SpecificForce => "imu.specific_force",
            Self::AngularVelocity => "imu.angular_velocity",
            Self::Odometry => "odometry",
            Self::ToolWrench => "tool_wrench",
            Self::ActuatorForces => "actuator_forces",
            Self::Ground => "ground",
            Self::Payload => "payload",
            Self::Supports => "supports",
            Self::Joint(_) => "joint",
        }
    }

    /// Its name in tables and messages; `joint` names a joint by its index.
    #[must_use]
    pub fn name(self, joint: impl Fn(usize) -> String) -> String {
        let stem = self.stem();
        match self {
            Self::Joint(index) => format!("{stem}.{}", joint(index)),
            _ => stem.into(),
        }
    }

    /// What would prove it, for people; `joint` names a joint by its index.
    #[must_use]
    pub fn way(self, joint: impl Fn(usize) -> String) -> String {
        match self {
            Self::SpecificForce => {
                "stand still, then drive forward and brake firmly, and drive circles".into()
            }
            Self::AngularVelocity => {
                "drive a circle; stand, and move single joints that lean the machine sideways and lengthways".into()
            }
            Self::Odometry => "drive forward and brake firmly, and drive circles".into(),
            Self::ToolWrench => "take a known load with the tool (commission), and any in each session".into(),
            Self::ActuatorForces => {
                "compare with weighed wheels or a known load (commission), and move what they carry in each session".into()
            }
            Self::Payload => {
                "take a known load up and set it down (commission), and any in each session; state what no signal tells".into()
            }
            Self::Supports => "set and raise each support, and compare what is read (commission)".into(),
            Self::Ground => {
                "state contact.ground = \"plane\" in the machine file where it is, or measure the load of every \
                 support".into()
            }
            Self::Joint(index) => format!(
                "stand, and move {} alone over the range in which it works; if it is commissioned, it is outside of what that covers, has \
                 not changed since the session began, or the motion speaks against it (if it said that the encoder had stopped: \
                 acknowledge it first)",
                joint(index)
            ),
        }
    }
}

/// A set of proofs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Proofs(u64);

impl Proofs {
    /// The empty set.
    pub const NONE: Self = Self(0);
    /// The set of everything: what is said where it is not known what the loads hang on.
    pub const ALL: Self = Self(u64::MAX);

    /// Adds a proof.
    pub fn add(&mut self, proof: Proof) {
        self.0 |= 1 << proof.place();
    }

    /// Removes a proof.
    pub fn remove(&mut self, proof: Proof) {
        self.0 &= !(1 << proof.place());
    }

    /// The set with every proof of another one.
    #[must_use]
    pub fn with(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// The set without every proof of another one.
    #[must_use]
    pub fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// What is in both sets.
    #[must_use]
    pub fn shared_with(self, others: Self) -> Self {
        Self(self.0 & others.0)
    }

    /// Whether the set contains it.
    #[must_use]
    pub fn has(self, proof: Proof) -> bool {
        self.0 >> proof.place() & 1 == 1
    }

    /// Whether the set is empty.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The proofs about a machine with so many joints, in order.
    pub fn iter(self, joints: usize) -> impl Iterator<Item = Proof> {
        Proof::all(joints).filter(move |&proof| self.has(proof))
    }

    /// The set as bits, for messages and files; see [`Self::from_bits`].
    #[must_use]
    pub fn bits(self) -> u64 {
        self.0
    }

    /// The set with these bits. Unknown bits are kept: something that only a newer program knows is still not proven.
    #[must_use]
    pub fn from_bits(bits: u64) -> Self {
        Self(bits)
    }

    /// The names of the proofs about a machine, in order.
    #[must_use]
    pub fn names(self, machine: &Machine) -> Vec<String> {
        let joints = machine.joints();
        let name = |joint: usize| joints[joint].name.clone();
        let all = self.iter(joints.len());
        all.map(|proof| proof.name(name)).collect()
    }
}

/// Standard deviations of a joint's zero by which it may be outside of the positions at which it was commissioned.
const OUTSIDE_SIGMAS: f64 = 3.0;

/// What a commissioning has proven: of a joint only at the positions at which its drive has compared it with what it moves. Beyond them a
/// reading may be wrong that was right there, as of an encoder that slips or is not linear.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Commissioned {
    proofs: Proofs,
    /// By joint; none where it is not known.
    covered: Vec<Option<Covered>>,
}

/// The positions of a joint that a commissioning covers.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Covered {
    /// Least and greatest (rad or m).
    range: [f64; 2],
    /// How far beyond them it may be: another zero of the encoder.
    beyond: f64,
    /// Whether it is where it was before after a whole turn.
    turns: bool,
}

impl Covered {
    fn has(&self, position: f64) -> bool {
        let [least, greatest] = [self.range[0] - self.beyond, self.range[1] + self.beyond];
        let width = greatest - least;
        let from_least = match self.turns {
            true if width >= TAU => return position.is_finite(),
            true => (position - least).rem_euclid(TAU),
            false => position - least,
        };
        // an unknown position is nowhere
        (0.0..=width).contains(&from_least)
    }

    /// Whether it has any position.
    fn is_somewhere(&self) -> bool {
        self.range[0] - self.beyond <= self.range[1] + self.beyond
    }
}

impl Commissioned {
    /// Nothing is commissioned.
    pub const NONE: Self = Self {
        proofs: Proofs::NONE,
        covered: Vec::new(),
    };

    /// These proofs, those of joints at positions within these ranges (rad or m), by joint; a joint without one, or whose range is
    /// empty, is not proven. Of a joint that turns whole turns, positions are the same after one.
    #[must_use]
    pub fn new(machine: &Machine, mut proofs: Proofs, ranges: Vec<Option<[f64; 2]>>) -> Self {
        let covered = |(joint, range): (usize, Option<[f64; 2]>)| {
            Some(Covered {
                range: range?,
                beyond: OUTSIDE_SIGMAS * stated_sigma(machine, Parameter::JointPosition(joint)),
                turns: machine.joint_turns(joint),
            })
        };
        let joints = 0..machine.joints().len();
        let ranges = ranges.into_iter().chain(std::iter::repeat(None));
        let covered: Vec<Option<Covered>> = joints.zip(ranges).map(covered).collect();
        for (joint, covered) in covered.iter().enumerate() {
            if !covered.is_some_and(|covered| covered.is_somewhere()) {
                proofs.remove(Proof::Joint(joint));
            }
        }
        Self { proofs, covered }
    }

    /// What it has proven, of joints at some position; see [`Self::at`].
    #[must_use]
    pub fn proofs(&self) -> Proofs {
        self.proofs
    }

    /// Where it has proven a joint (rad or m); `None` where it has not, or does not say where.
    #[must_use]
    pub fn range(&self, joint: usize) -> Option<[f64; 2]> {
        let covered = self.covered.get(joint)?.as_ref()?;
        let is_proven = self.proofs.has(Proof::Joint(joint));
        is_proven.then_some(covered.range)
    }

    /// Returns the parts of these positions of a joint (rad or m) at which it has not proven the joint.
    #[must_use]
    pub fn unproven_within(&self, joint: usize, [least, greatest]: [f64; 2]) -> Vec<[f64; 2]> {
        let covered = self.covered.get(joint).copied().flatten();
        let covered = covered.filter(|_| self.proofs.has(Proof::Joint(joint)));
        let Some(covered) = covered else {
            return vec![[least, greatest]];
        };
        let [from, to] = [
            covered.range[0] - covered.beyond,
            covered.range[1] + covered.beyond,
        ];
        // of one that turns, a turn is all there is
        let within = match covered.turns && greatest - least >= TAU {
            true => [-PI, PI].map(|apart| 0.5 * (from + to) + apart),
            false => [least, greatest],
        };
        let (nearest, turns) = match covered.turns {
            true => (((within[0] - from) / TAU).round(), -2..=2),
            false => (0.0, 0..=0),
        };
        let mut open = vec![within];
        for turn in turns {
            let [from, to] = [from, to].map(|end| end + (nearest + f64::from(turn)) * TAU);
            let parts = open
                .iter()
                .flat_map(|&[a, b]| [[a, b.min(from)], [a.max(to), b]]);
            open = parts.filter(|[a, b]| a < b).collect();
        }
        open
    }

    /// What it has proven of the machine with its joints as they are now.
    #[must_use]
    pub fn at(&self, joints: &[Motion<f64>]) -> Proofs {
        let mut proofs = self.proofs;
        for (joint, motion) in joints.iter().enumerate() {
            let covered = self.covered.get(joint).copied().flatten();
            if covered.is_none_or(|covered| !covered.has(motion.position)) {
                proofs.remove(Proof::Joint(joint));
            }
        }
        proofs
    }
}

/// What the signals of a session have shown so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SessionProofs {
    /// Proven by the motion.
    pub proven: Proofs,
    /// Signals that have shown one value only since the first sample, but for switches. So reads an encoder that stopped before, or
    /// that nobody reads: whatever a commissioning has proven of it, this session has not shown that it is measured. A force or a
    /// mass that has repeated one value for so long that nothing shows any more that it is measured is among them.
    pub unchanged: Proofs,
    /// What the motion makes unlikely, without contradicting it for sure, or has contradicted, of an encoder that moves again, and what
    /// nothing but a person says since it failed: whatever a commissioning has proven of it before, its sensors may be others since.
    pub disputed: Proofs,
    /// Joints whose position is exactly zero.
    pub at_zero: Proofs,
}

impl SessionProofs {
    /// Nothing is shown yet.
    pub const NONE: Self = Self {
        proven: Proofs::NONE,
        unchanged: Proofs::NONE,
        disputed: Proofs::NONE,
        at_zero: Proofs::NONE,
    };

    /// What is not proven of what the loads hang on, beside a commissioning that has proven this where the joints are.
    #[must_use]
    pub fn unproven(self, needed: Proofs, commissioned: Proofs) -> Proofs {
        let unproven = needed.without(commissioned).without(self.proven);
        // a load that nobody stated is none of the machine's signals
        let told = needed.with([Proof::Payload].into_iter().collect());
        unproven
            .with(needed.shared_with(self.unchanged))
            .with(told.shared_with(self.disputed))
    }
}

impl FromIterator<Proof> for Proofs {
    fn from_iter<I: IntoIterator<Item = Proof>>(proofs: I) -> Self {
        let mut set = Self::NONE;
        proofs.into_iter().for_each(|proof| set.add(proof));
        set
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::of_tests::rigid;

    #[test]
    fn sets_hold_what_was_added_and_joints_without_a_place_share_one() {
        let mut set: Proofs = [Proof::Ground, Proof::Joint(3)].into_iter().collect();
        assert!(set.has(Proof::Ground) && set.has(Proof::Joint(3)));
        assert!(!set.has(Proof::SpecificForce) && !set.has(Proof::Joint(2)));
        let found: Vec<Proof> = set.iter(8).collect();
        assert_eq!(found, [Proof::Ground, Proof::Joint(3)]);
        assert_eq!(Proofs::from_bits(set.bits()), set);
        set.add(Proof::Joint(usize::MAX));
        assert!(set.has(Proof::Joint(70)), "never proven by omission");
        assert!(set.without(set).is_empty());
        for proof in [
            Proof::Ground,
            Proof::SpecificForce,
            Proof::Joint(0),
            Proof::Joint(90),
        ] {
            assert_eq!(Proof::from_number(proof.number()), Some(proof));
        }
        let mut places: Vec<u32> = Proof::OTHERS.map(Proof::place).into();
        places.dedup();
        assert_eq!(places.len(), OTHERS);
        assert!(places.iter().all(|&place| place < FIRST_JOINT));
    }

    // requirement: TW-VERDICT-28
    #[test]
    fn commissioned_joint_is_proven_where_it_was_compared() {
        let machine = rigid();
        let count = machine.joints().len();
        let mut joints = 0..count;
        let slides = joints.find(|&joint| machine.joint_slides(joint)).unwrap();
        let sigma = stated_sigma(&machine, Parameter::JointPosition(slides));
        assert!(sigma > 0.0 && !machine.joint_turns(slides));
        let mut ranges = vec![None; count];
        ranges[slides] = Some([0.1, 0.6]);
        // shown in two ways, nowhere in both
        let other = (0..count).find(|&joint| joint != slides).unwrap();
        ranges[other] = Some([1e3, -1e3]);
        let all: Proofs = Proof::all(count).collect();
        let proven = Commissioned::new(&machine, all, ranges);
        assert_eq!(proven.range(slides), Some([0.1, 0.6]));
        assert!(proven.proofs().has(Proof::Odometry));
        for joint in 0..count {
            assert_eq!(proven.proofs().has(Proof::Joint(joint)), joint == slides);
        }
        let is_proven = |position: f64| {
            let mut joints = vec![Motion::at_rest(0.0); count];
            joints[slides].position = position;
            let found = proven.at(&joints);
            assert!(found.has(Proof::SpecificForce), "it has no position");
            let others = (0..count).filter(|&joint| joint != slides);
            for other in others {
                assert!(!found.has(Proof::Joint(other)), "nobody knows where");
            }
            found.has(Proof::Joint(slides))
        };
        for inside in [0.1, 0.3, 0.6, 0.1 - 2.9 * sigma, 0.6 + 2.9 * sigma] {
            assert!(is_proven(inside), "{inside}");
        }
        for outside in [0.1 - 3.1 * sigma, 0.6 + 3.1 * sigma, 0.3 + TAU, f64::NAN] {
            assert!(!is_proven(outside), "{outside}");
        }
        assert_eq!(Commissioned::NONE.at(&[Motion::at_rest(0.3)]), Proofs::NONE);
        let open = |within: [f64; 2]| proven.unproven_within(slides, within);
        let [from, to] = [0.1 - 3.0 * sigma, 0.6 + 3.0 * sigma];
        assert_eq!(open([-1.0, 1.0]), [[-1.0, from], [to, 1.0]]);
        assert_eq!(open([0.2, 0.5]), [] as [[f64; 2]; 0]);
        let other = usize::from(slides == 0);
        assert_eq!(proven.unproven_within(other, [-1.0, 1.0]), [[-1.0, 1.0]]);
    }

    #[test]
    fn a_joint_that_turns_is_where_it_was_after_a_turn() {
        let covered = Covered {
            range: [3.0, 4.0],
            beyond: 0.01,
            turns: true,
        };
        for inside in [3.0, 3.5, 3.5 - TAU, 4.0 + TAU] {
            assert!(covered.has(inside), "{inside}");
        }
        for outside in [2.9, 4.1, 0.0, 4.1 - TAU, f64::NAN] {
            assert!(!covered.has(outside), "{outside}");
        }
        let whole = Covered {
            range: [0.0, 7.0],
            ..covered
        };
        let anywhere = Covered {
            range: [f64::NEG_INFINITY, f64::INFINITY],
            ..covered
        };
        for turn in [whole, anywhere] {
            assert!(turn.has(-100.0) && !turn.has(f64::NAN));
        }
    }

    // requirement: TW-VERDICT-28
    #[test]
    fn what_has_not_changed_is_not_proven_by_a_commissioning() {
        let joints: Proofs = [Proof::Joint(1), Proof::Joint(2)].into_iter().collect();
        let wheel: Proofs = [Proof::Joint(7)].into_iter().collect();
        let mut session = SessionProofs::NONE;
        assert_eq!(session.unproven(joints, joints), Proofs::NONE);
        session.proven = joints;
        assert_eq!(session.unproven(joints, Proofs::NONE), Proofs::NONE);
        session.unchanged = [Proof::Joint(2)].into_iter().collect();
        assert_eq!(session.unproven(joints, joints), session.unchanged);
        session.unchanged = Proofs::NONE;
        session.disputed = [Proof::Joint(1)].into_iter().collect();
        assert_eq!(session.unproven(joints, joints), session.disputed);
        session.disputed = Proofs::NONE;
        // on which no load hangs: a wheel that does not spin
        session.unchanged = wheel;
        assert_eq!(session.unproven(joints, joints), Proofs::NONE);
    }
}
