//! Validation of `[links.NAME]`.

use super::checker::Checker;
use crate::machine::{LinkSigma, MachineError};

impl Checker<'_> {
    pub(super) fn check_link_sigmas(&self) -> Result<(), MachineError> {
        for (name, sigma) in &self.spec.links {
            let link = self.link(&format!("links.{name}"), name)?;
            if !(self.tree.links[link].inertia.mass > 0.0) {
                let expected = "a link with a mass in the URDF";
                return Err(self.value_error(format!("links.{name}"), expected, "one without"));
            }
            let mass = sigma.mass_sigma.iter().map(|value| ("mass_sigma", *value));
            let com = sigma.com_sigma.iter().flatten();
            for (key, value) in mass.chain(com.map(|value| ("com_sigma", *value))) {
                if !(value.is_finite() && value >= 0.0) {
                    let place = format!("links.{name}.{key}");
                    let expected = "a standard deviation that is not negative";
                    return Err(self.value_error(place, expected, value));
                }
            }
        }
        Ok(())
    }

    /// The standard deviations of a link, in the axes of the link.
    pub(super) fn link_sigma(&self, link: usize) -> LinkSigma {
        let name = &self.tree.links[link].name;
        self.spec.links.get(name).copied().unwrap_or_default()
    }
}
