//! Guesses the wheels and their radii.

use tipwatch_mechanics::machine::{JointMotion, Outline, OutlineLink, Shape};

use super::words::has_word;

const WHEEL: [&str; 5] = ["wheel", "tyre", "tire", "caster", "castor"];
/// Words for ground contacts that do not turn.
const GLIDER: [&str; 4] = ["caster", "castor", "skid", "glider"];
/// Frames on the ground by convention.
const FOOTPRINT: [&str; 2] = ["base_footprint", "footprint"];
/// Largest vertical component of a wheel axis.
const MOST_VERTICAL: f64 = 0.5;
/// Smallest cosine between parallel axes.
const PARALLEL: f64 = 0.95;
/// Plausible radii (m).
const PLAUSIBLE_M: [f64; 2] = [0.002, 3.0];
/// A wheel whose lowest point is higher than the others' by this share of its radius is not on the ground.
const OFF_GROUND_SHARE: f64 = 0.5;
/// Scale factors that convert other units to metres.
const UNITS: [f64; 4] = [1.0, 0.001, 0.01, 0.0254];

/// Fewest wheels of a machine.
const FEWEST: usize = 3;
/// Difference in height of wheel centres found by geometry, as a share of the distance between the farthest two.
const ONE_HEIGHT_SHARE: f64 = 0.1;
/// Difference in position of a left and a right wheel of a pair, as a share of their distance.
const PAIR_SHARE: f64 = 0.1;

/// A candidate wheel.
#[derive(Debug, Clone)]
pub(super) struct Wheel {
    /// Its name in the machine file.
    pub(super) name: String,
    /// Index of the link.
    pub(super) link: usize,
    /// Reason why the link counts as a wheel.
    pub(super) why: String,
    /// Radius (m) and its source.
    pub(super) radius: Option<(f64, String)>,
    /// Whether the radius is a guess that a person must confirm.
    pub(super) is_doubtful: bool,
}

/// Finds the wheels, front left first, and notes on rejected candidates.
pub(super) fn wheels(outline: &Outline) -> (Vec<Wheel>, Vec<String>) {
    let mut found: Vec<Wheel> = Vec::new();
    for (index, link) in outline.links.iter().enumerate() {
        if let Some(why) = rolls(link) {
            let inside = found.iter().any(|w| outline.is_below(index, w.link));
            if !inside {
                found.push(wheel(index, why, radius(link)));
            }
        }
    }
    if found.len() < FEWEST {
        for index in by_geometry(outline) {
            let inside = found.iter().any(|w| outline.is_below(index, w.link));
            if !inside {
                let why = "by geometry: it turns about a lying axle without limits, at one height with the others and \
                           in pairs of left and right: CHECK";
                found.push(wheel(index, why.into(), None));
            }
        }
    }
    let rolling = found.len();
    for (index, link) in outline.links.iter().enumerate() {
        let related =
            |w: &Wheel| outline.is_below(index, w.link) || outline.is_below(w.link, index);
        if glides(link) && !found.iter().any(related) {
            let why = "its name matches, although it does not turn".into();
            found.push(wheel(index, why, None));
        }
    }
    let ground = ground(outline, &found[..rolling]);
    for wheel in found.iter_mut().filter(|wheel| wheel.radius.is_none()) {
        let link = &outline.links[wheel.link];
        wheel.radius = combine_sources(height_above(link, ground.as_ref()), by_mesh(link));
        wheel.is_doubtful = true;
    }
    let rejected = drop_raised(outline, &mut found);
    name_by_position(outline, &mut found);
    (found, rejected)
}

fn wheel(link: usize, why: String, radius: Option<(f64, String)>) -> Wheel {
    Wheel {
        name: String::new(),
        link,
        why,
        radius,
        is_doubtful: false,
    }
}

