//! What is fixed to the bodies: the IMU and payloads.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use super::Checker;
use crate::machine::spec::{PayloadMass, PayloadSpec};
use crate::machine::{Inertia, Link, MachineError, MassMoments, Mount, Payload};

impl Checker<'_> {
    pub(super) fn imu(&self) -> Result<Mount, MachineError> {
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

    pub(super) fn payloads(&self, links: &[Link]) -> Result<Vec<Payload>, MachineError> {
        self.spec
            .payload
            .iter()
            .enumerate()
            .map(|(i, spec)| {
                let place = format!("payload {}", i + 1);
                let link = &links[self.link(&format!("{place}: link"), &spec.link)?];
                let (mass, is_estimated) = self.payload_mass(&place, spec)?;
                let [xx, yy, zz, xy, xz, yz] = spec.inertia;
                let about_com = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                let inertia = Inertia {
                    mass,
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
                let inertia = inertia.transformed(&link.body_from_link);
                Ok(Payload {
                    body: link.body,
                    group: link.group,
                    mass_sigma: spec.mass_sigma,
                    is_estimated,
                    moments: MassMoments::from(&inertia),
                    inertia,
                    window_s,
                })
            })
            .collect()
    }

    /// The mass as stated, or zero where it is to be estimated.
    fn payload_mass(&self, place: &str, spec: &PayloadSpec) -> Result<(f64, bool), MachineError> {
        match &spec.mass {
            PayloadMass::Known(mass) => Ok((*mass, false)),
            PayloadMass::Word(word) if word == "estimate" && spec.inertia == [0.0; 6] => {
                Ok((0.0, true))
            }
            PayloadMass::Word(word) if word == "estimate" => Err(self.value_error(
                place,
                "no inertia beside mass = \"estimate\": a payload of unknown mass counts as a point",
                format!("{:?}", spec.inertia),
            )),
            PayloadMass::Word(word) => Err(self.value_error(
                place,
                "a mass [kg] or \"estimate\"",
                format!("\"{word}\""),
            )),
        }
    }
}
