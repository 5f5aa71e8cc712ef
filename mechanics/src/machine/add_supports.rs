//! Adds supports and points of tracks to the wheels of a machine file.

use super::spec::{MachineSpec, WheelSpec};
use super::support_spec::{MeasuredLoad, SupportKind, SupportOrigin};
use super::{MAX_WHEELS, MachineError};

impl MachineSpec {
    /// Makes wheels of the supports and tracks.
    pub(super) fn add_supports(&mut self) -> Result<(), MachineError> {
        for (name, support) in std::mem::take(&mut self.supports) {
            let place = format!("supports.{name}");
            if support.set.is_none() && support.force.is_none() {
                let expected = "set = true, spans of time or a signal, or force = { topic, field }";
                return Err(MachineError::value(&self.file, place, expected, "neither"));
            }
            let wheel = WheelSpec {
                link: support.link,
                radius: support.radius,
                raised: None,
                raised_by: Vec::new(),
                origin: SupportOrigin {
                    kind: SupportKind::Foot,
                    xyz: support.xyz,
                    stiffness: support.stiffness,
                    set: support.set,
                    force: support.force.map(|field| MeasuredLoad {
                        field,
                        sigma: support.force_sigma,
                        friction_share: support.friction_share,
                    }),
                },
            };
            self.add_support(&place, name, wheel)?;
        }
        for (name, track) in std::mem::take(&mut self.tracks) {
            let place = format!("tracks.{name}");
            if !(2..=MAX_WHEELS / 2).contains(&track.points) {
                let expected = format!("2 to {} points", MAX_WHEELS / 2);
                let place = format!("{place}.points");
                return Err(MachineError::value(
                    &self.file,
                    place,
                    expected,
                    track.points,
                ));
            }
            for point in 0..track.points {
                let share = point as f64 / (track.points - 1) as f64;
                let along = |k: usize| track.from[k] + share * (track.to[k] - track.from[k]);
                let wheel = WheelSpec {
                    link: track.link.clone(),
                    radius: 0.0,
                    raised: track.raised.clone(),
                    raised_by: track.raised_by.clone(),
                    origin: SupportOrigin {
                        kind: SupportKind::TrackPoint,
                        xyz: std::array::from_fn(along),
                        stiffness: track.stiffness,
                        ..SupportOrigin::default()
                    },
                };
                self.add_support(&place, format!("{name}_{}", point + 1), wheel)?;
            }
        }
        Ok(())
    }

    fn add_support(
        &mut self,
        place: &str,
        name: String,
        wheel: WheelSpec,
    ) -> Result<(), MachineError> {
        if self.wheels.contains_key(&name) {
            let expected = "names that no other wheel, support or track has";
            return Err(MachineError::value(
                &self.file,
                place,
                expected,
                format!("\"{name}\" twice"),
            ));
        }
        self.wheels.insert(name, wheel);
        Ok(())
    }
}
