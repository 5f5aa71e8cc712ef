//! All comparisons of the signals, under a correction.

use std::cell::LazyCell;
use std::rc::Rc;

use nalgebra::Vector3;

use super::correction::{Correction, Subject};
use super::driving;
use super::estimate::{CERTAIN, Estimate, Relation, Standing, Yaw};
use super::leaning;
use super::moved::{self, MovedAlone};
use super::platform::{Platform, Predicted};
use super::readings;
use super::rocking;
use super::roles::{Role, Roles};
use super::rolling;
use super::signals::{Signals, View};
use super::still;
use super::travel::{Source, Travel};
use tipwatch_mechanics::machine::Machine;

/// Beyond so many standard deviations their number says nothing.
const MOST_SIGMAS: f64 = 99.0;

/// Machine, signals, travel and predicted lean that all comparisons share.
#[derive(Debug)]
pub(super) struct Comparison<'a> {
    pub(super) machine: &'a Machine,
    roles: &'a Roles,
    signals: &'a Signals,
    platform: Platform,
    /// Normal of level ground in base axes.
    normal: Vector3<f64>,
    /// The signals as they are, and the travel by them.
    pub(super) view: View,
    pub(super) travel: Travel,
    pub(super) moved: Vec<MovedAlone>,
    /// Predicted lean of the platform during the motions in `moved`.
    predicted: Predicted,
    /// Whether the wheels slip sideways in a curve, because none is steered.
    skids: bool,
}

impl<'a> Comparison<'a> {
    pub(super) fn new(machine: &'a Machine, roles: &'a Roles, signals: &'a Signals) -> Self {
        let view = signals.view(machine, &Correction::None);
        let travel = Travel::of(machine, roles, &view, None);
        let platform = Platform::new(machine);
        let moved = moved::moved_alone(roles, &view, &travel);
        Self {
            normal: platform.level_normal(&view),
            predicted: platform.predict(&view, &moved),
            moved,
            skids: roles
                .joints(|role| matches!(role, Role::Steer { .. }))
                .is_empty(),
            machine,
            roles,
            signals,
            platform,
            view,
            travel,
        }
    }

    /// The comparisons under a correction. What it does not touch is taken over from `base`.
    pub(super) fn evidence(&self, correction: &Correction, base: Option<&Evidence>) -> Evidence {
        let mut all = Evidence(Vec::new());
        for group in self.groups(correction, base) {
            all.0.extend(group());
        }
        all
    }

    /// Computes the evidence under a correction, unless something in it contradicts: then the rest is not computed.
    pub(super) fn without_contradiction(
        &self,
        correction: &Correction,
        base: &Evidence,
    ) -> Option<Evidence> {
        let groups = self.groups(correction, Some(base));
        let mut found = [const { Vec::new() }; 4];
        // From what is known to what costs most.
        for place in [0, 1, 3, 2] {
            let group = Evidence(groups[place]());
            if group.contradictions().next().is_some() {
                return None;
            }
            found[place] = group.0;
        }
        Some(Evidence(found.concat()))
    }