/// Links that can only be wheels by their place: they turn without limits about lying axles, carry nothing that
/// moves, and lie in pairs of left and right at one height, the lowest one.
fn by_geometry(outline: &Outline) -> Vec<usize> {
    let place = |link: usize| outline.links[link].base_from_link.translation.vector;
    let turns_endlessly = |link: &OutlineLink| {
        link.joint.as_ref().is_some_and(|joint| {
            joint.motion == JointMotion::Continuous
                && joint.axis_in_base.z.abs() < MOST_VERTICAL
                && joint.axis_in_base.y.abs() > joint.axis_in_base.x.abs()
                && !joint.mimics
        })
    };
    let carries_nothing = |index: usize| {
        (0..outline.links.len())
            .all(|l| l == index || !outline.is_below(l, index) || !outline.links[l].moves())
    };
    let candidates: Vec<usize> = (0..outline.links.len())
        .filter(|&index| turns_endlessly(&outline.links[index]) && carries_nothing(index))
        .collect();
    let pairs_with = |a: usize| {
        candidates.iter().any(|&b| {
            let apart = place(a) - place(b);
            let near = PAIR_SHARE * apart.y.abs();
            apart.y.abs() > 0.0 && apart.x.abs() <= near && apart.z.abs() <= near
        })
    };
    let paired: Vec<usize> = candidates
        .iter()
        .copied()
        .filter(|&a| pairs_with(a))
        .collect();
    let lowest = paired
        .iter()
        .map(|&a| place(a).z)
        .fold(f64::INFINITY, f64::min);
    let distances = paired
        .iter()
        .flat_map(|&a| paired.iter().map(move |&b| (a, b)))
        .map(|(a, b)| (place(a) - place(b)).xy().norm());
    let extent = distances.fold(0.0, f64::max);
    let at_one_height = |&a: &usize| place(a).z - lowest <= ONE_HEIGHT_SHARE * extent;
    let found: Vec<usize> = paired.iter().copied().filter(at_one_height).collect();
    if found.len() < FEWEST {
        return Vec::new();
    }
    found
}

fn is_named(link: &OutlineLink, wanted: &[&str]) -> bool {
    let joint = link.joint.as_ref().map_or("", |joint| &joint.name);
    has_word(&link.name, wanted) || has_word(joint, wanted)
}

/// Returns the reason why a link counts as a rolling wheel; `None` if it does not.
fn rolls(link: &OutlineLink) -> Option<String> {
    let joint = link.joint.as_ref()?;
    let turns = matches!(
        joint.motion,
        JointMotion::Continuous | JointMotion::Revolute
    );
    if !turns || joint.axis_in_base.z.abs() > MOST_VERTICAL {
        return None;
    }
    if is_named(link, &WHEEL) {
        return Some(format!(
            "its name matches, and joint {} turns it about a horizontal axis",
            joint.name
        ));
    }
    let is_endless = joint.motion == JointMotion::Continuous;
    (is_endless && radius(link).is_some()).then(|| {
        format!(
            "it is round, and joint {} turns it about a horizontal axis without limits",
            joint.name
        )
    })
}

fn glides(link: &OutlineLink) -> bool {
    !link.moves() && link.joint.is_some() && is_named(link, &GLIDER)
}

/// Radius of a round shape about the joint axis.
fn radius(link: &OutlineLink) -> Option<(f64, String)> {
    let axis = link.joint.as_ref()?.axis_in_link;
    let of_shape = |shape: &Shape| match shape {
        Shape::Cylinder {
            radius,
            axis_in_link,
        } if axis.dot(axis_in_link).abs() > PARALLEL => Some((*radius, "cylinder")),
        Shape::Sphere { radius } => Some((*radius, "sphere")),
        _ => None,
    };
    let (radius, shape) = link.shapes.iter().find_map(of_shape)?;
    let is_plausible = (PLAUSIBLE_M[0]..PLAUSIBLE_M[1]).contains(&radius);
    is_plausible.then(|| (radius, format!("from the {shape} in the URDF")))
}

/// Height of the ground in the base frame (m), and its source.
fn ground(outline: &Outline, rolling: &[Wheel]) -> Option<(f64, String)> {
    let bottom = |wheel: &Wheel| {
        let (radius, _) = wheel.radius.as_ref()?;
        Some(outline.links[wheel.link].base_from_link.translation.z - radius)
    };
    let lowest = rolling.iter().filter_map(bottom).reduce(f64::min);
    if let Some(lowest) = lowest {
        return Some((lowest, "the ground under the other wheels".into()));
    }
    let footprint = FOOTPRINT.iter().find_map(|name| outline.link(name))?;
    let footprint = &outline.links[footprint];
    let height = footprint.base_from_link.translation.z;
    Some((
        height,
        format!("frame {}, assumed on the ground", footprint.name),
    ))
}

/// The radius of a wheel that stands on the ground.
fn height_above(link: &OutlineLink, ground: Option<&(f64, String)>) -> Option<(f64, String)> {
    let (ground, source) = ground?;
    let radius = link.base_from_link.translation.z - ground;
    let is_plausible = (PLAUSIBLE_M[0]..PLAUSIBLE_M[1]).contains(&radius);
    is_plausible.then(|| (radius, format!("height of its centre above {source}")))
}

