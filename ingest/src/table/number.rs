//! Numbers in cells.

use std::borrow::Cow;

/// The number in a cell; `None` for anything else.
pub(crate) fn number(cell: &str, has_decimal_comma: bool) -> Option<f64> {
    let number: f64 = with_point(cell.trim(), has_decimal_comma).parse().ok()?;
    number.is_finite().then_some(number)
}

/// A number with a point where a comma may stand for it, and without marks between groups of three digits where they can be
/// nothing else: a mark beside the decimal one, several marks, an apostrophe or a narrow blank.
pub(super) fn with_point(text: &str, has_decimal_comma: bool) -> Cow<'_, str> {
    let decimal = if has_decimal_comma { ',' } else { '.' };
    if let Some(plain) = without_groups(text, decimal) {
        return plain.replace(',', ".").into();
    }
    match has_decimal_comma && text.contains(',') && !text.contains('.') {
        true => text.replace(',', ".").into(),
        false => text.into(),
    }
}

/// The number without the marks between its groups of digits; `None` if it has none, or one that may be a decimal mark.
fn without_groups(text: &str, decimal: char) -> Option<String> {
    let is_mark = |c: char| {
        c != decimal && matches!(c, '.' | ',' | '\'' | '\u{2019}' | '\u{a0}' | '\u{202f}')
    };
    let mark = text.chars().find(|c| is_mark(*c))?;
    let (whole, rest) = match text.find(decimal) {
        Some(at) => text.split_at(at),
        None => (text, ""),
    };
    let digits = whole.trim_start_matches(['+', '-']);
    let mut groups = digits.split(mark);
    let is_group = |group: &str, least: usize| {
        (least..=3).contains(&group.len()) && group.bytes().all(|byte| byte.is_ascii_digit())
    };
    let is_first = groups
        .next()
        .is_some_and(|first| is_group(first, 1) && !first.starts_with('0'));
    let following: Vec<&str> = groups.collect();
    let may_be_decimal = matches!(mark, '.' | ',') && rest.is_empty() && following.len() == 1;
    let is_grouped =
        is_first && !following.is_empty() && following.iter().all(|group| is_group(group, 3));
    (is_grouped && !may_be_decimal && !rest.contains(mark)).then(|| whole.replace(mark, "") + rest)
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn groups_of_digits_are_read_where_they_can_be_nothing_else() {
        for (text, has_decimal_comma, value) in [
            ("1.556,949", true, Some(1556.949)),
            ("-1,556.949", false, Some(-1556.949)),
            ("1'556.5", false, Some(1556.5)),
            ("1\u{a0}556,5", true, Some(1556.5)),
            ("12.345.678", true, Some(12_345_678.0)),
            ("1,234,567", false, Some(1_234_567.0)),
            // may be a decimal mark
            ("1.002", true, Some(1.002)),
            ("1,002", false, None),
            ("1,5.2", false, None),
            ("0,998.1", false, None),
            ("1,5", true, Some(1.5)),
        ] {
            assert_eq!(number(text, has_decimal_comma), value, "{text}");
        }
    }
}
