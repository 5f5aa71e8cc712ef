//! Mounting pose of the IMU: from the machine file, else the URDF, else the log's static transforms, with a
//! check for conflicts between them.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use tipwatch_language::{say, word};

use super::checker::Checker;
use crate::machine::static_transform::ancestors;
use crate::machine::{MachineError, Mount, MountSource, Note, NoteKind, Wheel};

/// Distance between two sources of the mounting pose beyond which they conflict (m).
const CONFLICT_M: f64 = 1e-3;
/// Angle between them beyond which they conflict (rad).
const CONFLICT_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;

impl Checker<'_> {
    /// The mounting of the IMU, and descriptions of conflicts between its sources.
    pub(super) fn imu(&self, wheels: &[Wheel]) -> Result<(Mount, Vec<Note>), MachineError> {
        let at_base = |source| self.mount(self.base(), Isometry3::identity(), source);
        if self.log.lacks_imu {
            return Ok((at_base(MountSource::NoSensor), Vec::new()));
        }
        let frame = self.log.imu_frame.map(|f| f.trim_start_matches('/'));
        let frame = frame.filter(|frame| !frame.is_empty());
        let mut sources: Vec<Mount> = self.stated_imu(wheels)?.into_iter().collect();
        if let Some(frame) = frame {
            sources.extend(self.places_of(frame));
        }
        if sources.is_empty() {
            let assumed = MountSource::Assumed {
                base: self.tree.base_link.clone(),
                frame: frame.map(str::to_owned),
            };
            return Ok((at_base(assumed), Vec::new()));
        }
        let notes = sources[1..].iter().filter_map(|m| conflict(&sources[0], m));
        let notes = notes.take(1).collect();
        Ok((sources.swap_remove(0), notes))
    }

    fn base(&self) -> usize {
        self.tree.link(&self.tree.base_link).unwrap_or(0)
    }

    fn stated_imu(&self, wheels: &[Wheel]) -> Result<Option<Mount>, MachineError> {
        let Some(imu) = &self.spec.imu else {
            return Ok(None);
        };
        let link = match &imu.link {
            Some(name) => self.link("imu.link", name)?,
            None => self.base(),
        };
        self.check_place("imu.xyz", imu.xyz, wheels)?;
        self.check_turn("imu.rpy", imu.rpy)?;
        let [roll, pitch, yaw] = imu.rpy;
        let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        let pose = Isometry3::from_parts(Translation3::from(Vector3::from(imu.xyz)), rotation);
        Ok(Some(self.mount(link, pose, MountSource::MachineFile)))
    }

    /// Poses of the frame of messages: that of the link of this name, then those of the static transforms in links of
    /// the URDF, the nearest first.
    pub(super) fn places_of(&self, frame: &str) -> Vec<Mount> {
        let own = self.tree.link(frame).map(|link| {
            let source = MountSource::MessageFrame {
                frame: frame.into(),
            };
            self.mount(link, Isometry3::identity(), source)
        });
        let in_links = ancestors(self.log.static_transforms, frame).into_iter();
        let mount = |(parent, pose): (&str, _)| {
            let source = MountSource::StaticTransform {
                frame: frame.into(),
                parent: parent.into(),
            };
            Some(self.mount(self.tree.link(parent)?, pose, source))
        };
        own.into_iter().chain(in_links.filter_map(mount)).collect()
    }
}

/// Describes the conflict between the mounting in use and another source.
fn conflict(used: &Mount, other: &Mount) -> Option<Note> {
    let apart = used.body_from_mount.inverse() * other.body_from_mount;
    let (distance, angle) = (apart.translation.vector.norm(), apart.rotation.angle());
    let how = if used.body != other.body {
        word!("on another body").to_string()
    } else if distance > CONFLICT_M || angle > CONFLICT_RAD {
        let (millimetres, degrees) = (distance * 1e3, angle.to_degrees());
        say!("{millimetres:.1} mm and {degrees:.2} degrees away")
    } else {
        return None;
    };
    let text = say!(
        "Conflicting mounting poses of the IMU: used {}; {} places it {how}.",
        used.source,
        other.source
    );
    Some(Note::new(NoteKind::ImuMountingConflict, text))
}
