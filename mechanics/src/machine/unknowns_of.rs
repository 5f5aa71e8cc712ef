//! The unknowns of a machine, with their names, units and standard deviations.

use super::impossible_inertia::principal_moments;
use super::stated_sigma::stated_sigma;
use super::unknown::Unknown;
use super::{InertiaElement, Machine, Parameter};

impl Unknown {
    /// Returns the unknowns of a machine whose stated standard deviation is not zero, whichever supports it stands on, in the
    /// order of [`Parameter::all`].
    #[must_use]
    pub fn all(machine: &Machine) -> Vec<Self> {
        let all = Parameter::of_all_supports(machine).into_iter();
        let unknowns = all.filter_map(|parameter| match parameter {
            Parameter::LinkInertia(link, InertiaElement::Xx) => Some(Self::Inertia(link)),
            Parameter::LinkInertia(..) => None,
            other => Some(Self::Parameter(other)),
        });
        unknowns
            .filter(|unknown| unknown.stated_sigma(machine) > 0.0)
            .collect()
    }

    /// Returns the name of the unknown.
    #[must_use]
    pub fn name(self, machine: &Machine) -> String {
        match self {
            Self::Parameter(parameter) => parameter.name(machine),
            Self::Inertia(link) => format!("{}.inertia_share", machine.links[link].name),
        }
    }

    /// Returns the unit of the unknown.
    #[must_use]
    pub fn unit(self, machine: &Machine) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.unit(machine),
            Self::Inertia(_) => "-",
        }
    }

    /// The value that a change is added to; `None` where only a change is meaningful.
    #[must_use]
    pub fn nominal(self, machine: &Machine) -> Option<f64> {
        match self {
            Self::Parameter(parameter) => parameter.nominal(machine),
            Self::Inertia(_) => None,
        }
    }

    /// Standard deviation before anything was identified, from the machine file or by default.
    #[must_use]
    pub fn stated_sigma(self, machine: &Machine) -> f64 {
        match self {
            Self::Parameter(parameter) => stated_sigma(machine, parameter),
            Self::Inertia(link) => {
                let link = &machine.links[link];
                let largest = principal_moments(&link.inertia.about_com)[2];
                let of_replaced = link.inertia_sigma.map_or(0.0, |sigma| sigma / largest);
                machine.uncertainty.inertia_share.max(of_replaced)
            }
        }
    }

    /// Returns the derivative of a number with respect to the unknown, from those with respect to all parameters
    /// ([`Parameter::all`], which is `parameters`).
    #[must_use]
    pub fn derivative(self, machine: &Machine, parameters: &[Parameter], by: &[f64]) -> f64 {
        let place = |wanted| parameters.iter().position(|&parameter| parameter == wanted);
        let changes = self.changes(machine, 1.0).into_iter();
        changes
            .map(|(parameter, change)| place(parameter).map_or(0.0, |place| by[place] * change))
            .sum()
    }

    /// The changes of parameters that this change is.
    #[must_use]
    pub fn changes(self, machine: &Machine, change: f64) -> Vec<(Parameter, f64)> {
        match self {
            Self::Parameter(parameter) => vec![(parameter, change)],
            Self::Inertia(link) => {
                let elements = InertiaElement::ALL.into_iter();
                let of = |element| {
                    let parameter = Parameter::LinkInertia(link, element);
                    (
                        parameter,
                        change * parameter.nominal(machine).unwrap_or(0.0),
                    )
                };
                elements.map(of).collect()
            }
        }
    }
}
