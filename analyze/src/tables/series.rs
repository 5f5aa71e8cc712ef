//! How the values of a column are stored: those that are known one after the other, and which rows have one.

use std::ops::Range;

use super::cell::Value;

/// Values of one type, one after the other.
pub trait Series: Default {
    /// One of the values.
    type Item<'a>
    where
        Self: 'a;

    /// Number of values.
    fn len(&self) -> usize;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One of the values; `None` behind the last.
    fn get(&self, at: usize) -> Option<Self::Item<'_>>;

    /// Adds a value.
    fn push(&mut self, item: Self::Item<'_>);

    /// Adds some of the values of another series.
    fn extend(&mut self, other: &Self, range: Range<usize>);

    /// Makes room for so many more values.
    fn reserve(&mut self, more: usize);

    /// Removes all values; the memory stays.
    fn clear(&mut self);

    /// A value as that of a cell.
    fn value(item: Self::Item<'_>) -> Value;
}

macro_rules! series_of_numbers {
    ($($number:ty => $value:expr),* $(,)?) => {$(
        impl Series for Vec<$number> {
            type Item<'a> = $number;

            fn len(&self) -> usize {
                self.len()
            }

            fn get(&self, at: usize) -> Option<$number> {
                <[$number]>::get(self, at).copied()
            }

            fn push(&mut self, item: $number) {
                self.push(item);
            }

            fn extend(&mut self, other: &Self, range: Range<usize>) {
                self.extend_from_slice(&other[range]);
            }

            fn reserve(&mut self, more: usize) {
                self.reserve_exact(more);
            }

            fn clear(&mut self) {
                self.clear();
            }

            fn value(item: $number) -> Value {
                $value(item.into())
            }
        }
    )*};
}

series_of_numbers!(
    bool => Value::Boolean,
    f32 => Value::Number,
    f64 => Value::Number,
    i32 => Value::Integer,
    i64 => Value::Integer,
    u32 => Value::Integer,
    u64 => Value::Integer,
);

/// Texts, one behind the other in one text.
#[derive(Debug, Clone, Default)]
pub struct Texts {
    joined: String,
    ends: Vec<usize>,
}

impl Texts {
    /// All texts, one behind the other, and the place of each.
    pub(super) fn places(&self) -> (&str, impl Iterator<Item = Range<usize>>) {
        let places = (0..self.ends.len()).map(|at| self.start(at)..self.ends[at]);
        (&self.joined, places)
    }

    fn start(&self, at: usize) -> usize {
        at.checked_sub(1).map_or(0, |before| self.ends[before])
    }
}

impl Series for Texts {
    type Item<'a> = &'a str;

    fn len(&self) -> usize {
        self.ends.len()
    }

    fn get(&self, at: usize) -> Option<&str> {
        let end = *self.ends.get(at)?;
        Some(&self.joined[self.start(at)..end])
    }

    fn push(&mut self, item: &str) {
        self.joined.push_str(item);
        self.ends.push(self.joined.len());
    }

    fn extend(&mut self, other: &Self, range: Range<usize>) {
        range
            .filter_map(|at| other.get(at))
            .for_each(|text| self.push(text));
    }

    fn reserve(&mut self, more: usize) {
        self.ends.reserve_exact(more);
    }

    fn clear(&mut self) {
        self.joined.clear();
        self.ends.clear();
    }

    fn value(item: &str) -> Value {
        Value::Text(item.into())
    }
}

/// A series in which values may be missing.
#[derive(Debug, Clone, Default)]
pub struct Known<S> {
    /// The values that are not missing.
    values: S,
    /// Whether each row has a value; `None` while all have one.
    is_known: Option<Vec<bool>>,
}

impl<T: Copy> Known<Vec<T>> {
    /// A series of these values, null where they are not known.
    pub(super) fn where_known(mut values: Vec<T>, is_known: impl Fn(T) -> bool) -> Self {
        if values.iter().all(|&value| is_known(value)) {
            return Self::all(values);
        }
        let which = values.iter().map(|&value| is_known(value)).collect();
        values.retain(|&value| is_known(value));
        Self {
            values,
            is_known: Some(which),
        }
    }
}

impl<S> Known<S> {
    /// A series in which nothing is missing.
    pub(super) fn all(values: S) -> Self {
        Self {
            values,
            is_known: None,
        }
    }
}

impl<S: Series> Known<S> {
    /// No rows yet, of the same type, with room for so many.
    pub(super) fn empty_like(&self, rows: usize) -> Self {
        let mut values = S::default();
        values.reserve(rows);
        Self::all(values)
    }

    /// The values of these items, null where there is none.
    pub(super) fn collect<'a>(items: impl Iterator<Item = Option<S::Item<'a>>>) -> Self
    where
        S: 'a,
    {
        let mut collected = Self::default();
        items.for_each(|item| collected.push(item));
        collected
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.is_known.as_ref().map_or(self.values.len(), Vec::len)
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values that are not missing.
    #[must_use]
    pub fn known(&self) -> &S {
        &self.values
    }

    /// The values of all rows.
    ///
    /// # Errors
    /// The same again, if some are missing.
    pub fn into_all(self) -> Result<S, Self> {
        match self.is_known {
            None => Ok(self.values),
            Some(_) => Err(self),
        }
    }

    /// Whether each row has a value; `None` if all have one.
    #[must_use]
    pub fn is_known(&self) -> Option<&[bool]> {
        self.is_known.as_deref()
    }

    /// Every row.
    pub fn rows(&self) -> impl Iterator<Item = Option<S::Item<'_>>> {
        let mut next = 0;
        (0..self.len()).map(move |row| {
            let is_known = self.is_known.as_ref().is_none_or(|is_known| is_known[row]);
            is_known.then(|| {
                next += 1;
                self.values.get(next - 1)
            })?
        })
    }

    /// The value of every row.
    pub(super) fn values(&self) -> impl Iterator<Item = Value> {
        self.rows().map(|item| item.map_or(Value::Null, S::value))
    }

    /// Adds a row.
    pub(super) fn push(&mut self, item: Option<S::Item<'_>>) {
        if item.is_none() && self.is_known.is_none() {
            self.is_known = Some(vec![true; self.values.len()]);
        }
        if let Some(is_known) = &mut self.is_known {
            is_known.push(item.is_some());
        }
        if let Some(item) = item {
            self.values.push(item);
        }
    }

    /// Adds some of the rows of another series.
    pub(super) fn extend(&mut self, other: &Self, rows: Range<usize>) {
        let Some(others) = &other.is_known else {
            if let Some(is_known) = &mut self.is_known {
                is_known.resize(is_known.len() + rows.len(), true);
            }
            return self.values.extend(&other.values, rows);
        };
        let count = |rows: Range<usize>| others[rows].iter().filter(|&&known| known).count();
        let first = count(0..rows.start);
        let values = first..first + count(rows.clone());
        let length = self.values.len();
        let mine = self.is_known.get_or_insert_with(|| vec![true; length]);
        mine.extend_from_slice(&others[rows]);
        self.values.extend(&other.values, values);
    }

    /// Removes all rows; the memory stays.
    pub(super) fn clear(&mut self) {
        self.values.clear();
        self.is_known = None;
    }
}

/// Lists, any of which may be missing, and of whose elements any may be missing.
#[derive(Debug, Clone, Default)]
pub struct Lists<S> {
    lengths: Known<Vec<u32>>,
    elements: Known<S>,
}

impl<S: Series> Lists<S> {
    /// No rows yet, of the same type, with room for so many.
    pub(super) fn empty_like(&self, rows: usize) -> Self {
        Self {
            lengths: self.lengths.empty_like(rows),
            elements: Known::default(),
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.lengths.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The elements of all lists, one after the other.
    #[must_use]
    pub fn elements(&self) -> &Known<S> {
        &self.elements
    }

    /// The list of every row.
    pub fn rows(&self) -> impl Iterator<Item = Option<Vec<Option<S::Item<'_>>>>> {
        let mut elements = self.elements.rows();
        let lengths = self.lengths.rows();
        lengths.map(move |length| Some(elements.by_ref().take(length? as usize).collect()))
    }

    /// The value of every row.
    pub(super) fn values(&self) -> impl Iterator<Item = Value> {
        let element = |element: Option<S::Item<'_>>| element.map_or(Value::Null, S::value);
        self.rows().map(move |list| match list {
            Some(list) => Value::List(list.into_iter().map(element).collect()),
            None => Value::Null,
        })
    }

    /// Adds a row without a list.
    pub(super) fn push_missing(&mut self) {
        self.lengths.push(None);
    }

    /// Adds a row with the elements that `add` adds.
    pub(super) fn push(&mut self, add: impl FnOnce(&mut Known<S>)) {
        let before = self.elements.len();
        add(&mut self.elements);
        self.lengths
            .push(Some((self.elements.len() - before) as u32));
    }

    /// Adds some of the rows of others.
    pub(super) fn extend(&mut self, other: &Self, rows: Range<usize>) {
        let total = |count: usize| -> usize {
            let lengths = other.lengths.rows().take(count);
            lengths.map(|length| length.unwrap_or(0) as usize).sum()
        };
        let elements = total(rows.start)..total(rows.end);
        self.lengths.extend(&other.lengths, rows);
        self.elements.extend(&other.elements, elements);
    }

    /// Removes all rows; the memory stays.
    pub(super) fn clear(&mut self) {
        self.lengths.clear();
        self.elements.clear();
    }
}
