//! Records that are declared once: each field beside its value.

/// Declares a struct and the function `of` that makes it: the statements that several values need, then each field with its value.
macro_rules! built {
    ($(#[$about:meta])* $visible:vis struct $name:ident $(<$life:lifetime>)?: $making:vis fn of $arguments:tt { $($statements:tt)* } {
        $($(#[$meaning:meta])* $seen:vis $field:ident: $type:ty = $value:expr,)+
    }) => {
        $(#[$about])*
        $visible struct $name $(<$life>)? {
            $($(#[$meaning])* $seen $field: $type,)+
        }

        impl $(<$life>)? $name $(<$life>)? {
            /// Makes it: each field has the value that is declared beside it.
            #[must_use]
            $making fn of $arguments -> Self {
                $($statements)*
                Self { $($field: $value,)+ }
            }
        }
    };
}

pub(crate) use built;
