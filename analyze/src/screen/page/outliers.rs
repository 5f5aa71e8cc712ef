//! Machines that stand out against their own history or their type, and what cannot be compared.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, word};

use crate::base::frame::Day;
use crate::page::{percent, table};
use crate::screen::outliers::{Against, ComparedQuantity, Comparison, MOST_FALSE, Verdict};

/// Most rows of a table; the table `comparisons` has all.
const MOST_ROWS: usize = 100;

/// The section; `None` without machines.
pub(super) fn section(comparisons: &[Comparison]) -> Option<Markup> {
    if comparisons.is_empty() {
        return None;
    }
    let of = |wanted: fn(&Verdict) -> bool| -> Vec<&Comparison> {
        let found = comparisons.iter().filter(|c| wanted(&c.verdict));
        found.collect()
    };
    let mut outliers = of(|verdict| matches!(verdict, Verdict::Outlier { .. }));
    outliers.sort_by_key(|c| !matches!(c.verdict, Verdict::Outlier { is_worse: true }));
    let inconspicuous = of(|verdict| matches!(verdict, Verdict::Inconspicuous)).len();
    let unknown = of(|verdict| matches!(verdict, Verdict::NotComparable { .. }));
    let rows: Vec<Vec<String>> = outliers.iter().take(MOST_ROWS).map(|c| row(c)).collect();
    let reasons: Vec<Vec<String>> = unknown.iter().take(MOST_ROWS).map(|c| reason(c)).collect();
    Some(html! {
        p.hint {
            (say!("Worst margin, share of the computable time below the notice level, and share with a wheel or support off the ground, each \
                machine against itself (the medians of its days before and after the day on which they changed most; permutation test of \
                the largest CUSUM and Student's distribution) and against the other machines of its type (its median against at least 8 \
                others; median absolute deviation, and the uncertainty of its own margins). A machine is listed if the difference is at \
                least 5 % of the static load, 1 % of the time below the notice level or {} of the time lifted, and sure: of the \
                machines listed against themselves at most {} are expected to be there by chance (Benjamini and Hochberg), of the others \
                {}. That takes neighbouring days to resemble each other as they do before and after the change, at least as much as in \
                the fleet, and machines of one type to scatter about normally. It says that a difference is no chance, not what caused \
                it: other work and other ground do the same as a fault.", percent(0.001), percent(MOST_FALSE), percent(0.005)))
        }
        @if outliers.is_empty() {
            p {
                @if inconspicuous == 0 { (word!("No machine can be compared yet.")) }
                @else { (say!("No machine stands out in {inconspicuous} comparisons.")) }
            }
        } @else {
            (table(&[word!("Machine"), word!("Compared with"), word!("Quantity"), word!("Here"), word!("Usual"), word!("Confidence"),
                word!("From")], &rows))
            p.hint { (say!("{inconspicuous} other comparisons show nothing.")) }
        }
        @if !reasons.is_empty() {
            details {
                summary { (say!("{} comparisons that cannot be made", unknown.len())) }
                (table(&[word!("Machine"), word!("Compared with"), word!("Quantity"), word!("Why not")], &reasons))
            }
        }
    })
}

fn row(comparison: &Comparison) -> Vec<String> {
    let Comparison {
        value,
        usual,
        confidence,
        count,
        usual_count,
        ..
    } = comparison;
    let shown = |number: &Option<f64>| number.map_or(word!("unknown").into(), percent);
    let direction = match comparison.verdict {
        Verdict::Outlier { is_worse: true } => word!("worse"),
        _ => word!("better"),
    };
    let from = match comparison.against {
        Against::History => say!(
            "{usual_count} days before and {count} since {}",
            comparison
                .since
                .and_then(Day::date)
                .as_deref()
                .unwrap_or(word!("then"))
        ),
        Against::Type { .. } => say!("{count} logs, {usual_count} other machines"),
    };
    // never "100 %": what is rounded is not certain
    let confidence = confidence.map_or(word!("unknown").into(), |c| match c > 0.999 {
        true => word!("above 99.9 %").into(),
        false => decimals(format!("{:.1} %", 100.0 * c)),
    });
    vec![
        comparison.machine.clone(),
        with(comparison),
        name(comparison.quantity).into(),
        format!("{} ({direction})", shown(value)),
        shown(usual),
        confidence,
        from,
    ]
}

/// An outlier in a sentence, for the card of its machine.
pub(super) fn in_words(comparison: &Comparison) -> String {
    let cells = row(comparison);
    let [_, with, quantity, here, usual, confidence, from] = &cells[..] else {
        return cells.join(", ");
    };
    say!(
        "Stands out against {with}: {quantity} {here}, usually {usual}; confidence {confidence}, {from}."
    )
}

fn reason(comparison: &Comparison) -> Vec<String> {
    let reason = match &comparison.verdict {
        Verdict::NotComparable { reason } => reason.clone(),
        _ => String::new(),
    };
    vec![
        comparison.machine.clone(),
        with(comparison),
        name(comparison.quantity).into(),
        reason,
    ]
}

fn with(comparison: &Comparison) -> String {
    match &comparison.against {
        Against::History => word!("its own history").into(),
        Against::Type { machine_type } => say!("type {machine_type}"),
    }
}

fn name(quantity: ComparedQuantity) -> &'static str {
    match quantity {
        ComparedQuantity::WorstMargin => word!("worst margin (median)"),
        ComparedQuantity::ExposedShare => {
            word!("time below the notice level (median share)")
        }
        ComparedQuantity::LiftedShare => {
            word!("time with a wheel or support off the ground (median share)")
        }
    }
}
