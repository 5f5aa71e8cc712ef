//! Parts of the table of quantities: index, scope in which a quantity is computed, and name.

use crate::evaluate::scope::Scope;
use crate::explain::attribution::Contribution;
use crate::machine::{Axis, Machine, links_with_mass};

/// The properties that a quantity has for every wheel, edge or other index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QuantityKind {
    /// Name of the variant of [`Quantity`](crate::Quantity).
    pub variant: &'static str,
    /// Short name for plots.
    pub label: &'static str,
    /// Name of the columns, each index as its placeholder in braces: `load_{wheel}_min`.
    pub pattern: &'static str,
    /// Unit; `-` for a number without one.
    pub unit: &'static str,
    /// The meaning, as Markdown.
    pub meaning: &'static str,
    /// Group of quantities that are read together.
    pub group: QuantityGroup,
    /// Condition under which the quantity is computed.
    pub when: When,
}

/// Quantities that are read together: a message of `derived.mcap`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::VariantArray)]
pub enum QuantityGroup {
    /// Loads of the wheels.
    Loads,
    /// Margins against lifting a wheel.
    Margins,
    /// Contributions to the loads.
    Causes,
    /// Everything else.
    Indicators,
}

impl QuantityGroup {
    /// All groups, in order.
    pub const ALL: &'static [Self] = <Self as strum::VariantArray>::VARIANTS;
}

/// Condition under which a quantity is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// Always.
    Always,
    /// For a machine with actuated joints.
    Actuated,
    /// With [`Scope::sensitivities`].
    Sensitivities,
    /// With [`Scope::indicators`].
    Indicators,
    /// With [`Scope::indicators`], for a machine with an arm.
    Arm,
    /// With both [`Scope::indicators`] and [`Scope::sensitivities`].
    Gradient,
    /// With [`Scope::contributions`].
    Contributions,
    /// With [`Scope::terms`].
    Terms,
    /// With [`Scope::parts`].
    Parts,
    /// With [`Scope::between_rows`].
    BetweenRows,
}

impl When {
    pub(super) fn holds(self, machine: &Machine, scope: Scope) -> bool {
        match self {
            Self::Always => true,
            Self::Actuated => !machine.contact.actuated_joints.is_empty(),
            Self::Sensitivities => scope.sensitivities,
            Self::Indicators => scope.indicators,
            Self::Arm => scope.indicators && machine.arm_root.is_some(),
            Self::Gradient => scope.indicators && scope.sensitivities,
            Self::Contributions => scope.contributions,
            Self::Terms => scope.terms,
            Self::Parts => scope.parts,
            Self::BetweenRows => scope.between_rows,
        }
    }
}

/// Names of the parts of a machine in the names of columns, in lower case.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ColumnNames {
    /// Names of the wheels.
    pub wheels: Vec<String>,
    /// Names of the edges of the support polygon.
    pub edges: Vec<String>,
    /// Name of the linkage of each actuated joint.
    pub linkages: Vec<String>,
    /// Names of the links.
    pub links: Vec<String>,
}

impl ColumnNames {
    /// The names of a machine.
    #[must_use]
    pub fn of(machine: &Machine) -> Self {
        let actuated = machine.contact.actuated_joints.iter();
        Self {
            wheels: machine
                .wheels
                .iter()
                .map(|w| w.name.to_lowercase())
                .collect(),
            edges: machine
                .polygon
                .edges
                .iter()
                .map(|e| e.name.clone())
                .collect(),
            linkages: actuated
                .map(|joint| joint.name(&machine.linkages).to_lowercase())
                .collect(),
            links: machine
                .links
                .iter()
                .map(|l| l.name.to_lowercase())
                .collect(),
        }
    }
}

/// A point that travels over the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum GroundPoint {
    /// The wheel of this index.
    Wheel(usize),
    /// The middle of the front axle.
    FrontAxle,
    /// The middle of the rear axle.
    RearAxle,
}

/// The index of a quantity, such as a wheel: all of its values for a machine, and their names in columns.
pub(super) trait Index {
    type Value;
    fn all(machine: &Machine) -> impl Iterator<Item = Self::Value>;
    fn name(names: &ColumnNames, value: Self::Value) -> String;
}

