//! The point of no return of a rotation about an edge, of the machine that explains it.

use super::result::ExplainedFall;
use crate::events::{Event, LEAST_OF_A_FACT, ShownBy, Stories};

/// Gives every measured rotation the point of no return of the machine that explains it: the stated one, or the one with a load
/// on its tool. What neither explains has none.
pub(crate) fn set_no_returns(
    stories: &Stories<'_>,
    explained: &[ExplainedFall],
    events: &mut [Event],
) {
    let is_measured = |event: &&mut Event| event.measured_rotation.is_some();
    for event in events.iter_mut().filter(is_measured) {
        let is_own =
            |fall: &&ExplainedFall| fall.edge == event.subject && fall.onset_ns == event.start_ns;
        let fall = explained.iter().find(is_own);
        let told = fall.and_then(ExplainedFall::told);
        let is_fact = told.is_some_and(|told| told.probability >= LEAST_OF_A_FACT);
        let mass = fall.and_then(|fall| fall.load.as_ref()?.combined);
        match told.map(|told| told.kind) {
            Some("stated_machine") if is_fact => {}
            Some("load_on_tool") if is_fact => match stories.machine.load_on_tool().zip(mass) {
                Some((load, mass)) => stories.with_load(event, load, mass.mass_kg, mass.sigma_kg),
                None => Stories::without_no_return(event),
            },
            // loads that show the rotation are explained by the machine as stated as far as they go
            Some("stated_machine") | None if event.shown_by != Some(ShownBy::Rotation) => {}
            _ => Stories::without_no_return(event),
        }
    }
}
