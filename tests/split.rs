//! Statements about wheels whose load equilibrium leaves open.

use std::fs;

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::{ModelKind, Options};
use tipwatch_analyze::events::EventKind;
use tipwatch_analyze::report::findings;
use tipwatch_binding::MachineFile;
use tipwatch_tests::{analysed, data};

/// The log whose wheel lifts, if the front axle takes this share of the difference between the sides.
fn lift_with(share: f64) -> Analysis {
    let path = data("tiny_lift.toml");
    let stated = "roll_moment_distribution = 0.5";
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(stated));
    let text = text.replace(stated, &format!("roll_moment_distribution = {share}"));
    let file = MachineFile::from_text(&path, &text).unwrap();
    analyse(
        &data("tiny_lift.mcap"),
        &file,
        Options::default(),
        &mut |_| {},
    )
    .unwrap()
}

#[test]
fn a_lift_names_the_split_at_which_the_wheel_would_have_stayed_down() {
    let lifts = |analysis: &Analysis| -> Vec<(String, Option<f64>)> {
        let lifts = analysis.events.iter();
        let lifts = lifts.filter(|event| event.kind == EventKind::WheelLift);
        lifts
            .map(|event| (event.subject.clone(), event.split_flips_at))
            .collect()
    };
    let as_stated = lift_with(0.5);
    let (wheel, share) = lifts(&as_stated)[0].clone();
    let share = share.expect("a share at which it flips");
    let says = findings(&as_stated)[0].to_string();
    assert!(
        says.contains("it would just have stayed on the ground"),
        "{says}"
    );
    let lifts_with = |share: f64| lifts(&lift_with(share)).iter().any(|lift| lift.0 == wheel);
    let toward = (0.5 - share).signum();
    assert!(lifts_with(share + 0.01 * toward), "{share}");
    assert!(!lifts_with(share - 0.01 * toward), "{share}");
}

#[test]
fn a_lift_that_depends_on_the_split_is_not_certain_without_it() {
    let analysis = analysed(&data("tiny_lift.mcap"), Options::default());
    let mut events = analysis.events.iter();
    let lift = events
        .find(|event| event.kind == EventKind::WheelLift)
        .unwrap();
    let [least_n, largest_n] = lift.load_range_n.unwrap();
    assert!(least_n <= 0.0 && largest_n > 5000.0, "{lift:?}");
    let certainty = lift.certainty.unwrap();
    // the split's own standard deviation keeps it below what it would be if 0.5 were known
    assert!((0.8..0.95).contains(&certainty), "{lift:?}");
    assert!(lift.certainty_any_split.unwrap() < 0.05, "{lift:?}");
    let text = findings(&analysis)[0].to_string();
    let percent = (100.0 * certainty).round();
    assert!(
        text.contains(&format!(
            "(confidence {percent} %), if the front axle takes half of the difference between the sides"
        )),
        "{text}"
    );
    assert!(
        text.contains("it cannot be shown without knowing how the axles share the load (0 to 52"),
        "{text}"
    );
    assert!(text.contains("To decide it: weighing the wheels"), "{text}");
}

/// Without bands, as of the closed form, nothing is said that a band could contradict.
#[test]
fn without_bands_no_wheel_is_cleared_but_as_computed() {
    let is_as_computed = |model| {
        let options = Options {
            model,
            ..Options::default()
        };
        let analysis = analysed(&data("corner_brake.mcap"), options);
        let headline = &findings(&analysis)[0].headline;
        headline.starts_with("No wheel fell below its load limit as computed")
    };
    assert!(is_as_computed(ModelKind::ClosedForm));
    assert!(!is_as_computed(ModelKind::WholeBody));
}

/// On a ridge of 6 cm, MR and RR of one bogie lose 3.4 kN each against the loads under the split rule, as the
/// frame twists; FR loses 6.8 kN.
#[test]
fn on_unknown_ground_no_wheel_is_cleared_that_another_split_unloads() {
    for name in ["forwarder6_bump", "bogie_bump", "hard_brake"] {
        let analysis = analysed(&data(&format!("{name}.mcap")), Options::default());
        let first = &findings(&analysis)[0];
        let headline = &first.headline;
        assert!(
            headline.starts_with("No wheel fell below its load limit, if "),
            "{headline}"
        );
        let could = " it cannot be excluded that wheel ";
        let (_, named) = headline.split_once(could).expect(headline);
        assert!(named.contains("FR"), "{name}: {headline}");
        let of_wheel = first
            .evidence
            .iter()
            .find(|line| line.starts_with("Wheel FR: "));
        assert!(
            of_wheel
                .unwrap()
                .contains(" N by equilibrium alone, at t = "),
            "{first}"
        );
        let decides = first
            .evidence
            .iter()
            .any(|line| line.starts_with("To decide it: "));
        assert!(decides, "{first}");
    }
}