macro_rules! index {
    ($(#[$doc:meta])* $kind:ident($value:ty), |$machine:ident| $all:expr, |$names:ident, $one:ident| $name:expr) => {
        $(#[$doc])*
        pub(super) struct $kind;

        impl Index for $kind {
            type Value = $value;

            fn all($machine: &Machine) -> impl Iterator<Item = $value> {
                $all
            }

            fn name($names: &ColumnNames, $one: $value) -> String {
                $name
            }
        }
    };
}

index!(
    Wheel(usize),
    |machine| 0..machine.wheels.len(),
    |names, wheel| names.wheels[wheel].clone()
);
index!(
    Edge(usize),
    |machine| 0..machine.polygon.edges.len(),
    |names, edge| names.edges[edge].clone()
);
index!(
    /// An actuated joint, named by its linkage.
    Linkage(usize),
    |machine| 0..machine.contact.actuated_joints.len(),
    |names, joint| names.linkages[joint].clone()
);
index!(
    /// A link with mass.
    Link(usize),
    |machine| links_with_mass(machine),
    |names, link| names.links[link].clone()
);
index!(
    Along(Axis),
    |_machine| Axis::ALL.into_iter(),
    |_names, axis| axis.name().to_string()
);
index!(
    Cause(Contribution),
    |_machine| Contribution::ALL.into_iter(),
    |_names, cause| cause.name().to_string()
);
index!(
    /// A term of the analytic model, counted from 0, named by the number of its zeta.
    Term(usize),
    |_machine| 0..11,
    |_names, term| (term + 1).to_string()
);
index!(
    /// A point that travels over the ground.
    Place(GroundPoint),
    |machine| {
        let wheels = Wheel::all(machine).map(GroundPoint::Wheel);
        wheels.chain([GroundPoint::FrontAxle, GroundPoint::RearAxle])
    },
    |names, place| match place {
        GroundPoint::Wheel(wheel) => names.wheels[wheel].clone(),
        GroundPoint::FrontAxle => "front_axle".to_string(),
        GroundPoint::RearAxle => "rear_axle".to_string(),
    }
);

/// Makes [`Quantity`](crate::Quantity) and all that is known of it from the rows of the table.
macro_rules! quantities {
    ($(
        $(#[doc = $meaning:literal])+
        $variant:ident $(($($index:ident: $kind:ident),+))? $label:literal,
        $pattern:literal [$unit:literal] $group:ident, $when:ident, |$outcome:ident| $value:expr;
    )*) => {
        /// A quantity of an [`Outcome`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Quantity {
            $(
                $(#[doc = $meaning])+
                $variant $(($(quantities!(@type $kind)),+))?,
            )*
        }

        impl Quantity {
            /// All kinds, in column order.
            pub const KINDS: &'static [QuantityKind] = &[$(QuantityKind {
                variant: stringify!($variant),
                label: $label,
                pattern: $pattern,
                unit: $unit,
                meaning: concat!($($meaning),+).trim_ascii(),
                group: QuantityGroup::$group,
                when: When::$when,
            }),*];

            /// All quantities that the scope fills for this machine, in column order.
            #[must_use]
            pub fn all(machine: &Machine, scope: Scope) -> Vec<Self> {
                let mut all = Vec::new();
                $(if When::$when.holds(machine, scope) {
                    quantities!(@push all, machine, $variant, $($($index: $kind),+)?);
                })*
                all
            }

            /// Label, unit, meaning and what else does not depend on wheel, edge or other index.
            #[must_use]
            pub fn kind(self) -> &'static QuantityKind {
                enum Row { $($variant),* }
                let row = match self { $(Self::$variant { .. } => Row::$variant),* };
                &Self::KINDS[row as usize]
            }

            /// Name of its column.
            #[must_use]
            pub fn column(self, names: &ColumnNames) -> String {
                match self {
                    $(Self::$variant $(($($index),+))? => {
                        quantities!(@name $pattern, names, $($($index: $kind),+)?)
                    })*
                }
            }
        }

        impl<T: Real> Outcome<T> {
            /// The value of a quantity.
            #[inline]
            #[must_use]
            pub fn get(&self, quantity: Quantity) -> T {
                match quantity {
                    $(Quantity::$variant $(($($index),+))? => {
                        let $outcome = self;
                        $value
                    })*
                }
            }
        }

        /// Meaning and unit of a variant of [`Quantity`], as the text of a documentation comment.
        #[macro_export]
        macro_rules! quantity_doc {
            $(($variant) => { concat!($($meaning),+, " (", $unit, ")") };)*
        }
    };
    (@type Along) => { Axis };
    (@type Cause) => { Contribution };
    (@type Place) => { GroundPoint };
    (@type $kind:ident) => { usize };
    (@push $all:ident, $machine:ident, $variant:ident,) => { $all.push(Self::$variant) };
    (@push $all:ident, $machine:ident, $variant:ident, $a:ident: $A:ident) => {
        $all.extend($A::all($machine).map(Self::$variant))
    };
    (@push $all:ident, $machine:ident, $variant:ident, $a:ident: $A:ident, $b:ident: $B:ident) => {
        for $a in $A::all($machine) {
            $all.extend($B::all($machine).map(|$b| Self::$variant($a, $b)));
        }
    };
    (@name $pattern:literal, $names:ident,) => { $pattern.to_string() };
    (@name $pattern:literal, $names:ident, $($index:ident: $kind:ident),+) => {
        format!($pattern, $($index = $kind::name($names, $index)),+)
    };
}
pub(super) use quantities;
