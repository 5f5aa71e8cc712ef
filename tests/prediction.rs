//! The prediction compared with simulated ground truth. `benches/prediction.rs` prints the whole tables.

use tipwatch_tests::data;
use tipwatch_tests::prediction::alarms::{GO_ON, episodes, lead_s};
use tipwatch_tests::prediction::followed::Followed;

#[test]
fn val_prediction_leads_the_lift_of_a_simulated_tip_over() {
    let tip_over = Followed::new(&data("tip_over.mcap"), None);
    let lifts = tip_over.lifts();
    assert_eq!(lifts.len(), 1, "{lifts:?}");
    let lead_s = lead_s(&tip_over, &lifts[0], &GO_ON);
    assert!(lead_s > 1.0, "{lead_s}");
}

#[test]
fn prediction_is_quiet_while_no_wheel_comes_near_to_lifting() {
    for name in ["hard_brake", "corner_brake"] {
        let quiet = Followed::new(&data(&format!("{name}.mcap")), None);
        assert!(quiet.lifts().is_empty());
        let raised = episodes(&quiet, &GO_ON);
        assert!(raised.is_empty(), "{name}: {raised:?}");
    }
}
