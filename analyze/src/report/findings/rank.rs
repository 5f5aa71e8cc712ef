//! Which kinds of events come first.

use crate::events::EventKind;

/// The smaller, the more important.
pub(in crate::report) fn rank(kind: EventKind) -> usize {
    match kind {
        EventKind::TipOver => 0,
        EventKind::EdgeTipping => 1,
        EventKind::WheelLift => 2,
        EventKind::WheelLight => 3,
        EventKind::LiftNotExcluded => 4,
        EventKind::InputGap => 5,
        EventKind::InputFault => 6,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_kind_comes_first() {
        use EventKind::{EdgeTipping, InputGap, TipOver, WheelLift, WheelLight};
        let mut kinds = [InputGap, WheelLight, TipOver, WheelLift, EdgeTipping];
        kinds.sort_by_key(|&kind| rank(kind));
        assert_eq!(
            kinds,
            [TipOver, EdgeTipping, WheelLift, WheelLight, InputGap]
        );
    }
}
