//! Guesses the mounting of the IMU (inertial measurement unit).

use anyhow::Result;
use nalgebra::Vector3;
use tipwatch_binding::static_transforms;
use tipwatch_ingest::{Log, SensorKind, SensorRequest, record_sensors};
use tipwatch_mechanics::MachineSpec;
use tipwatch_mechanics::machine::{LogFacts, Machine, MountSource, Outline};

use super::signals::Topics;
use super::text::{Text, quoted, triple};
use super::urdf::Urdf;
use super::words::has_word;

/// The section `[imu]`.
#[derive(Debug, Default)]
pub(super) struct ImuSection {
    pub(super) text: String,
    /// The link on which a doubtful IMU is assumed; `None` is the base link.
    pub(super) link: Option<String>,
    /// Whether position and orientation are a guess that a person must confirm.
    pub(super) is_doubtful: bool,
    /// Whether the log has a specific force at all.
    pub(super) has_samples: bool,
}

/// Writes the section `[imu]` from the rest of the machine file, the URDF and the log.
pub(super) fn section(
    log: &Log,
    spec: &MachineSpec,
    urdf: Option<&Urdf>,
    topics: &Topics,
    outline: Option<&Outline>,
) -> Result<ImuSection> {
    let mut text = Text::default();
    text.gap();
    let Some(topic) = topics.imu() else {
        if topics.can.has_imu() {
            open(&mut text, None);
            return Ok(ImuSection {
                text: text.finish().trim_end().to_owned(),
                has_samples: true,
                ..ImuSection::default()
            });
        }
        text.comment("No IMU with messages found.");
        return Ok(ImuSection {
            text: text.finish().trim_end().to_owned(),
            ..ImuSection::default()
        });
    };
    let transforms = static_transforms(log)?;
    let facts = LogFacts {
        imu_frame: topics.imu_frame.as_deref(),
        static_transforms: &transforms,
        ..LogFacts::default()
    };
    let machine = urdf.and_then(|urdf| spec.check(&urdf.text, &urdf.name, facts).ok());
    let is_assumed =
        |machine: &Machine| matches!(machine.imu().source, MountSource::Assumed { .. });
    let machine = machine.filter(|machine| !is_assumed(machine));
    let is_doubtful = !matches!((&machine, &topics.imu_frame), (Some(_), Some(_)));
    let named = outline.and_then(named_imu);
    match (&machine, topics.imu_frame.as_deref()) {
        (Some(machine), Some(frame)) => known(&mut text, machine, frame),
        (_, frame) => match named {
            Some(link) => by_name(&mut text, link, frame),
            None => open(&mut text, frame),
        },
    }
    let mean = mean_of(log, topic, SensorKind::Imu)?;
    match &mean {
        Some(mean) => {
            text.comment(&format!(
            "Mean specific force over the log, in sensor axes: ({:.2}, {:.2}, {:.2}) m/s^2. On level ground it points up.",
            mean.x, mean.y, mean.z
        ));
        }
        None => {
            text.comment(&format!(
                "No message of {topic} has a finite specific force."
            ));
        }
    }
    Ok(ImuSection {
        text: text.finish().trim_end().to_owned(),
        link: named.map(str::to_owned),
        is_doubtful,
        has_samples: mean.is_some(),
    })
}

impl ImuSection {
    /// The section with the pose that a person stated: position (m), and roll, pitch and yaw (rad). It is confirmed where
    /// both were.
    pub(super) fn state(&mut self, base_link: &str, xyz: Option<[f64; 3]>, rpy: Option<[f64; 3]>) {
        let mut text = Text::default();
        text.gap().comment("Stated at the terminal.");
        text.line(&format!(
            "[imu]\nlink = {}\nxyz = {}\nrpy = {}",
            quoted(self.link.as_deref().unwrap_or(base_link)),
            triple(xyz.unwrap_or_default()),
            triple(rpy.unwrap_or_default())
        ));
        self.text = text.finish().trim_end().to_owned();
        self.is_doubtful = xyz.is_none() || rpy.is_none();
    }
}

fn known(text: &mut Text, machine: &Machine, frame: &str) {
    let mount = machine.imu();
    text.comment(&format!("From {}.", mount.source));
    if matches!(mount.source, MountSource::MessageFrame { .. }) {
        text.line(&format!("[imu]\nlink = {}", quoted(frame)));
        return;
    }
    if mount.body != 0 {
        text.comment(
            "It is on a moving link and was found automatically; live operation needs it here.",
        );
        text.open("[imu]\nlink = \"\"\nxyz = [0.0, 0.0, 0.0]\nrpy = [0.0, 0.0, 0.0]");
        return;
    }
    let pose = mount.body_from_mount;
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    text.line(&format!(
        "[imu]\nlink = {}\nxyz = {}\nrpy = {}",
        quoted(machine.base_link()),
        triple(pose.translation.vector.into()),
        triple([roll, pitch, yaw])
    ));
}

/// The only link named like an IMU.
fn named_imu(outline: &Outline) -> Option<&str> {
    let mut links = outline
        .links
        .iter()
        .filter(|link| has_word(&link.name, &["imu"]));
    let first = links.next()?;
    links.next().is_none().then_some(first.name.as_str())
}

fn by_name(text: &mut Text, link: &str, frame: Option<&str>) {
    text.comment(&format!(
        "Guessed from the link's name: CHECK position and orientation; {}.",
        unknown_frame(frame)
    ));
    text.line(&format!("[imu]\nlink = {}", quoted(link)));
}

/// Describes why the frame of the messages does not give the mounting.
fn unknown_frame(frame: Option<&str>) -> String {
    match frame {
        Some(frame) => {
            format!(
                "its messages have frame {frame}, which is neither in the URDF nor in /tf_static"
            )
        }
        None => "its messages have no frame".into(),
    }
}

fn open(text: &mut Text, frame: Option<&str>) {
    text.comment(&format!(
        "Needed: position and orientation of the IMU; {}. Default: at the base, aligned with it.",
        unknown_frame(frame)
    ));
    text.open(
        "[imu]\nlink = \"base_link\"\nxyz = [0.0, 0.0, 0.0]  # m\nrpy = [0.0, 0.0, 0.0]  # rad",
    );
}

/// Mean of the first three numbers of a sensor, the specific force or the velocity; `None` if no message has them.
pub(super) fn mean_of(log: &Log, topic: &str, kind: SensorKind) -> Result<Option<Vector3<f64>>> {
    let Some(topic) = log.topics().iter().find(|t| t.name == topic) else {
        return Ok(None);
    };
    let request = SensorRequest::typed(topic.id, kind, Vec::new());
    let Ok((recordings, _)) = record_sensors(log, &[request], &mut |_| {}) else {
        return Ok(None);
    };
    let recording = &recordings[0];
    let samples = (0..recording.stamps_ns.len()).map(|i| recording.sample(i));
    let forces = samples.map(|v| Vector3::new(v[0], v[1], v[2]));
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for force in forces.filter(|force| force.iter().all(|c| c.is_finite())) {
        sum += force;
        count += 1.0;
    }
    Ok((count > 0.0).then(|| sum / count))
}
