//! From a machine file as written, a URDF and what a log offers to a [`Machine`], or the first thing
//! that is wrong with it.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector2, Vector3};

use super::linkage::{self, LinkageBodies, LinkageInput};
use super::spec::{LinkageSpec, Stiffness};
use super::tree::{Tree, TreeBody, TreeJoint};
use super::urdf::Urdf;
use super::{
    Body, Contact, Drive, FreeJoint, Inertia, JointKind, Link, MAX_WHEELS, Machine, MachineError,
    MachineSpec, MeasuredJoint, Mount, Payload, Split, SupportPolygon, Wheel,
};
use crate::contact_plane::ContactPlane;

/// What a log offers that a machine is checked against.
#[derive(Debug, Clone, Copy, Default)]
pub struct LogFacts<'a> {
    /// Names in its joint states; `None` where there is no log: every joint counts as measured that
    /// no linkage moves.
    pub joint_names: Option<&'a [String]>,
    /// Whether the log lacks an IMU: what it would feel is then reckoned at the base origin.
    pub lacks_imu: bool,
    /// The frame that its IMU messages name.
    pub imu_frame: Option<&'a str>,
}

impl MachineSpec {
    /// Checks the machine against its URDF (`urdf_name` is for messages) and a log.
    ///
    /// # Errors
    /// [`MachineError`]: the first thing that makes the machine impossible or leaves it undefined.
    pub fn check(
        &self,
        urdf_text: &str,
        urdf_name: &str,
        log: LogFacts<'_>,
    ) -> Result<Machine, MachineError> {
        let urdf = Urdf::parse(urdf_text, urdf_name)?;
        let tree = Tree::build(&urdf)?;
        Checker {
            spec: self,
            tree: &tree,
            urdf_name,
            log,
        }
        .machine()
    }
}

struct Checker<'a> {
    spec: &'a MachineSpec,
    tree: &'a Tree,
    urdf_name: &'a str,
    log: LogFacts<'a>,
}

/// What moves each body, and the measured joints and closed chains that follow from it.
struct Driving {
    drives: Vec<Option<Drive>>,
    joints: Vec<MeasuredJoint>,
    linkages: Vec<super::Linkage>,
}