    /// The groups of comparisons under a correction.
    fn groups<'g>(
        &'g self,
        correction: &'g Correction,
        base: Option<&'g Evidence>,
    ) -> [Box<dyn Fn() -> Vec<Estimate> + 'g>; 4] {
        let machine = self.machine;
        let parts = base.map_or(Parts::ALL, |_| self.touched(correction));
        let view = Rc::new(LazyCell::new(move || {
            self.signals.view(machine, correction)
        }));
        let kept = move || {
            let all = base.map_or(&[][..], |base| &base.0);
            let untouched = all.iter().filter(|e| !parts.holds(e.relation));
            untouched.copied().collect()
        };
        let of_travel = {
            let view = Rc::clone(&view);
            move || match parts.travel {
                true => self.of_travel(correction, &view, parts.readings),
                false => Vec::new(),
            }
        };
        let of_readings = {
            let view = Rc::clone(&view);
            move || match parts.readings {
                true => readings::readings(machine, self.roles, &view),
                false => Vec::new(),
            }
        };
        let of_lean = move || match parts.lean {
            true => self.of_lean(correction, &view, parts.readings),
            false => Vec::new(),
        };
        [
            Box::new(kept),
            Box::new(of_travel),
            Box::new(of_lean),
            Box::new(of_readings),
        ]
    }

    fn of_travel(
        &self,
        correction: &Correction,
        view: &View,
        changes_readings: bool,
    ) -> Vec<Estimate> {
        let machine = self.machine;
        let moves_joints = changes_readings || *correction == Correction::Reverse;
        let wheels = (!moves_joints).then_some(&self.travel.wheels[..]);
        let travel = Travel::of(machine, self.roles, view, wheels);
        let mut all: Vec<Estimate> = Vec::new();
        all.extend(driving::at_rest(machine, view, &travel, &self.normal));
        all.extend(driving::driving(machine, view, &travel, &self.normal));
        all.extend(driving::turning(view, &travel, self.skids));
        all.extend(driving::attitude(machine, view, &travel));
        all.extend(rocking::rocking(view));
        all.extend(rolling::wheels(view, &travel, self.skids));
        all.extend(rolling::order(view, &travel));
        all.extend(rolling::steering(machine, self.roles, view, &travel));
        all
    }

    fn of_lean(
        &self,
        correction: &Correction,
        view: &View,
        changes_readings: bool,
    ) -> Vec<Estimate> {
        let turns_force = matches!(
            correction,
            Correction::TurnImu(_) | Correction::ForceAxes(_) | Correction::ScaleForce(_)
        );
        let anew =
            (changes_readings || turns_force).then(|| self.platform.predict(view, &self.moved));
        let predicted = anew.as_ref().unwrap_or(&self.predicted);
        let mut all: Vec<Estimate> = Vec::new();
        all.extend(leaning::leaning(
            &self.platform,
            self.signals,
            view,
            &self.moved,
            predicted,
        ));
        all.extend(still::still(
            &self.platform,
            self.roles,
            self.signals,
            view,
            &self.travel,
        ));
        all
    }

    /// Returns the least and greatest position at which a joint was compared with what it moves: while the joint moved alone, or
    /// steered a wheel that rolled. It moved in between.
    pub(super) fn compared_range(&self, joint: usize) -> Option<[f64; 2]> {
        let position = &self.view.joints[joint].position;
        match self.roles.of(joint) {
            Role::Mass => {
                let moved = self.moved.iter().filter(|moved| moved.joint == joint);
                let runs = moved.flat_map(|moved| moved.runs.iter().cloned());
                span(runs.flatten().map(|bin| position[bin]))
            }
            Role::Steer { .. } => {
                let wheel =
                    rolling::steered_wheel(self.machine, self.roles, &self.travel, joint)?.0;
                let rolls = |bin: &usize| {
                    rolling::rolling_velocity(&self.view, &self.travel, wheel, *bin).is_some()
                };
                span((0..self.view.bins).filter(rolls).map(|bin| position[bin]))
            }
            Role::Wheel { .. } | Role::Constant => None,
        }
    }

    /// Returns the least and greatest position of a joint in the recording.
    pub(super) fn recorded_range(&self, joint: usize) -> Option<[f64; 2]> {
        span(self.view.joints[joint].position.iter().copied())
    }

    /// Returns the parts of the evidence that a correction changes.
    fn touched(&self, correction: &Correction) -> Parts {
        let none = Parts {
            travel: false,
            lean: false,
            readings: false,
        };
        let of_joint = |joint: usize| match self.roles.of(joint) {
            _ if self.machine.imu().body != 0 => Parts::ALL,
            Role::Mass => Parts {
                travel: false,
                ..Parts::ALL
            },
            _ => Parts {
                lean: false,
                ..Parts::ALL
            },
        };
        match *correction {
            Correction::None => none,
            Correction::TurnImu(_)
            | Correction::GyroAxes(_)
            | Correction::ForceAxes(_)
            | Correction::ScaleGyro(_)
            | Correction::ScaleForce(_)
            | Correction::Reverse => Parts {
                readings: false,
                ..Parts::ALL
            },
            Correction::TurnOdometry(_)
            | Correction::ScaleOdometry(_)
            | Correction::WithoutOdometryTurning
            | Correction::WithoutAttitude
            | Correction::AttitudeSigns(..) => Parts {
                travel: true,
                ..none
            },
            Correction::ScaleJoint(joint, _) => of_joint(joint),
            Correction::FlipJoints(set) => set
                .joints()
                .fold(none, |parts, joint| parts.and(of_joint(joint))),
            Correction::SwapJoints(a, b) => of_joint(a).and(of_joint(b)),
        }
    }
}

/// Returns the least and the greatest of the known positions.
fn span(positions: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let known = positions.filter(|position| position.is_finite());
    let each = known.map(|position| [position; 2]);
    each.reduce(|[least, greatest], [position, _]| [least.min(position), greatest.max(position)])
}

/// Groups of comparisons.
#[derive(Debug, Clone, Copy)]
struct Parts {
    travel: bool,
    lean: bool,
    readings: bool,
}

