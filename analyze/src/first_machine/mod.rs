//! `inspect --write-machine`: a first machine file, guessed from a log and a URDF, each guess with its
//! reason. What cannot be guessed is left open behind a `#`, with what is needed.

mod arm;
mod imu;
mod joints;
mod linkages;
mod signals;
mod text;
mod wheels;
mod words;

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result};
use tipwatch_binding::bind;
use tipwatch_ingest::{Log, robot_description};
use tipwatch_mechanics::MachineSpec;
use tipwatch_mechanics::machine::{JointMotion, Outline};

use joints::JointGuess;
use linkages::LinkageGuess;
use signals::Topics;
use text::{Text, key, number, quoted};
use wheels::Wheel;

/// A URDF for the guesses.
struct Urdf {
    text: String,
    /// What to call it in messages.
    name: String,
    /// The line of the machine file that names it; none where the log carries it.
    line: Option<String>,
}

/// Writes a first machine file to `out`, which must not exist; tells what it still lacks, if anything.
///
/// # Errors
/// The log or the URDF cannot be read, or the file exists or cannot be written.
pub fn write(log: &Path, urdf: Option<&Path>, out: &Path) -> Result<Option<String>> {
    let log = Log::open(log)?;
    let urdf = find_urdf(&log, urdf, out)?;
    let (body, lacking) = machine_file(&log, urdf.as_ref(), out)?;
    let mut file = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(out)
        .with_context(|| {
            format!(
                "{}: expected a file that does not exist yet and can be written",
                out.display()
            )
        })?;
    file.write_all(body.as_bytes())
        .with_context(|| format!("{}: cannot be written", out.display()))?;
    Ok(lacking)
}

fn find_urdf(log: &Log, given: Option<&Path>, out: &Path) -> Result<Option<Urdf>> {
    let Some(path) = given else {
        let described = robot_description(log)?;
        return Ok(described.map(|(text, topic)| Urdf {
            text,
            name: format!("topic {topic}"),
            line: None,
        }));
    };
    let unreadable = || format!("{}: cannot be read", path.display());
    let text = std::fs::read_to_string(path).with_context(unreadable)?;
    let absolute = path.canonicalize().with_context(unreadable)?;
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok();
    let beside = folder.and_then(|folder| absolute.strip_prefix(folder).ok().map(Path::to_owned));
    let line = beside.unwrap_or(absolute).display().to_string();
    Ok(Some(Urdf {
        text,
        name: path.display().to_string(),
        line: Some(format!("urdf = {}", quoted(&line))),
    }))
}

/// The text of the file, and what it lacks.
fn machine_file(log: &Log, urdf: Option<&Urdf>, out: &Path) -> Result<(String, Option<String>)> {
    let topics = Topics::find(log)?;
    let outline = urdf.map(|urdf| Outline::read(&urdf.text, &urdf.name));
    let outline = outline.transpose()?;
    let guesses = outline.map(|outline| Guesses::of(outline, &topics, log));
    let name = out.display().to_string();
    // where the IMU sits is told by the rest of the machine
    let without_imu = rendered(log, urdf, &topics, guesses.as_ref(), "", "");
    let spec = MachineSpec::from_toml(&without_imu, &name)?;
    let outline = guesses.as_ref().map(|guesses| &guesses.outline);
    let imu = imu::section(log, &spec, urdf, &topics, outline)?;
    let whole = rendered(log, urdf, &topics, guesses.as_ref(), &imu, "");
    let spec = MachineSpec::from_toml(&whole, &name)?;
    let lacking = match urdf {
        None => {
            Some("a URDF: the log carries none on /robot_description; give one with --urdf".into())
        }
        Some(urdf) => bind(log, &spec, &urdf.text, &urdf.name)
            .err()
            .map(|error| error.to_string()),
    };
    let verdict = match &lacking {
        None => "With it the log can be analysed as it stands.".to_owned(),
        Some(lacking) => {
            format!("It does not describe the machine yet. First of what is missing: {lacking}")
        }
    };
    Ok((
        rendered(log, urdf, &topics, guesses.as_ref(), &imu, &verdict),
        lacking,
    ))
}

/// What is guessed from a URDF.
struct Guesses {
    outline: Outline,
    wheels: Vec<Wheel>,
    passed_over: Vec<String>,
    linkages: Vec<LinkageGuess>,
    joints: Vec<JointGuess>,
    /// Joints that nothing tells.
    unknown: Vec<String>,
    arm: Option<arm::Guess>,
    tool: Option<arm::Guess>,
}

