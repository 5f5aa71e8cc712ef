//! Guesses linkages: the hinge and the rod of a cylinder that drives another joint.

use tipwatch_mechanics::machine::{JointMotion, Outline, OutlineJoint};

use super::words::{has_word, own_words};

/// Smallest cosine between parallel axes.
const PARALLEL: f64 = 0.99;
const CYLINDER: [&str; 5] = ["cylinder", "piston", "ram", "actuator", "cyl"];

/// A linear actuator that closes a triangle, as far as the URDF describes it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LinkageGuess {
    pub(super) name: String,
    pub(super) pivot: String,
    pub(super) cylinder: String,
    pub(super) rod: String,
    /// The links of its two eyes.
    pub(super) rod_link: String,
    pub(super) pivot_link: String,
    /// The places of the rod's eye and of its pin in those links (m), which no URDF has.
    pub(super) eyes: Option<[[f64; 3]; 2]>,
    pub(super) why: String,
}

impl LinkageGuess {
    /// The joints that only a cylinder moves.
    pub(super) fn passive_joints(&self) -> [&String; 2] {
        [&self.cylinder, &self.rod]
    }
}

/// Finds cylinders: a sliding joint on an unmeasured hinge, next to a joint with a parallel axis on the
/// same body.
pub(super) fn linkages(outline: &Outline, logged: &[String]) -> Vec<LinkageGuess> {
    let is_logged = |joint: &OutlineJoint| logged.contains(&joint.name);
    let mut found: Vec<LinkageGuess> = Vec::new();
    for (rod_link, link) in outline.links.iter().enumerate() {
        let Some(rod) = joint(outline, rod_link, JointMotion::Prismatic) else {
            continue;
        };
        let Some(hinge_link) = link.parent.and_then(|parent| carrier(outline, parent)) else {
            continue;
        };
        let Some(hinge) = joint(outline, hinge_link, JointMotion::Revolute) else {
            continue;
        };
        let ends_there = (0..outline.links.len())
            .filter(|&l| l != rod_link && outline.is_below(l, hinge_link) && l != hinge_link)
            .all(|l| !outline.links[l].moves());
        let is_cylinder = match logged.is_empty() {
            true => {
                has_word(&outline.links[hinge_link].name, &CYLINDER)
                    || has_word(&hinge.name, &CYLINDER)
            }
            false => !is_logged(hinge),
        };
        if rod.mimics || hinge.mimics || !ends_there || !is_cylinder {
            continue;
        }
        let carried_by = |l: usize| outline.links[l].parent.map(|p| carrier(outline, p));
        let has_linkage = |name: &str| found.iter().any(|f| f.pivot == name);
        let pivots = (0..outline.links.len())
            .filter(|&l| l != hinge_link && carried_by(l) == carried_by(hinge_link));
        let pivots = pivots.filter(|&l| !is_hinge(outline, l));
        let pivots = pivots.filter_map(|l| Some((l, joint(outline, l, JointMotion::Revolute)?)));
        let parallel = pivots.filter(|(_, pivot)| {
            pivot.axis_in_base.dot(&hinge.axis_in_base).abs() > PARALLEL
                && !has_linkage(&pivot.name)
        });
        let alike = |pivot: &OutlineJoint| {
            let own = own_words(&pivot.name);
            let of_both = [own_words(&hinge.name), own_words(&rod.name)].concat();
            own.iter().filter(|word| of_both.contains(word)).count()
        };
        let Some((pivot_link, pivot)) = parallel.max_by_key(|(_, pivot)| alike(pivot)) else {
            continue;
        };
        let measured = [pivot, rod].into_iter().find(|joint| is_logged(joint));
        let from = measured.map_or(String::new(), |joint| {
            format!("; the log measures {}", joint.name)
        });
        found.push(LinkageGuess {
            name: pivot.name.clone(),
            pivot: pivot.name.clone(),
            cylinder: hinge.name.clone(),
            rod: rod.name.clone(),
            rod_link: link.name.clone(),
            pivot_link: outline.links[pivot_link].name.clone(),
            eyes: None,
            why: format!(
                "{} slides on the unmeasured hinge {}, next to {} with a parallel axis{from}",
                rod.name, hinge.name, pivot.name
            ),
        });
    }
    found
}

