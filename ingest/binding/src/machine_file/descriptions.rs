//! Several robot descriptions in one log: which of them counts, and whether they describe one machine.

use std::collections::BTreeMap;

use tipwatch_ingest::RobotDescription;
use tipwatch_mechanics::machine::Outline;

/// Masses that differ by a smaller share are the same, written with other digits.
const SAME_MASS: f64 = 1e-6;

/// A link whose mass differs between two descriptions of a log (kg); `None` where a description has no such mass.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OtherMass {
    pub(crate) link: String,
    pub(crate) earlier: Option<f64>,
    pub(crate) last: Option<f64>,
}

/// Compares an earlier description with the last one. One without masses is a placeholder, which the last one replaces.
pub(crate) fn other_mass(earlier: &RobotDescription, last: &RobotDescription) -> Option<OtherMass> {
    let (earlier, last) = (masses(earlier), masses(last));
    if earlier.is_empty() {
        return None;
    }
    let links = earlier.keys().chain(last.keys());
    links
        .map(|link| OtherMass {
            link: link.clone(),
            earlier: earlier.get(link).copied(),
            last: last.get(link).copied(),
        })
        .find(|masses| match (masses.earlier, masses.last) {
            (Some(a), Some(b)) => (a - b).abs() > SAME_MASS * a.abs().max(b.abs()),
            _ => true,
        })
}

/// The masses of all links that have one (kg); none for a text that is not a URDF.
fn masses(description: &RobotDescription) -> BTreeMap<String, f64> {
    let outline = Outline::read(&description.text, &description.topic);
    let links = outline.into_iter().flat_map(|outline| outline.links);
    let with_mass = links.filter(|link| link.mass != 0.0);
    with_mass.map(|link| (link.name, link.mass)).collect()
}

/// A mass as text.
pub(crate) fn mass_text(mass: Option<f64>) -> String {
    mass.map_or("no mass".into(), |mass| format!("{mass} kg"))
}