impl Guesses {
    fn of(outline: Outline, topics: &Topics, log: &Log) -> Self {
        let logged = topics.joints();
        let (wheels, passed_over) = wheels::wheels(&outline);
        let linkages = linkages::linkages(&outline, &logged);
        let arm = arm::root(&outline, &wheels);
        let tool = arm
            .as_ref()
            .and_then(|arm| arm::tool(&outline, &arm.link, topics.wrench_frame.as_deref()));
        let mut joints = Vec::new();
        let mut unknown = Vec::new();
        for (link, described) in outline.links.iter().enumerate() {
            let Some(joint) = described.joint.as_ref().filter(|_| described.moves()) else {
                continue;
            };
            let follows = |l: &LinkageGuess| {
                l.cylinder == joint.name || {
                    // one of both is enough
                    let of_linkage = [&l.pivot, &l.rod];
                    of_linkage.contains(&&joint.name)
                        && of_linkage.iter().any(|name| logged.contains(name))
                }
            };
            let is_wheel = wheels.iter().any(|wheel| wheel.link == link);
            let is_known = logged.contains(&joint.name) || joint.mimics || is_wheel;
            if is_known || linkages.iter().any(follows) {
                continue;
            }
            match joints::find(&joint.name, &topics.joint_states, log.topics()) {
                Some(guess) => joints.push(guess),
                None => unknown.push(joint.name.clone()),
            }
        }
        // a rod need not be known where the pivot is, nor the other way round
        let found = |name: &String| joints.iter().any(|guess| guess.joint == *name);
        let spared: Vec<&String> = (linkages.iter())
            .filter_map(|l| match (found(&l.pivot), found(&l.rod)) {
                (true, _) => Some(&l.rod),
                (_, true) => Some(&l.pivot),
                _ => None,
            })
            .collect();
        unknown.retain(|name| !spared.contains(&name));
        Self {
            arm,
            tool,
            wheels,
            passed_over,
            linkages,
            joints,
            unknown,
            outline,
        }
    }
}

fn rendered(
    log: &Log,
    urdf: Option<&Urdf>,
    topics: &Topics,
    guesses: Option<&Guesses>,
    imu: &str,
    verdict: &str,
) -> String {
    let mut text = Text::default();
    let path = log.path().display();
    text.comment(&format!(
        "First machine file, guessed by tipwatch {} from {path}. Check every line; complete what stands behind a #. \
         Keys and units: MACHINE_FILE.md. `tipwatch check-machine` shows what it describes.",
        env!("CARGO_PKG_VERSION")
    ));
    text.comment(verdict);
    let stem = log.path().file_stem().unwrap_or_default();
    text.line(&format!("name = {}", quoted(&stem.to_string_lossy())));
    match urdf {
        None => {
            text.comment("Needed: bodies, joints and masses of the machine.");
            text.open("urdf = \"machine.urdf\"");
        }
        Some(Urdf {
            line: None, name, ..
        }) => {
            text.comment(&format!("The URDF comes from the log: {name}."));
        }
        Some(Urdf {
            line: Some(line), ..
        }) => {
            text.line(line);
        }
    }
    if let Some(guesses) = guesses {
        write_wheels(&mut text, guesses);
        text.line(imu);
        write_arm(&mut text, guesses);
        write_linkages(&mut text, &guesses.linkages);
        write_contact(&mut text, guesses);
    } else {
        text.gap()
            .comment("Needed, three or more: the links that stand on the ground.")
            .open("[wheels.FL]\nlink = \"wheel_front_left\"\nradius = 0.35  # m");
        text.line(imu);
    }
    topics.write(&mut text);
    if let Some(guesses) = guesses {
        write_joints(&mut text, guesses);
    }
    text.gap()
        .comment("What scales said, to hold the model against with `tipwatch check-machine`:")
        .open("[weighed]\nunit = \"kg\"\nsums = [ { name = \"front axle\", wheels = [\"FL\", \"FR\"], load = 0, sigma = 10 } ]");
    text.finish()
}