/// Whether a link is a cylinder: it is named like one and carries exactly one sliding rod. A telescopic
/// boom is not a cylinder.
fn is_hinge(outline: &Outline, link: usize) -> bool {
    let hinge = &outline.links[link];
    let joint_name = hinge.joint.as_ref().map_or("", |joint| &joint.name);
    if !(has_word(&hinge.name, &CYLINDER) || has_word(joint_name, &CYLINDER)) {
        return false;
    }
    let moving = (0..outline.links.len())
        .filter(|&l| l != link && outline.is_below(l, link) && outline.links[l].moves());
    let moving: Vec<usize> = moving.collect();
    matches!(moving[..], [rod] if joint(outline, rod, JointMotion::Prismatic).is_some())
}

/// The parent joint of a link, if it has this motion; continuous counts as revolute.
fn joint(outline: &Outline, link: usize, motion: JointMotion) -> Option<&OutlineJoint> {
    let joint = outline.links[link].joint.as_ref()?;
    let same = joint.motion == motion
        || (motion == JointMotion::Revolute && joint.motion == JointMotion::Continuous);
    same.then_some(joint)
}

/// The root link of a link's rigid body, just after a moving joint; `None` for the base.
fn carrier(outline: &Outline, link: usize) -> Option<usize> {
    let up = std::iter::successors(Some(link), |&at| outline.links[at].parent);
    up.into_iter().find(|&at| outline.links[at].moves())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rockers on one body, each with a cylinder: all axes are parallel.
    fn outline() -> Outline {
        let mut text = String::from("<robot name='r'><link name='base_link'/>");
        let mut joint = |name: &str, kind: &str, parent: &str, axis: &str| {
            text.push_str(&format!(
                "<link name='{name}_link'><inertial><mass value='1'/>\
                 <inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>\
                 <joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{name}_link'/>\
                 <axis xyz='{axis}'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"
            ));
        };
        for side in ["left", "right"] {
            joint(
                &format!("cylinder_{side}"),
                "revolute",
                "base_link",
                "0 1 0",
            );
            joint(
                &format!("rod_{side}"),
                "prismatic",
                &format!("cylinder_{side}_link"),
                "1 0 0",
            );
        }
        for side in ["right", "left"] {
            joint(&format!("bogie_{side}"), "revolute", "base_link", "0 -1 0");
        }
        joint("boom_cylinder", "revolute", "base_link", "0 1 0");
        joint("boom_rod", "prismatic", "boom_cylinder_link", "1 0 0");
        // it turns and extends, but is not a cylinder
        joint("boom", "revolute", "base_link", "0 1 0");
        joint("reach", "prismatic", "boom_link", "1 0 0");
        text.push_str("</robot>");
        Outline::read(&text, "r.urdf").unwrap()
    }

    #[test]
    fn cylinders_match_the_parallel_joint_of_similar_name() {
        let logged = ["rod_left", "rod_right", "boom", "reach"].map(str::to_owned);
        let found = linkages(&outline(), &logged);
        let triples: Vec<[&str; 3]> = (found.iter())
            .map(|l| [l.pivot.as_str(), l.cylinder.as_str(), l.rod.as_str()])
            .collect();
        assert_eq!(
            triples,
            [
                ["bogie_left", "cylinder_left", "rod_left"],
                ["bogie_right", "cylinder_right", "rod_right"],
                ["boom", "boom_cylinder", "boom_rod"]
            ]
        );
        // without a log only names are known
        assert_eq!(linkages(&outline(), &[]).len(), 3);
    }
}