impl Parts {
    const ALL: Self = Self {
        travel: true,
        lean: true,
        readings: true,
    };

    fn and(self, other: Self) -> Self {
        Self {
            travel: self.travel || other.travel,
            lean: self.lean || other.lean,
            readings: self.readings || other.readings,
        }
    }

    fn holds(self, relation: Relation) -> bool {
        match relation {
            Relation::Lean(_) | Relation::LeanUnexplained(_) | Relation::Still(_) => self.lean,
            Relation::Rate(_) | Relation::Range(_) => self.readings,
            _ => self.travel,
        }
    }
}

/// Results of all comparisons.
#[derive(Debug, Clone)]
pub(super) struct Evidence(pub(super) Vec<Estimate>);

impl Evidence {
    pub(super) fn of(&self, relation: Relation) -> Option<&Estimate> {
        self.0.iter().find(|estimate| estimate.relation == relation)
    }

    pub(super) fn agrees(&self, relation: Relation) -> bool {
        self.of(relation)
            .is_some_and(|e| e.standing() == Standing::Agrees)
    }

    /// Comparisons of lean and joints that are beyond what a good machine shows, though other causes are possible.
    pub(super) fn doubtful(&self) -> impl Iterator<Item = &Estimate> {
        let is_lean =
            |e: &&Estimate| matches!(e.relation, Relation::Lean(_) | Relation::LeanUnexplained(_));
        self.0
            .iter()
            .filter(is_lean)
            .filter(|e| (e.value - e.expected).abs() > e.tolerance)
    }

    pub(super) fn contradictions(&self) -> impl Iterator<Item = &Estimate> {
        self.0
            .iter()
            .filter(|e| e.standing() == Standing::Contradicts)
    }

    pub(super) fn agreeing(&self) -> usize {
        self.0
            .iter()
            .filter(|e| e.standing() == Standing::Agrees)
            .count()
    }

    /// Returns by how many standard deviations this evidence excludes its correction, by all relations that agree in `base`;
    /// `None` if it does not.
    pub(super) fn excludes(&self, base: &Self) -> Option<f64> {
        let pairs = self
            .0
            .iter()
            .filter_map(|e| Some((e, base.of(e.relation)?)));
        let agreeing = pairs.filter(|(_, before)| before.standing() == Standing::Agrees);
        let off = agreeing.map(|(e, before)| e.sigmas_worse(before));
        let together = off.filter(|sigmas| sigmas.is_finite());
        let together = together.map(|sigmas| sigmas * sigmas).sum::<f64>().sqrt();
        (together >= CERTAIN).then_some(together.min(MOST_SIGMAS))
    }
}

/// The sensors that a relation compares.
pub(super) fn subjects(relation: Relation, source: Source, wheels: &[usize]) -> Vec<Subject> {
    let travel = || match source {
        Source::Odometry => vec![Subject::Odometry],
        _ => wheels.iter().map(|&joint| Subject::Joint(joint)).collect(),
    };
    let with = |own: &[Subject]| [own, &travel()].concat();
    match relation {
        Relation::Gravity => vec![Subject::Force],
        Relation::Up | Relation::Mount(_) => vec![Subject::Mounting],
        Relation::Drive(..) | Relation::DriveDirection => with(&[Subject::Mounting]),
        Relation::AttitudeTilt(_) | Relation::AttitudeUp => vec![Subject::Attitude],
        Relation::Turn(Yaw::Odometry, _) => vec![Subject::Gyro, Subject::OdometryTurning],
        Relation::Turn(Yaw::Attitude, _) => vec![Subject::Gyro, Subject::Attitude],
        Relation::Rocking(..) => vec![Subject::Gyro, Subject::Attitude],
        Relation::WheelOrder(a, b) => with(&[Subject::Joint(a), Subject::Joint(b)]),
        Relation::Turn(Yaw::Wheels, _) => {
            let wheels = wheels.iter().map(|&joint| Subject::Joint(joint));
            wheels.chain([Subject::Gyro]).collect()
        }
        Relation::Wheel(joint) | Relation::WheelSide(joint) | Relation::WheelCurve(joint) => {
            with(&[Subject::Joint(joint)])
        }
        Relation::Steer(joint) | Relation::SteerOff(joint) => {
            with(&[Subject::Joint(joint), Subject::Gyro])
        }
        Relation::Lean(joint) | Relation::LeanUnexplained(joint) => {
            vec![Subject::Joint(joint), Subject::Gyro, Subject::Mounting]
        }
        Relation::Still(joint) | Relation::Rate(joint) | Relation::Range(joint) => {
            vec![Subject::Joint(joint)]
        }
    }
}
