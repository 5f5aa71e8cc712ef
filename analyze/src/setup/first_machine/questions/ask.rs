//! Asks for the open values of a draft at a terminal.

use std::io::{BufRead, Result, Write};

use tipwatch_datasheet::prompt;

use super::apply::apply;
use super::list::{settled, structure};
use super::open_value::{Effect, OpenValue, OpenValues, Subject};
use super::rank::open_values;
use crate::base::number::number;
use crate::setup::first_machine::draft::Draft;

/// Asks for the open and assumed values of a draft, and puts the answers into it: first the values without which the loads cannot
/// be computed, then those that move them most. An empty answer keeps the proposal, as a guess that nobody has confirmed.
///
/// # Errors
/// The terminal cannot be read or written, or the answers end early. The draft then has the answers until there.
pub fn ask(draft: &mut Draft, input: &mut dyn BufRead, output: &mut dyn Write) -> Result<()> {
    writeln!(
        output,
        "\nWhat is open or assumed, what moves the loads of this log most first. Enter keeps what is in brackets.\n\
         Numbers are in the unit of the question, or have one: 18.6 t, 3300 mm, 0.5 rad, 800 kN/m.\n\
         The log is analysed first, with everything as proposed."
    )?;
    draft.guesses = settled(draft);
    let structure = structure(draft, draft.guesses.as_ref());
    for value in &structure {
        ask_for(value, 0.0, draft, input, output)?;
    }
    let open = open_values(draft);
    if let Some(why) = &open.unranked {
        writeln!(
            output,
            "In no order, because the loads cannot be computed yet: {why}"
        )?;
    }
    let asked_already = |value: &&OpenValue| {
        let mut before = structure.iter();
        !before.any(|other| other.subject == value.subject)
    };
    for value in open.values.iter().filter(asked_already) {
        ask_for(value, open.least_n, draft, input, output)?;
    }
    tell_minor(&open, output)
}

/// Asks for a value. One that moves a load by less than `least_n` is asked for with what it belongs to.
fn ask_for(
    value: &OpenValue,
    least_n: f64,
    draft: &mut Draft,
    input: &mut dyn BufRead,
    output: &mut dyn Write,
) -> Result<()> {
    let has_supports = !draft.stated.supports.is_empty();
    let is_needless = match value.subject {
        // tyres on flat ground have split the load already
        Subject::RollMomentDistribution => draft.stated.tyre_stiffness.is_some(),
        // of an outrigger the stiffness would be needed, too
        Subject::TyreStiffness => has_supports,
        Subject::Raised => !has_supports,
        _ => false,
    };
    if is_needless {
        return Ok(());
    }
    writeln!(output)?;
    if let Some(effect) = &value.effect {
        writeln!(output, "{}", reason(effect, least_n))?;
    }
    let text = format!("{} [{}]", value.question, value.proposal);
    if let Some(answer) = prompt(&text, |text| value.kind.read(text), input, output)? {
        apply(draft, &value.subject, answer);
    }
    Ok(())
}

/// Describes the reason why a value is asked.
fn reason(effect: &Effect, least_n: f64) -> String {
    // all other minor values are not among the questions
    let with = match effect.change_n < least_n {
        true => ", and is asked for because the mounting of the IMU is confirmed as a whole",
        false => "",
    };
    format!(
        "± {} moves the load of {} by ± {} N in this log{with}:",
        effect.doubt,
        effect.wheel,
        number(effect.change_n)
    )
}

/// Names the values that are not among the questions.
fn tell_minor(open: &OpenValues, output: &mut dyn Write) -> Result<()> {
    if open.minor.is_empty() {
        return Ok(());
    }
    let values = open.minor.iter().map(|value| value.subject.in_words());
    writeln!(
        output,
        "\nNot asked for, because each moves that load by less than {} N: {}",
        number(open.least_n),
        values.collect::<Vec<_>>().join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The position of an IMU was asked for, by ± 7.2 N, and the end said that nothing below 114 N was.
    #[test]
    fn a_minor_value_is_asked_for_with_a_reason() {
        let effect = |change_n: f64| Effect {
            wheel: "wheel FL".into(),
            doubt: "0.1 m".into(),
            change_n,
            variance_share: 0.0,
        };
        let is_of_whole = |change_n: f64| reason(&effect(change_n), 114.0).contains("as a whole");
        assert!(is_of_whole(7.2) && !is_of_whole(300.0));
    }
}
