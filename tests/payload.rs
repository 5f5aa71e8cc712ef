//! Payload mass estimated from the force of the lifting cylinder.

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_binding::MachineFile;
use tipwatch_tests::{Truth, data};

const TRUE_MASS_KG: f64 = 320.0;
const WHEELS: [&str; 4] = ["FL", "FR", "RL", "RR"];
const PAYLOAD: &str = "
[[payload]]
link = \"tool\"
mass = \"estimate\"
com = [0.405, -0.4313, -0.0134]
";
const FORCE: &str = "force = { topic = \"/actuators\", joint = \"lift_rod\" }";
const PRESSURE: &str = "pressure = { \
     piston = { topic = \"/lift_cylinder/piston_pressure\", field = \"fluid_pressure\" }, \
     rod = { topic = \"/lift_cylinder/rod_pressure\", field = \"fluid_pressure\" }, \
     piston_area = 50.265e-4, rod_area = 34.361e-4 }";

/// The machine file with text added to its lift linkage.
fn machine_file(binding: &str) -> String {
    let text = std::fs::read_to_string(data("lift_payload.toml")).unwrap();
    let bound = format!("name = \"lift\"\n{binding}\n");
    text.replacen("name = \"lift\"\n", &bound, 1) + PAYLOAD
}

fn analysed(text: &str) -> anyhow::Result<Analysis> {
    let file = MachineFile::from_text(&data("lift_payload.toml"), text).unwrap();
    let log = data("lift_payload.mcap");
    analyse(&log, &file, Options::default(), &mut |_| {})
}

#[test]
fn val_payload_is_estimated_from_force_or_pressures() {
    for binding in [FORCE, PRESSURE] {
        let analysis = analysed(&machine_file(binding)).unwrap();
        let [found] = &analysis.payloads[..] else {
            panic!("{:?}", analysis.payloads);
        };
        let (mass, sigma) = (found.estimate.mass, found.estimate.sigma);
        println!(
            "{mass:.1} kg, sigma {sigma:.1} kg, residual {:.0} N",
            found.estimate.residual
        );
        assert!((mass - TRUE_MASS_KG).abs() < 2.0 * sigma, "{mass} {sigma}");
        assert!((mass - TRUE_MASS_KG).abs() < 0.05 * TRUE_MASS_KG, "{mass}");
        assert!(sigma < 0.1 * TRUE_MASS_KG, "{sigma}");
        let share = Truth::of(&data("lift_payload.mcap"), &WHEELS).error_share(&analysis);
        assert!(share < 0.02, "without the payload it is 0.18: {share}");
        assert!(
            analysis
                .notes
                .iter()
                .any(|note| note.contains("was estimated"))
        );
    }
}

#[test]
fn what_is_missing_for_an_estimate_is_said() {
    let message = |text: &str| format!("{:#}", analysed(text).unwrap_err());
    let unbound = message(&machine_file(""));
    assert!(unbound.contains("expected force or pressure"), "{unbound}");
    let nowhere = message(&machine_file(&FORCE.replace("/actuators", "/nowhere")));
    assert!(
        nowhere.contains("/nowhere") && nowhere.contains("/actuators"),
        "{nowhere}"
    );
    let no_field = message(&machine_file(
        &PRESSURE.replace("fluid_pressure\" }, rod", "flow\" }, rod"),
    ));
    assert!(no_field.contains("flow"), "{no_field}");
    let no_joint = message(&machine_file(&FORCE.replace("lift_rod", "no_rod")));
    assert!(
        no_joint.contains("\"no_rod\"") && no_joint.contains("lift_rod"),
        "{no_joint}"
    );
}
