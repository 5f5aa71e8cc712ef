//! The box around the shape of a link, along the axes of the link.

use std::collections::HashMap;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;

use super::urdf_text::{by_link, triple};

/// Edges of the box around the primitive shapes of each link (m): of its collision shapes, else of its visual ones. A
/// link with meshes alone has none, because meshes are other files.
pub(super) fn boxes_by_link(text: &str) -> HashMap<String, Vector3<f64>> {
    by_link(text, box_of)
}

fn box_of(link: Node<'_, '_>) -> Option<Vector3<f64>> {
    let around = |tag: &'static str| {
        let holders = link.children().filter(move |n| n.has_tag_name(tag));
        let corners: Vec<Point3<f64>> = holders.filter_map(corners).flatten().collect();
        let first = corners.first()?.coords;
        let [mut least, mut largest] = [first; 2];
        for corner in &corners {
            least = least.inf(&corner.coords);
            largest = largest.sup(&corner.coords);
        }
        let edges = largest - least;
        (edges.iter().all(|edge| edge.is_finite()) && edges.max() > 0.0).then_some(edges)
    };
    around("collision").or_else(|| around("visual"))
}

/// The corners of the box around a shape, in the link.
fn corners(holder: Node<'_, '_>) -> Option<Vec<Point3<f64>>> {
    let child = |tag: &'static str| holder.children().find(move |n| n.has_tag_name(tag));
    let kind = child("geometry")?.children().find(Node::is_element)?;
    let length = |name: &str| {
        let length = kind.attribute(name)?.trim().parse::<f64>().ok()?;
        (length.is_finite() && length >= 0.0).then_some(length)
    };
    let edges = match kind.tag_name().name() {
        "box" => vector(kind.attribute("size")?)?,
        "sphere" => Vector3::repeat(2.0 * length("radius")?),
        "cylinder" => Vector3::new(
            2.0 * length("radius")?,
            2.0 * length("radius")?,
            length("length")?,
        ),
        "capsule" => Vector3::new(
            2.0 * length("radius")?,
            2.0 * length("radius")?,
            length("length")? + 2.0 * length("radius")?,
        ),
        _ => return None,
    };
    let origin = child("origin");
    let of_origin = |name: &str| vector(origin?.attribute(name)?);
    let xyz = of_origin("xyz").unwrap_or_default();
    let rpy = of_origin("rpy").unwrap_or_default();
    let pose = Isometry3::from_parts(
        Translation3::from(xyz),
        UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z),
    );
    let corner = |index: usize| {
        let sign = |bit: usize| if index & bit == 0 { -0.5 } else { 0.5 };
        let of_box = edges.component_mul(&Vector3::new(sign(1), sign(2), sign(4)));
        pose * Point3::from(of_box)
    };
    Some((0..8).map(corner).collect())
}

fn vector(text: &str) -> Option<Vector3<f64>> {
    let numbers = triple(text)?;
    let finite = numbers.iter().all(|number| number.is_finite());
    finite.then(|| Vector3::from(numbers))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_boxes_around_shapes() {
        let boxes = boxes_by_link(
            "<robot name='r'>
             <link name='turned'><visual><origin rpy='1.5707963267948966 0 0'/>
               <geometry><cylinder radius='0.2' length='1.0'/></geometry></visual></link>
             <link name='two'><collision><origin xyz='1 0 0'/><geometry><sphere radius='0.5'/></geometry></collision>
               <collision><geometry><box size='1 2 3'/></geometry></collision>
               <visual><geometry><box size='9 9 9'/></geometry></visual></link>
             <link name='mesh'><visual><geometry><mesh filename='a.stl'/></geometry></visual></link>
             <link name='wrong'><visual><geometry><box size='1 nan 1'/></geometry></visual></link></robot>",
        );
        let near = |name: &str, edges: [f64; 3]| {
            let apart = (boxes[name] - Vector3::from(edges)).norm();
            assert!(apart < 1e-12, "{name}: {}", boxes[name]);
        };
        near("turned", [0.4, 1.0, 0.4]);
        near("two", [2.0, 2.0, 3.0]);
        assert_eq!(boxes.len(), 2);
    }
}
