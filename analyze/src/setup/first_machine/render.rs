//! The text of a first machine file.

use tipwatch_ingest::Log;
use tipwatch_mechanics::machine::JointMotion;

use super::guesses::Guesses;
use super::imu::ImuSection;
use super::linkages::LinkageGuess;
use super::reference;
use super::signals::Topics;
use super::text::{Text, array, key, number, quoted};
use super::urdf::Urdf;
use super::write_options::WriteOptions;

pub(super) fn rendered(
    log: &Log,
    urdf: Option<&Urdf>,
    topics: &Topics,
    guesses: Option<&Guesses>,
    imu: &ImuSection,
    options: WriteOptions,
    verdict: &str,
) -> String {
    let mut text = Text::default();
    let path = log.path().display();
    text.comment(&format!(
        "First machine file, guessed by tipwatch {} from {path}. Check every line and complete the lines that are \
         commented out. Keys and units: book/src/reference/machine-file.md. Check the result with `tipwatch check-machine`.",
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
            text.comment(&format!("The URDF is in the log: {name}."));
        }
        Some(Urdf {
            line: Some(line), ..
        }) => {
            text.line(line);
        }
    }
    if options.accepts_inertias {
        text.comment(
            "Inertias of the URDF that no body can have are replaced, with their uncertainty.",
        );
        text.line("accept_inertias = true");
    }
    write_doubts(&mut text, guesses, imu);
    if let Some(guesses) = guesses {
        write_wheels(&mut text, guesses);
        text.line(&imu.text);
        write_arm(&mut text, guesses);
        write_linkages(&mut text, &guesses.linkages);
        write_contact(&mut text, guesses);
        reference::write(&mut text, guesses, &topics.joints());
    } else {
        text.gap()
            .comment("Needed, three or more: the wheels.")
            .open("[wheels.FL]\nlink = \"wheel_front_left\"\nradius = 0.35  # m");
        text.line(&imu.text);
    }
    topics.write(log, &mut text);
    if let Some(guesses) = guesses {
        write_joints(&mut text, guesses);
    }
    topics.can.write_weights(&mut text);
    text.gap()
        .comment("Weighed loads, for comparison with the model by `tipwatch check-machine`:")
        .open("[weighed]\nunit = \"kg\"\nsums = [ { name = \"front axle\", wheels = [\"FL\", \"FR\"], load = 0, sigma = 10 } ]");
    text.finish()
}

/// Lists the guesses that widen the standard deviations until a person has confirmed them.
fn write_doubts(text: &mut Text, guesses: Option<&Guesses>, imu: &ImuSection) {
    let mut doubts: Vec<String> = Vec::new();
    if imu.is_doubtful {
        doubts.push("imu".into());
    }
    if let Some(guesses) = guesses {
        let wheels = guesses.wheels.iter();
        let guessed = wheels.filter(|wheel| wheel.is_doubtful && wheel.radius.is_some());
        doubts.extend(guessed.map(|wheel| format!("wheels.{}.radius", wheel.name)));
        let joints = guesses.joints.iter().filter(|joint| joint.is_doubtful);
        doubts.extend(joints.map(|joint| format!("signals.joints.{}", joint.joint)));
        let frozen = guesses.frozen.iter();
        doubts.extend(frozen.map(|joint| format!("signals.joints.{joint}")));
    }
    if !doubts.is_empty() {
        text.comment(
            "Guesses with a wide standard deviation. Check each value, then remove its name from this list:",
        );
        text.line(&format!("unconfirmed = {}", array(&doubts)));
    }
}

fn write_wheels(text: &mut Text, guesses: &Guesses) {
    text.gap();
    for note in &guesses.rejected {
        text.comment(note);
    }
    if guesses.wheels.len() < 3 {
        text.comment(&format!(
            "Needed: three or more wheels; {} found by name or shape.",
            guesses.wheels.len()
        ));
    }
    for wheel in &guesses.wheels {
        let link = &guesses.outline.links[wheel.link].name;
        let head = format!("[wheels.{}]\nlink = {}", key(&wheel.name), quoted(link));
        text.comment(&format!("Wheel: {}.", wheel.why));
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
                    "Needed: its radius (m); the URDF has neither a round shape nor a ground frame.",
                );
                text.open(&format!("{head}\nradius = 0.0"));
            }
        }
    }
}

fn write_arm(text: &mut Text, guesses: &Guesses) {
    text.gap();
    let Some(arm) = &guesses.arm else {
        text.comment("No manipulator found (a moving part without wheels, named arm, boom, crane or the like).");
        text.open("[arm]\nroot = \"arm_link\"\ntool = \"tool_link\"");
        return;
    };
    text.line("[arm]");
    text.comment(&format!("Root: {}.", arm.why));
    text.line(&format!("root = {}", quoted(&arm.link)));
    match &guesses.tool {
        Some(tool) => {
            text.comment(&format!("Tool, on which a wrench acts: {}.", tool.why));
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
            "Cylinder: {}. Needed: the positions of its eyes (m), which are not in the URDF.",
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

/// Joints with horizontal axes between base and wheels, which may be free.
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
            let is_horizontal =
                joint.motion != JointMotion::Prismatic && joint.axis_in_base.z.abs() < 0.5;
            (link.moves() && is_horizontal && carries_wheel(index)).then(|| quoted(&joint.name))
        });
    let pivots: Vec<String> = pivots.collect();
    if !pivots.is_empty() {
        text.gap()
            .comment("Joints between base and wheels. List those that carry no torque (bogies, a frame roll joint):")
            .open(&format!("[contact]\nfree_joints = [{}]", pivots.join(", ")));
    }
}

pub(super) fn write_joints(text: &mut Text, guesses: &Guesses) {
    for guess in &guesses.joints {
        text.gap()
            .comment(&format!("{}: {}.", guess.joint, guess.why));
        text.line(&format!("[signals.joints.{}]", key(&guess.joint)));
        for line in &guess.lines {
            text.line(line);
        }
    }
    for joint in &guesses.frozen {
        let [mass, share] = guesses.carried_mass(joint);
        text.gap().comment(&format!(
            "Held still: joint {joint} is in no message. It carries {mass:.1} kg, {:.1} % of the mass.",
            100.0 * share
        ));
        text.line(&format!("[signals.joints.{}]", key(joint)));
        text.line(&format!("position = {}", number(guesses.rest(joint))));
    }
    for joint in &guesses.unknown {
        let [mass, share] = guesses.carried_mass(joint);
        text.gap().comment(&format!(
            "Needed: the position of joint {joint} (rad or m), which is in no message and carries {mass:.1} kg, {:.1} % of the \
             mass: a field, or a constant if it never moves, such as position = 0.0 (--freeze-passive writes that).",
            100.0 * share
        ));
        let candidates = guesses
            .candidates
            .get(joint)
            .map(Vec::as_slice)
            .unwrap_or_default();
        let position = match candidates.first() {
            None => r#"{ topic = "/topic", field = "field", scale = 1.0, offset = 0.0 }"#,
            Some(first) => {
                let all = candidates
                    .iter()
                    .map(|it| format!("{} ({:.3} to {:.3})", it.signal, it.span[0], it.span[1]));
                text.comment(&format!(
                    "By unit and motion it may be: {}. CHECK which, its sign and its zero.",
                    all.collect::<Vec<_>>().join(", ")
                ));
                &first.text
            }
        };
        text.open(&format!(
            "[signals.joints.{}]\nposition = {position}",
            key(joint)
        ));
    }
}