fn write_wheels(text: &mut Text, guesses: &Guesses) {
    text.gap();
    for note in &guesses.passed_over {
        text.comment(note);
    }
    if guesses.wheels.len() < 3 {
        text.comment(&format!(
            "Needed: three wheels or more; {} found by name or shape.",
            guesses.wheels.len()
        ));
    }
    for wheel in &guesses.wheels {
        let link = &guesses.outline.links[wheel.link].name;
        let head = format!("[wheels.{}]\nlink = {}", key(&wheel.name), quoted(link));
        text.comment(&format!(
            "A wheel by {}.",
            wheel.why.trim_start_matches("by ")
        ));
        match &wheel.radius {
            Some((radius, why)) => {
                head.lines().for_each(|line| {
                    text.line(line);
                });
                text.comment(&format!("Radius (m): {why}."));
                text.line(&format!("radius = {}", number(*radius)));
            }
            None => {
                text.comment(
                    "Needed: its radius (m); the URDF has no round shape and no ground frame.",
                );
                text.open(&format!("{head}\nradius = 0.0"));
            }
        }
    }
}

fn write_arm(text: &mut Text, guesses: &Guesses) {
    text.gap();
    let Some(arm) = &guesses.arm else {
        text.comment("No manipulator found: a moving part without wheels, named arm, boom, crane or the like.");
        text.open("[arm]\nroot = \"arm_link\"\ntool = \"tool_link\"");
        return;
    };
    text.line("[arm]");
    text.comment(&format!("Root: {}.", arm.why));
    text.line(&format!("root = {}", quoted(&arm.link)));
    match &guesses.tool {
        Some(tool) => {
            text.comment(&format!("Tool, where a wrench acts: {}.", tool.why));
            text.line(&format!("tool = {}", quoted(&tool.link)));
        }
        None => {
            text.open("tool = \"tool_link\"  # where a tool wrench is measured");
        }
    }
}

fn write_linkages(text: &mut Text, linkages: &[LinkageGuess]) {
    for guess in linkages {
        text.gap().comment(&format!(
            "A cylinder: {}. Needed: where its eyes are (m); the URDF does not tell.",
            guess.why
        ));
        text.open(&format!(
            "[[linkage]]\nname = {}\npivot = {}\ncylinder = {}\nrod = {}\n\
             rod_end = {{ link = {}, xyz = [0.0, 0.0, 0.0] }}\nanchor = {{ link = {}, xyz = [0.0, 0.0, 0.0] }}",
            quoted(&guess.name),
            quoted(&guess.pivot),
            quoted(&guess.cylinder),
            quoted(&guess.rod),
            quoted(&guess.rod_link),
            quoted(&guess.pivot_link)
        ));
    }
}

/// Joints between base and wheels about lying axes may carry no torque.
fn write_contact(text: &mut Text, guesses: &Guesses) {
    let outline = &guesses.outline;
    let carries_wheel = |link: usize| {
        let wheels = guesses.wheels.iter();
        wheels
            .filter(|w| w.link != link && outline.is_below(w.link, link))
            .count()
            > 0
    };
    let pivots = outline
        .links
        .iter()
        .enumerate()
        .filter_map(|(index, link)| {
            let joint = link.joint.as_ref()?;
            let is_lying =
                joint.motion != JointMotion::Prismatic && joint.axis_in_base.z.abs() < 0.5;
            (link.moves() && is_lying && carries_wheel(index)).then(|| quoted(&joint.name))
        });
    let pivots: Vec<String> = pivots.collect();
    if !pivots.is_empty() {
        text.gap()
            .comment("Joints between the base and wheels: if they carry no torque (bogies, a frame roll joint), say so.")
            .open(&format!("[contact]\nfree_joints = [{}]", pivots.join(", ")));
    }
}

fn write_joints(text: &mut Text, guesses: &Guesses) {
    for guess in &guesses.joints {
        text.gap()
            .comment(&format!("{}: {}.", guess.joint, guess.why));
        text.line(&format!("[signals.joints.{}]", key(&guess.joint)));
        for line in &guess.lines {
            text.line(line);
        }
    }
    for joint in &guesses.unknown {
        text.gap().comment(&format!(
            "Needed: the position of joint {joint} (rad or m): no message names it. A joint that never moves can be made fixed in the URDF."
        ));
        text.open(&format!(
            "[signals.joints.{}]\nposition = {{ topic = \"/topic\", field = \"field\", scale = 1.0, offset = 0.0 }}",
            key(joint)
        ));
    }
}
