//! What is said about wheels whose load equilibrium leaves open.

use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::events::EventKind;
use tipwatch_analyze::report::findings;
use tipwatch_tests::{analysed, data};

#[test]
fn a_lift_that_depends_on_the_split_is_not_certain_without_it() {
    let analysis = analysed(&data("tiny_lift.mcap"), Options::default());
    let mut events = analysis.events.iter();
    let lift = events
        .find(|event| event.kind == EventKind::WheelLift)
        .unwrap();
    let [least_n, largest_n] = lift.load_range_n.unwrap();
    assert!(least_n <= 0.0 && largest_n > 5000.0, "{lift:?}");
    assert!(lift.certainty.unwrap() > 0.95, "{lift:?}");
    assert!(lift.certainty_any_split.unwrap() < 0.05, "{lift:?}");
    let text = findings(&analysis)[0].to_string();
    assert!(
        text.contains(
            "(confidence 98 %), if the front axle takes half of the difference between the sides"
        ),
        "{text}"
    );
    assert!(
        text.contains("it cannot be shown without knowing how the axles share the load (0 to 52"),
        "{text}"
    );
    assert!(text.contains("To decide it: weighing the wheels"), "{text}");
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