/// The radius of a mesh of unit size, from its scale.
fn by_mesh(link: &OutlineLink) -> Option<(f64, String)> {
    let axle = link.joint.as_ref()?.axis_in_link.iamax();
    let of_shape = |shape: &Shape| match shape {
        Shape::Mesh {
            file,
            scale_in_link,
        } => Some((file.clone(), *scale_in_link)),
        _ => None,
    };
    let (file, scale) = link.shapes.iter().find_map(of_shape)?;
    let [a, b] = [(axle + 1) % 3, (axle + 2) % 3].map(|i| scale[i]);
    let is_size = (a - b).abs() < 0.01 * a && UNITS.iter().all(|unit| (a - unit).abs() > 1e-9);
    let is_plausible = (PLAUSIBLE_M[0]..PLAUSIBLE_M[1]).contains(&a);
    (is_size && is_plausible).then(|| {
        let why = format!(
            "scale of the mesh {file} across the axle, which is the radius if the mesh has unit radius: MEASURE IT"
        );
        (a, why)
    })
}

/// The value of the first source, with a note if the second one contradicts it.
fn combine_sources(
    first: Option<(f64, String)>,
    second: Option<(f64, String)>,
) -> Option<(f64, String)> {
    let (Some((radius, why)), Some((other, other_why))) = (&first, &second) else {
        return first.or(second);
    };
    let differ = (radius - other).abs() > 0.02 * radius;
    let why = match differ {
        true => format!("{why}. Conflicting source: {other:.4}, {other_why}"),
        false => why.clone(),
    };
    Some((*radius, why))
}

/// Rejects candidates above the ground, such as a steering wheel.
fn drop_raised(outline: &Outline, found: &mut Vec<Wheel>) -> Vec<String> {
    let bottom = |wheel: &Wheel| {
        let (radius, _) = wheel.radius.as_ref()?;
        let bottom = outline.links[wheel.link].base_from_link.translation.z - radius;
        Some((bottom, *radius))
    };
    let bottoms = found.iter().filter_map(bottom).map(|(bottom, _)| bottom);
    let Some(lowest) = bottoms.reduce(f64::min) else {
        return Vec::new();
    };
    let mut rejected = Vec::new();
    found.retain(|wheel| {
        let raised = bottom(wheel).map(|(bottom, radius)| (bottom - lowest, radius));
        let Some((height, _)) = raised.filter(|(height, r)| *height > OFF_GROUND_SHARE * r) else {
            return true;
        };
        let name = &outline.links[wheel.link].name;
        rejected.push(format!(
            "Skipped link {name}: it looks like a wheel but its lowest point is {height:.3} m above that of the lowest wheel."
        ));
        false
    });
    rejected
}

/// Names FL, FR, RL, RR for two axles of two wheels; else side and number of the axle, front first.
fn name_by_position(outline: &Outline, found: &mut [Wheel]) {
    let place = |wheel: &Wheel| outline.links[wheel.link].base_from_link.translation.vector;
    found.sort_by(|a, b| place(b).x.total_cmp(&place(a).x));
    let (mut first, mut last) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut widest = 0.0_f64;
    for wheel in found.iter() {
        (first, last) = (first.max(place(wheel).x), last.min(place(wheel).x));
        widest = widest.max(place(wheel).y.abs());
    }
    let (mut axle, mut axle_x, mut sides) = (0, f64::INFINITY, Vec::new());
    for wheel in found.iter() {
        let at = place(wheel);
        if axle_x - at.x > 0.1 * (first - last) || axle == 0 {
            (axle, axle_x) = (axle + 1, at.x);
        }
        let side = match at.y {
            y if y.abs() < 0.1 * widest => 'C',
            y if y > 0.0 => 'L',
            _ => 'R',
        };
        sides.push((axle, side));
    }
    let plain = [(1, 'L'), (1, 'R'), (2, 'L'), (2, 'R')];
    let is_plain = found.len() == 4 && plain.iter().all(|place| sides.contains(place));
    for (i, (axle, side)) in sides.iter().enumerate() {
        let twins = sides[..i].iter().filter(|s| *s == &(*axle, *side)).count();
        let twin = ["", "b", "c", "d"].get(twins).copied().unwrap_or("x");
        found[i].name = match is_plain {
            true => format!("{}{side}", if *axle == 1 { 'F' } else { 'R' }),
            false => format!("{side}{axle}{twin}"),
        };
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
}
