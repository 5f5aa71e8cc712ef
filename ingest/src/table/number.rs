//! Numbers in cells.

use std::borrow::Cow;

/// The number in a cell; `None` for anything else.
pub(crate) fn number(cell: &str, has_decimal_comma: bool) -> Option<f64> {
    let number: f64 = with_point(cell.trim(), has_decimal_comma).parse().ok()?;
    number.is_finite().then_some(number)
}

/// A number with a point where a comma may stand for it.
pub(super) fn with_point(text: &str, has_decimal_comma: bool) -> Cow<'_, str> {
    match has_decimal_comma && text.contains(',') && !text.contains('.') {
        true => text.replace(',', ".").into(),
        false => text.into(),
    }
}
