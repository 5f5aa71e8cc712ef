//! `[links.NAME]`: how well mass and centre of mass of one link are known, where `[uncertainty]` does not suit it.

use serde::Deserialize;

/// `[links.NAME]`: standard deviations of one link of the URDF.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkSigma {
    /// Standard deviation of its mass (kg); default: `mass_share` of `[uncertainty]`.
    pub mass_sigma: Option<f64>,
    /// Standard deviation of its centre of mass along each axis of the link (m); default: `com` of
    /// `[uncertainty]`.
    pub com_sigma: Option<[f64; 3]>,
}

#[cfg(test)]
mod tests {
    use crate::machine::{Axis, LogFacts, MachineSpec, Parameter};

    const URDF: &str = include_str!("../../../tests/data/tiny.urdf");

    #[test]
    fn stated_sigmas_of_a_link_replace_the_shared_ones() {
        let check = |extra: &str| {
            let file = include_str!("../../../tests/data/tiny.toml");
            let spec = MachineSpec::from_toml(&format!("{file}\n{extra}"), "m.toml")?;
            spec.check(URDF, "tiny.urdf", LogFacts::default())
        };
        let plain = check("").unwrap();
        let name = "base_link";
        let link = plain.links().iter().position(|link| link.name == name);
        let link = link.unwrap();
        let stated = "mass_sigma = 7.0\ncom_sigma = [0.1, 0.2, 0.3]";
        let own = check(&format!("[links.{name}]\n{stated}")).unwrap();
        assert_eq!(Parameter::LinkMass(link).sigma(&own), 7.0);
        assert_eq!(Parameter::LinkCom(link, Axis::X).sigma(&own), 0.1);
        assert_eq!(Parameter::LinkCom(link, Axis::Z).sigma(&own), 0.3);
        for other in (0..plain.links().len()).filter(|&other| other != link) {
            let mass = Parameter::LinkMass(other);
            assert_eq!(mass.sigma(&own), mass.sigma(&plain));
        }
        for wrong in [
            "[links.nobody]",
            "[links.base_link]\nmass_sigma = -1.0",
            "[links.base_link]\ncom_sigma = [0, 0, nan]",
            "[links.base_link]\nsigma = 1.0",
        ] {
            assert!(check(wrong).is_err(), "{wrong}");
        }
    }
}