impl Checker<'_> {
    fn machine(&self) -> Result<Machine, MachineError> {
        let spec = self.spec;
        self.check_numbers()?;
        let wheels = self.wheels()?;
        let polygon = self.polygon(&wheels)?;
        let driving = self.driving(&wheels)?;
        let contact = self.contact(&wheels, &polygon)?;
        let arm_root = spec
            .arm
            .as_ref()
            .map(|arm| self.link("arm.root", &arm.root))
            .transpose()?;
        let tool = match spec.arm.as_ref().and_then(|arm| arm.tool.as_ref()) {
            Some(tool) => Some(self.mount(
                self.link("arm.tool", tool)?,
                Isometry3::identity(),
                "arm.tool of the machine file",
            )),
            None => None,
        };
        self.check_suspension()?;
        let links = self.tree.links.iter().enumerate().map(|(i, link)| Link {
            name: link.name.clone(),
            body: link.body,
            body_from_link: link.body_from_link,
            inertia: link.inertia,
            in_arm: arm_root.is_some_and(|root| self.tree.link_is_below(i, root)),
        });
        Ok(Machine {
            name: spec.name.clone(),
            gravity: spec.gravity,
            base_link: self.tree.base_link.clone(),
            links: links.collect(),
            bodies: self
                .tree
                .bodies
                .iter()
                .zip(&driving.drives)
                .map(body)
                .collect(),
            linkages: driving.linkages,
            joints: driving.joints,
            wheels,
            polygon,
            contact,
            imu: self.imu()?,
            tool,
            payloads: self.payloads()?,
            limits: spec.limits.clone(),
            signals: spec.signals.clone(),
            estimator: spec.estimator,
        })
    }

    fn value_error(
        &self,
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> MachineError {
        MachineError::value(&self.spec.file, place, expected, found)
    }

    fn unknown<'n>(
        &self,
        key: &str,
        name: &str,
        kind: &'static str,
        mut existing: impl Iterator<Item = &'n str>,
    ) -> MachineError {
        let folded = name.to_lowercase();
        let near = existing
            .find(|e| e.to_lowercase().contains(&folded) || folded.contains(&e.to_lowercase()));
        MachineError::UnknownName {
            file: self.spec.file.clone(),
            key: key.into(),
            name: name.into(),
            kind,
            urdf: self.urdf_name.into(),
            suggestion: near.map_or(String::new(), |n| format!("; did you mean \"{n}\"?")),
        }
    }

    fn link(&self, key: &str, name: &str) -> Result<usize, MachineError> {
        let names = self.tree.links.iter().map(|l| l.name.as_str());
        self.tree
            .link(name)
            .ok_or_else(|| self.unknown(key, name, "link", names))
    }

    fn joint(&self, key: &str, name: &str) -> Result<usize, MachineError> {
        let names = self
            .tree
            .bodies
            .iter()
            .filter_map(|b| b.joint.as_ref())
            .map(|j| j.name.as_str());
        self.tree
            .body_of_joint(name)
            .ok_or_else(|| self.unknown(key, name, "joint", names))
    }

    fn mount(
        &self,
        link: usize,
        link_from_mount: Isometry3<f64>,
        source: impl Into<String>,
    ) -> Mount {
        let link = &self.tree.links[link];
        Mount {
            body: link.body,
            body_from_mount: link.body_from_link * link_from_mount,
            source: source.into(),
        }
    }

    /// Numbers that must be positive, or lie in a range, whatever the URDF says.
    fn check_numbers(&self) -> Result<(), MachineError> {
        let (spec, e) = (self.spec, &self.spec.estimator);
        let limits = &spec.limits;
        let positive = [
            ("gravity", Some(spec.gravity)),
            ("limits.min_load", limits.min_load),
            ("limits.min_load_share", limits.min_load_share),
            ("limits.notice", Some(limits.notice)),
            ("limits.warning", Some(limits.warning)),
            ("limits.limit", Some(limits.limit)),
            ("estimator.max_gap", Some(e.max_gap)),
            (
                "estimator.joint_position_noise",
                Some(e.joint_position_noise),
            ),
            ("estimator.joint_rate_noise", Some(e.joint_rate_noise)),
            ("estimator.joint_agility", Some(e.joint_agility)),
            ("estimator.gyro_noise", Some(e.gyro_noise)),
            ("estimator.gyro_agility", Some(e.gyro_agility)),
            ("estimator.accelerometer_noise", Some(e.accelerometer_noise)),
            (
                "estimator.accelerometer_agility",
                Some(e.accelerometer_agility),
            ),
        ];
        for (place, value) in positive {
            if let Some(value) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
                return Err(self.value_error(place, "a positive number", value));
            }
        }
        if limits.min_load.is_some() && limits.min_load_share.is_some() {
            return Err(self.value_error("limits", "min_load or min_load_share", "both"));
        }
        for name in limits.optimal_load.iter().flat_map(|loads| loads.keys()) {
            if !spec.wheels.contains_key(name) {
                return Err(self.value_error(
                    "limits.optimal_load",
                    "names of [wheels]",
                    format!("\"{name}\""),
                ));
            }
        }
        Ok(())
    }

    fn wheels(&self) -> Result<Vec<Wheel>, MachineError> {
        let specs = &self.spec.wheels;
        if !(3..=MAX_WHEELS).contains(&specs.len()) {
            let expected = format!("3 to {MAX_WHEELS} tables [wheels.NAME]");
            return Err(self.value_error("wheels", expected, specs.len()));
        }
        let stiffness = self.stiffness()?;
        let mean = stiffness.iter().sum::<f64>() / stiffness.len() as f64;
        let mut wheels: Vec<Wheel> = Vec::new();
        for ((name, wheel), stiffness) in specs.iter().zip(stiffness) {
            let link = &self.tree.links[self.link(&format!("wheels.{name}.link"), &wheel.link)?];
            if !(wheel.radius.is_finite() && wheel.radius > 0.0) {
                return Err(self.value_error(
                    format!("wheels.{name}.radius"),
                    "a positive length [m]",
                    wheel.radius,
                ));
            }
            if let Some(same) = wheels
                .iter()
                .find(|w| w.name.to_lowercase() == name.to_lowercase())
            {
                let found = format!("\"{name}\" beside \"{}\"", same.name);
                return Err(self.value_error(
                    "wheels",
                    "names that differ by more than case",
                    found,
                ));
            }
            let centre_in_body = link.body_from_link.translation.vector;
            wheels.push(Wheel {
                name: name.clone(),
                body: link.body,
                centre_in_body,
                radius: wheel.radius,
                stiffness: self.spec.contact.tyre_stiffness.as_ref().map(|_| stiffness),
                relative_stiffness: stiffness / mean,
                centre_at_zero: (self.tree.bodies[link.body].base_from_body
                    * nalgebra::Point3::from(centre_in_body))
                .coords,
            });
        }
        Ok(wheels)
    }

    /// Tyre stiffness by wheel, sorted by name; all 1 where the machine file is silent (N/m or 1).
    fn stiffness(&self) -> Result<Vec<f64>, MachineError> {
        let names = self.spec.wheels.keys();
        let values: Vec<f64> = match &self.spec.contact.tyre_stiffness {
            None => names.map(|_| 1.0).collect(),
            Some(Stiffness::All(value)) => names.map(|_| *value).collect(),
            Some(Stiffness::PerWheel(by_name)) => {
                if let Some(stranger) = by_name.keys().find(|n| !self.spec.wheels.contains_key(*n))
                {
                    return Err(self.value_error(
                        "contact.tyre_stiffness",
                        "names of [wheels]",
                        format!("\"{stranger}\""),
                    ));
                }
                let missing = |n: &String| {
                    self.value_error(
                        "contact.tyre_stiffness",
                        "a value for every wheel",
                        format!("none for \"{n}\""),
                    )
                };
                names
                    .map(|n| by_name.get(n).copied().ok_or_else(|| missing(n)))
                    .collect::<Result<_, _>>()?
            }
        };
        match values.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
            Some(value) => {
                Err(self.value_error("contact.tyre_stiffness", "positive numbers [N/m]", value))
            }
            None => Ok(values),
        }
    }

    fn polygon(&self, wheels: &[Wheel]) -> Result<SupportPolygon, MachineError> {
        let centres: Vec<Vector3<f64>> = wheels.iter().map(|w| w.centre_at_zero).collect();
        let radii: Vec<f64> = wheels.iter().map(|w| w.radius).collect();
        let plane = ContactPlane::through(&centres, &radii, true);
        let points: Vec<Vector2<f64>> = centres
            .iter()
            .zip(wheels)
            .map(|(c, w)| (c - plane.normal * w.radius).xy())
            .collect();
        let names: Vec<&str> = wheels.iter().map(|w| w.name.as_str()).collect();
        SupportPolygon::build(&points, &names).ok_or_else(|| {
            self.value_error(
                "wheels",
                "contact points that span an area",
                "contact points in one line",
            )
        })
    }

    fn driving(&self, wheels: &[Wheel]) -> Result<Driving, MachineError> {
        let mut driving = Driving {
            drives: vec![None; self.tree.bodies.len()],
            joints: Vec::new(),
            linkages: Vec::new(),
        };
        driving.drives[0] = Some(Drive::Root);
        for spec in &self.spec.linkage {
            self.add_linkage(spec, &mut driving)?;
        }
        let mut missing = Vec::new();
        for (i, body) in self.tree.bodies.iter().enumerate() {
            let Some(joint) = body
                .joint
                .as_ref()
                .filter(|j| driving.drives[i].is_none() && j.mimic.is_none())
            else {
                continue;
            };
            let spins_wheel = self.wheel_spun_by(i, wheels);
            let logged = self.is_logged(&joint.name);
            if logged || spins_wheel.is_some() {
                driving.drives[i] = Some(Drive::Measured(driving.joints.len()));
                driving.joints.push(MeasuredJoint {
                    name: joint.name.clone(),
                    logged,
                    spins_wheel,
                });
            } else {
                missing.push(format!("\"{}\"", joint.name));
            }
        }
        self.follow_mimics(&mut driving, &mut missing);
        if missing.is_empty() {
            Ok(driving)
        } else {
            Err(self.unmeasured(&missing))
        }
    }

    fn unmeasured(&self, joints: &[String]) -> MachineError {
        MachineError::UnmeasuredJoints {
            joints: joints.join(", "),
            urdf: self.urdf_name.into(),
            logged: self
                .log
                .joint_names
                .map_or(String::new(), |names| names.join(", ")),
        }
    }

    fn is_logged(&self, joint: &str) -> bool {
        self.log
            .joint_names
            .is_none_or(|names| names.iter().any(|n| n == joint))
    }

    fn add_linkage(&self, spec: &LinkageSpec, driving: &mut Driving) -> Result<(), MachineError> {
        let key = |field: &str| format!("linkage.{}.{field}", spec.name);
        let bodies = LinkageBodies {
            pivot: self.joint(&key("pivot"), &spec.pivot)?,
            cylinder: self.joint(&key("cylinder"), &spec.cylinder)?,
            rod: self.joint(&key("rod"), &spec.rod)?,
        };
        self.link(&key("rod_end.link"), &spec.rod_end.link)?;
        self.link(&key("anchor.link"), &spec.anchor.link)?;
        let index = driving.linkages.len();
        for (body, name) in [
            (bodies.pivot, &spec.pivot),
            (bodies.cylinder, &spec.cylinder),
            (bodies.rod, &spec.rod),
        ] {
            if driving.drives[body].is_some() {
                return Err(self.value_error(
                    format!("linkage.{}", spec.name),
                    "joints of its own",
                    format!("\"{name}\" twice"),
                ));
            }
        }
        let input = if self.is_logged(&spec.pivot) {
            LinkageInput::PivotAngle
        } else if self.is_logged(&spec.rod) {
            LinkageInput::RodLength
        } else {
            return Err(self.unmeasured(&[format!("\"{}\" (or \"{}\")", spec.pivot, spec.rod)]));
        };
        let measured = driving.joints.len();
        let name = if input == LinkageInput::PivotAngle {
            &spec.pivot
        } else {
            &spec.rod
        };
        driving.linkages.push(linkage::build(
            spec,
            bodies,
            input,
            measured,
            self.tree,
            &self.spec.file,
        )?);
        driving.joints.push(MeasuredJoint {
            name: name.clone(),
            logged: true,
            spins_wheel: None,
        });
        driving.drives[bodies.pivot] = Some(Drive::Pivot(index));
        driving.drives[bodies.cylinder] = Some(Drive::Cylinder(index));
        driving.drives[bodies.rod] = Some(Drive::Rod(index));
        Ok(())
    }

    /// A mimic joint follows a measured one; a chain of mimics is followed to its start.
    fn follow_mimics(&self, driving: &mut Driving, missing: &mut Vec<String>) {
        for (i, body) in self.tree.bodies.iter().enumerate() {
            let Some(mut mimic) = body
                .joint
                .as_ref()
                .filter(|_| driving.drives[i].is_none())
                .and_then(|j| j.mimic.clone())
            else {
                continue;
            };
            for _ in 0..self.tree.bodies.len() {
                let followed = self
                    .tree
                    .body_of_joint(&mimic.joint)
                    .map(|b| &self.tree.bodies[b]);
                let Some(next) = followed
                    .and_then(|b| b.joint.as_ref())
                    .and_then(|j| j.mimic.as_ref())
                else {
                    break;
                };
                mimic.offset += mimic.multiplier * next.offset;
                mimic.multiplier *= next.multiplier;
                mimic.joint.clone_from(&next.joint);
            }
            match driving.joints.iter().position(|j| j.name == mimic.joint) {
                Some(joint) => {
                    driving.drives[i] = Some(Drive::Mimic {
                        joint,
                        multiplier: mimic.multiplier,
                        offset: mimic.offset,
                    });
                }
                None => missing.push(format!(
                    "\"{}\"",
                    body.joint.as_ref().map_or("", |j| &j.name)
                )),
            }
        }
    }

    /// The wheel whose centre lies on the axis of the revolute joint of `body` and which that joint
    /// carries: such a joint only spins it.
    fn wheel_spun_by(&self, body: usize, wheels: &[Wheel]) -> Option<usize> {
        let revolute = self.tree.bodies[body]
            .joint
            .as_ref()
            .is_some_and(|j| j.kind == JointKind::Revolute);
        let lies = |z: &Vector3<f64>| (self.tree.bodies[body].base_from_body * z).z.abs() < 0.5;
        wheels.iter().position(|w| {
            revolute && w.body == body && w.centre_in_body.xy().norm() < 1e-6 && lies(&Vector3::z())
        })
    }

    fn contact(&self, wheels: &[Wheel], polygon: &SupportPolygon) -> Result<Contact, MachineError> {
        let spec = &self.spec.contact;
        let mut free_joints = Vec::new();
        for name in &spec.free_joints {
            let body = self.joint("contact.free_joints", name)?;
            let carries_body: Vec<bool> = (0..self.tree.bodies.len())
                .map(|b| self.tree.is_carried_by(b, body))
                .collect();
            let carries_wheel: Vec<bool> = wheels.iter().map(|w| carries_body[w.body]).collect();
            if !carries_wheel.iter().any(|&c| c) || carries_wheel.iter().all(|&c| c) {
                return Err(self.value_error(
                    "contact.free_joints",
                    "joints with some but not all wheels beyond them",
                    format!("\"{name}\""),
                ));
            }
            free_joints.push(FreeJoint {
                body,
                carries_body,
                carries_wheel,
            });
        }
        if free_joints.len() + 3 > wheels.len() {
            let expected = format!("at most {} for {} wheels", wheels.len() - 3, wheels.len());
            return Err(self.value_error("contact.free_joints", expected, free_joints.len()));
        }
        Ok(Contact {
            split: self.split(wheels, polygon, &free_joints)?,
            free_joints,
            radii_differ: wheels.iter().any(|w| w.radius != wheels[0].radius),
            tyres_deflect: spec.tyre_stiffness.is_some(),
            ground: spec.ground,
        })
    }

    fn split(
        &self,
        wheels: &[Wheel],
        polygon: &SupportPolygon,
        free_joints: &[FreeJoint],
    ) -> Result<Split, MachineError> {
        let spec = &self.spec.contact;
        let share = match spec.front_share {
            Some(share) if !(0.0..=1.0).contains(&share) => {
                return Err(self.value_error("contact.front_share", "0 to 1", share));
            }
            Some(share) => share,
            None if matches!(spec.tyre_stiffness, Some(Stiffness::PerWheel(_))) => {
                return Ok(Split::Springs);
            }
            None => 0.5,
        };
        let edges = polygon.edges();
        if wheels.len() != 4 || edges.len() != 4 || !free_joints.is_empty() {
            return match spec.front_share {
                Some(_) => Err(self.value_error(
                    "contact.front_share",
                    "four wheels at four corners and no free joints",
                    "another machine",
                )),
                None => Ok(Split::Springs),
            };
        }
        let (front, rear) = (&edges[0], &edges[2]);
        Ok(Split::FrontShare {
            share,
            wheels: [front.to, front.from, rear.from, rear.to],
        })
    }

    fn imu(&self) -> Result<Mount, MachineError> {
        let base = self
            .tree
            .links
            .iter()
            .position(|l| l.name == self.tree.base_link)
            .unwrap_or(0);
        if self.log.lacks_imu {
            return Ok(self.mount(
                base,
                Isometry3::identity(),
                "no IMU: reckoned at the base origin from odometry",
            ));
        }
        if let Some(imu) = &self.spec.imu {
            let link = imu
                .link
                .as_ref()
                .map_or(Ok(base), |name| self.link("imu.link", name))?;
            let [roll, pitch, yaw] = imu.rpy;
            let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let pose = Isometry3::from_parts(Translation3::from(Vector3::from(imu.xyz)), rotation);
            return Ok(self.mount(link, pose, "[imu] of the machine file"));
        }
        let named = self
            .log
            .imu_frame
            .map(|f| f.trim_start_matches('/'))
            .filter(|f| !f.is_empty());
        Ok(match named.map(|frame| (frame, self.tree.link(frame))) {
            Some((frame, Some(link))) => self.mount(
                link,
                Isometry3::identity(),
                format!("link \"{frame}\" of the URDF, which the IMU's messages name"),
            ),
            Some((frame, None)) => {
                let source = format!(
                    "assumed at {}: the URDF has no link \"{frame}\", which the IMU's messages name",
                    self.tree.base_link
                );
                self.mount(base, Isometry3::identity(), source)
            }
            None => self.mount(
                base,
                Isometry3::identity(),
                format!("assumed at {}", self.tree.base_link),
            ),
        })
    }

    fn payloads(&self) -> Result<Vec<Payload>, MachineError> {
        self.spec
            .payload
            .iter()
            .enumerate()
            .map(|(i, spec)| {
                let place = format!("payload {}", i + 1);
                let link = &self.tree.links[self.link(&format!("{place}: link"), &spec.link)?];
                let [xx, yy, zz, xy, xz, yz] = spec.inertia;
                let about_com = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                let inertia = Inertia {
                    mass: spec.mass,
                    com: spec.com.into(),
                    about_com,
                };
                inertia.check().map_err(|fault| {
                    self.value_error(place.clone(), fault.expected, fault.found)
                })?;
                let window_s = [
                    spec.from.unwrap_or(f64::NEG_INFINITY),
                    spec.to.unwrap_or(f64::INFINITY),
                ];
                if !(window_s[0] < window_s[1]) {
                    return Err(self.value_error(
                        place,
                        "from before to",
                        format!("{} and {}", window_s[0], window_s[1]),
                    ));
                }
                Ok(Payload {
                    body: link.body,
                    inertia: inertia.transformed(&link.body_from_link),
                    window_s,
                })
            })
            .collect()
    }

    fn check_suspension(&self) -> Result<(), MachineError> {
        let Some(suspension) = &self.spec.suspension else {
            return Ok(());
        };
        for name in &suspension.linkages {
            if !self.spec.linkage.iter().any(|l| &l.name == name) {
                return Err(self.value_error(
                    "suspension.linkages",
                    "names of [[linkage]] tables",
                    format!("\"{name}\""),
                ));
            }
        }
        let [least, greatest] = suspension.stroke;
        if !(least < greatest) {
            return Err(self.value_error(
                "suspension.stroke",
                "[least, greatest] in metres",
                format!("[{least}, {greatest}]"),
            ));
        }
        Ok(())
    }
}

fn body((body, drive): (&TreeBody, &Option<Drive>)) -> Body {
    Body {
        name: body.link.clone(),
        parent: body.parent,
        kind: body
            .joint
            .as_ref()
            .map_or(JointKind::Revolute, |j: &TreeJoint| j.kind),
        drive: drive.unwrap_or(Drive::Root),
        parent_from_joint: *body
            .parent_from_joint
            .rotation
            .to_rotation_matrix()
            .matrix(),
        joint_in_parent: body.parent_from_joint.translation.vector,
        inertia: body.inertia,
    }
}
