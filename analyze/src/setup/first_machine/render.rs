//! The text of a first machine file.

use super::draft::{Draft, Stated};
use super::guesses::Guesses;
use super::imu::ImuSection;
use super::joint_lines::{doubted, write_joints};
use super::linkages::LinkageGuess;
use super::reference;
use super::text::{Text, array, key, number, quoted, triple};
use super::urdf::Urdf;

/// The text of a draft with these guesses.
pub(super) fn rendered(draft: &Draft, guesses: Option<&Guesses>, verdict: &str) -> String {
    let Draft {
        log,
        urdf,
        topics,
        imu,
        options,
        stated,
        ..
    } = draft;
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
        write_wheels(&mut text, guesses, stated);
        write_supports(&mut text, guesses, stated);
        text.line(&imu.text);
        write_arm(&mut text, guesses);
        write_linkages(&mut text, &guesses.linkages);
        write_contact(&mut text, guesses, stated);
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
        write_stated(&mut text, guesses, stated);
    }
    let tool = guesses.and_then(|guesses| guesses.tool.as_ref());
    topics
        .can
        .write_weights(&mut text, tool.map(|tool| tool.link.as_str()));
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
        doubts.extend(doubted(guesses));
    }
    if !doubts.is_empty() {
        text.comment(
            "Guesses with a wide standard deviation. Check each value, then remove its name from this list:",
        );
        text.line(&format!("unconfirmed = {}", array(&doubts)));
    }
}

fn write_wheels(text: &mut Text, guesses: &Guesses, stated: &Stated) {
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
        // of other logs the spans in seconds, or a signal
        let raised = match stated.raised.contains(&wheel.name) {
            true => "\nraised = true  # stated at the terminal, of this log",
            false => "",
        };
        match &wheel.radius {
            Some((radius, why)) => {
                head.lines().for_each(|line| {
                    text.line(line);
                });
                text.comment(&format!("Radius (m): {why}."));
                text.line(&format!("radius = {}{raised}", number(*radius)));
            }
            None => {
                text.comment(
                    "Needed: its radius (m); the URDF has neither a round shape nor a ground frame.",
                );
                text.open(&format!("{head}\nradius = 0.0{raised}"));
            }
        }
    }
}

/// Writes the supports besides the wheels on which the machine stood, and those on which it may stand.
fn write_supports(text: &mut Text, guesses: &Guesses, stated: &Stated) {
    let feet = guesses.feet();
    if feet.is_empty() {
        return;
    }
    text.gap().comment(match stated.supports.is_empty() {
        true => "On these the machine may stand besides its wheels (outriggers, a blade). Complete what applies:",
        false => "Stated at the terminal: what the machine stood on during this log. For others: the spans in seconds, or a signal.",
    });
    for foot in feet {
        let table = format!(
            "[supports.{}]\nlink = {}\nxyz = [0.0, 0.0, 0.0]  # m, where it meets the ground, in the link: check\nset = true",
            key(&foot),
            quoted(&foot)
        );
        match stated.supports.contains(&foot) {
            true => text.line(&table),
            false => text.open(&table),
        };
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
        let [rod_end, anchor] = guess.eyes.unwrap_or_default().map(triple);
        let table = format!(
            "[[linkage]]\nname = {}\npivot = {}\ncylinder = {}\nrod = {}\n\
             rod_end = {{ link = {}, xyz = {rod_end} }}\nanchor = {{ link = {}, xyz = {anchor} }}",
            quoted(&guess.name),
            quoted(&guess.pivot),
            quoted(&guess.cylinder),
            quoted(&guess.rod),
            quoted(&guess.rod_link),
            quoted(&guess.pivot_link)
        );
        text.gap();
        match guess.eyes {
            Some(_) => {
                text.comment(&format!("Cylinder: {}.", guess.why))
                    .line(&table);
            }
            None => {
                text.comment(&format!(
                    "Cylinder: {}. Needed: the positions of its eyes (m), which are not in the URDF.",
                    guess.why
                ))
                .open(&table);
            }
        }
    }
}

/// Writes the contact between wheels and ground.
fn write_contact(text: &mut Text, guesses: &Guesses, stated: &Stated) {
    let mut lines = Vec::new();
    if !stated.free_joints.is_empty() {
        lines.push(format!("free_joints = {}", array(&stated.free_joints)));
    }
    if let Some(stiffness) = stated.tyre_stiffness {
        lines.push(format!(
            "ground = \"plane\"\ntyre_stiffness = {stiffness:?}"
        ));
    }
    if let Some(share) = stated.roll_moment_distribution {
        lines.push(format!("roll_moment_distribution = {share:?}"));
    }
    if !lines.is_empty() {
        text.gap()
            .comment("Stated at the terminal.")
            .line("[contact]");
        text.line(&lines.join("\n"));
    }
    let pivots = guesses.pivots();
    if !pivots.is_empty() && stated.free_joints.is_empty() {
        if lines.is_empty() {
            text.gap();
        }
        text.comment("Joints between base and wheels. List those that carry no torque (bogies, a frame roll joint):");
        if lines.is_empty() {
            text.open("[contact]");
        }
        text.open(&format!("free_joints = {}", array(&pivots)));
    }
}

/// Writes the masses and places that a person stated.
fn write_stated(text: &mut Text, guesses: &Guesses, stated: &Stated) {
    let tool = guesses.tool.as_ref().map(|tool| &tool.link);
    if let Some((mass, link)) = stated.payload.zip(tool) {
        text.gap()
            .comment("Stated at the terminal: the load on the tool.");
        text.line(&format!(
            "[[payload]]\nlink = {}\nmass = {mass:?}",
            quoted(link)
        ));
    }
    if let Some((sigma, link)) = stated.tool_mass_sigma.zip(tool) {
        text.gap()
            .comment("Stated at the terminal: how well the mass of the tool is known.");
        text.line(&format!("[links.{}]\nmass_sigma = {sigma:?}", key(link)));
    }
    if !stated.uncertainty.is_empty() {
        text.gap()
            .comment("Stated at the terminal: standard deviations.")
            .line("[uncertainty]");
        for (key, sigma) in &stated.uncertainty {
            text.line(&format!("{key} = {sigma:?}"));
        }
    }
}
