//! Tables of the machine file whose keys have defaults, and the ranges of their numbers.

/// Range of allowed numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Range {
    /// The range in words.
    pub(crate) expected: &'static str,
    holds: fn(f64) -> bool,
}

impl Range {
    const fn of(expected: &'static str, holds: fn(f64) -> bool) -> Self {
        Self { expected, holds }
    }

    pub(crate) const fn positive() -> Self {
        Self::of("a positive number", |value| value > 0.0)
    }

    pub(crate) const fn not_negative() -> Self {
        Self::of("a number that is not negative", |value| value >= 0.0)
    }

    pub(crate) const fn share() -> Self {
        Self::of("above 0 and at most 1", |value| value > 0.0 && value <= 1.0)
    }

    pub(crate) const fn one_or_more() -> Self {
        Self::of("1 or more", |value| value >= 1.0)
    }

    pub(crate) const fn two_or_more() -> Self {
        Self::of("two or more", |value| value >= 2.0)
    }

    pub(crate) const fn acute() -> Self {
        Self::of("0 or more and below pi/2", |value| {
            (0.0..std::f64::consts::FRAC_PI_2).contains(&value)
        })
    }
}

/// A number of a table, with its allowed range.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Number {
    pub(crate) key: &'static str,
    pub(crate) value: f64,
    pub(crate) range: Range,
}

impl Number {
    /// Whether the number is finite and in its range.
    pub(crate) fn is_in_range(&self) -> bool {
        self.value.is_finite() && (self.range.holds)(self.value)
    }
}

/// The numbers of a key: none where it is optional and not stated.
pub(crate) trait Numbers {
    fn numbers(&self) -> Vec<f64>;
}

impl Numbers for f64 {
    fn numbers(&self) -> Vec<f64> {
        vec![*self]
    }
}

impl Numbers for u32 {
    fn numbers(&self) -> Vec<f64> {
        vec![f64::from(*self)]
    }
}

impl Numbers for Option<f64> {
    fn numbers(&self) -> Vec<f64> {
        self.iter().copied().collect()
    }
}

impl Numbers for [f64; 4] {
    fn numbers(&self) -> Vec<f64> {
        self.to_vec()
    }
}

/// Declares a table of the machine file as a list of keys, all public: type, default and, for a number, its [`Range`].
///
/// The table gets `Default` and `numbers()`, the numbers with a range in the order of the keys. A key that is not stated has
/// its default; an unknown key is an error.
macro_rules! table {
    (
        $(#[$attribute:meta])*
        pub struct $name:ident {
            $($(#[$of_key:meta])* $key:ident: $type:ty = $default:expr $(, $range:ident)?;)*
        }
    ) => {
        #[derive(Debug, Clone, PartialEq, serde::Deserialize)]
        #[serde(deny_unknown_fields, default)]
        $(#[$attribute])*
        pub struct $name {
            $($(#[$of_key])* pub $key: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($key: $default,)* }
            }
        }

        impl $name {
            /// The numbers that have a range, in the order of the keys.
            pub(crate) fn numbers(&self) -> Vec<$crate::machine::table::Number> {
                use $crate::machine::table::{Number, Numbers, Range};
                let mut numbers = Vec::new();
                $($(
                    let range = Range::$range();
                    let stated = Numbers::numbers(&self.$key).into_iter();
                    numbers.extend(stated.map(|value| Number { key: stringify!($key), value, range }));
                )?)*
                numbers
            }
        }
    };
}
