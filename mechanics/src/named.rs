//! Enums whose variants have names.

/// Declares an enum without fields as a list of names: variants in order, [`Copy`], comparable, each with its name in snake case
/// and its documentation.
///
/// The enum gets `ALL`, its variants in order, and `name()`, what tables, files and messages call a variant: serde writes it, too.
/// Further derives and attributes are stated as usual; `#[strum(serialize = "...")]` gives a variant another name.
///
/// ```
/// tipwatch_mechanics::named! {
///     /// Sides of a machine.
///     #[derive(PartialOrd, Ord)]
///     pub enum Side {
///         /// Where y is positive.
///         LeftSide,
///         /// Where y is negative.
///         RightSide,
///     }
/// }
/// assert_eq!(Side::ALL.map(Side::name), ["left_side", "right_side"]);
/// ```
#[macro_export]
macro_rules! named {
    ($(#[$attribute:meta])* $visible:vis enum $name:ident { $($variants:tt)* }) => {
        #[derive(
            Debug,
            Clone,
            Copy,
            PartialEq,
            Eq,
            Hash,
            strum::EnumMessage,
            strum::IntoStaticStr,
            strum::VariantArray,
        )]
        #[strum(serialize_all = "snake_case")]
        $(#[$attribute])*
        $visible enum $name { $($variants)* }

        impl $name {
            /// All variants, in order.
            $visible const ALL: [Self; <Self as strum::VariantArray>::VARIANTS.len()] =
                *<Self as strum::VariantArray>::VARIANTS
                    .first_chunk()
                    .expect("all variants");

            /// Name in tables, files and messages.
            #[must_use]
            $visible fn name(self) -> &'static str {
                self.into()
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, to: S) -> std::result::Result<S::Ok, S::Error> {
                to.serialize_str(self.name())
            }
        }
    };
}

/// Declares a set of the variants of an enum that `named!` declares, as bits in their order.
#[macro_export]
macro_rules! named_set {
    ($(#[$attribute:meta])* $visible:vis struct $name:ident($bits:ty) of $of:ident;) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
        $visible struct $name($bits);

        impl $name {
            /// The empty set.
            $visible const NONE: Self = Self(0);

            /// Adds one.
            $visible fn add(&mut self, one: $of) {
                self.0 |= 1 << one as u8;
            }

            /// Adds every one of another set.
            $visible fn add_all(&mut self, others: Self) {
                self.0 |= others.0;
            }

            /// Whether the set contains it.
            #[must_use]
            $visible fn has(self, one: $of) -> bool {
                self.0 >> one as u8 & 1 == 1
            }

            /// Whether the set is empty.
            #[must_use]
            $visible fn is_empty(self) -> bool {
                self.0 == 0
            }

            /// All of the set, in order.
            $visible fn iter(self) -> impl Iterator<Item = $of> {
                $of::ALL.into_iter().filter(move |&one| self.has(one))
            }

            /// The set as bits, for messages and files.
            #[must_use]
            $visible fn bits(self) -> $bits {
                self.0
            }
        }
    };
}
