//! The support polygon: the convex hull of the contact points, its edges and their names.

use nalgebra::Vector2;

/// The edges of a machine on four wheels, in the order of a polygon; others are named by the wheels at their ends.
pub const EDGES_OF_FOUR: [&str; 4] = ["front", "left", "rear", "right"];
/// A wheel within this fraction of the polygon's diameter of an edge counts as lying on it.
const ON_EDGE_SHARE: f64 = 0.02;

/// The support polygon with all joints at zero. The set of wheels that span it is fixed; their positions
/// follow the joints.
#[derive(Debug, Clone)]
pub struct SupportPolygon {
    pub(crate) edges: Vec<Edge>,
}

/// An edge, counter-clockwise seen from above: the interior is on its left.
#[derive(Debug, Clone)]
pub struct Edge {
    /// `front`, `left`, `rear` or `right` for four wheels, otherwise `<from>_<to>` in lower case.
    pub name: String,
    /// Index of the wheel where it starts.
    pub from: usize,
    /// Index of the wheel where it ends.
    pub to: usize,
    /// Whether each wheel lies on the edge.
    pub carries: Vec<bool>,
}

impl Edge {
    /// Indices of the wheels that do not lie on it.
    pub fn off(&self) -> impl Iterator<Item = usize> {
        (0..self.carries.len()).filter(|&wheel| !self.carries[wheel])
    }
}

impl SupportPolygon {
    /// The edges, counter-clockwise; for four wheels front, left, rear, right.
    #[must_use]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The polygon of contact points given by x and y in the base frame (m); `None` if it has no area.
    pub(super) fn build(points: &[Vector2<f64>], names: &[&str]) -> Option<Self> {
        let diameter = points
            .iter()
            .flat_map(|a| points.iter().map(move |b| (a - b).norm()))
            .fold(0.0, f64::max);
        let corners = hull(points, ON_EDGE_SHARE * diameter);
        if corners.len() < 3 {
            return None;
        }
        let n = corners.len();
        let normal_x = |k: usize| {
            let along: Vector2<f64> = points[corners[(k + 1) % n]] - points[corners[k]];
            along.y / along.norm()
        };
        let front = (0..n).max_by(|&a, &b| normal_x(a).total_cmp(&normal_x(b)))?;
        let edges = (0..n)
            .map(|i| {
                let (from, to) = (corners[(front + i) % n], corners[(front + i + 1) % n]);
                let name = if points.len() == 4 && n == 4 {
                    EDGES_OF_FOUR[i].to_string()
                } else {
                    format!(
                        "{}_{}",
                        names[from].to_lowercase(),
                        names[to].to_lowercase()
                    )
                };
                let carries = points.iter().map(|p| {
                    distance_inside(&points[from], &points[to], p) < ON_EDGE_SHARE * diameter
                });
                Edge {
                    name,
                    from,
                    to,
                    carries: carries.collect(),
                }
            })
            .collect();
        Some(Self { edges })
    }
}

/// Distance of `point` from the line `from`-`to`, positive on its left.
fn distance_inside(from: &Vector2<f64>, to: &Vector2<f64>, point: &Vector2<f64>) -> f64 {
    let along = to - from;
    along.perp(&(point - from)) / along.norm()
}

/// Corners of the convex hull, counter-clockwise, without those that protrude less than `tolerance`.
fn hull(points: &[Vector2<f64>], tolerance: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| {
        points[a]
            .x
            .total_cmp(&points[b].x)
            .then(points[a].y.total_cmp(&points[b].y))
    });
    let chain = |order: &mut dyn Iterator<Item = usize>| {
        let mut chain: Vec<usize> = Vec::new();
        for next in order {
            while let [.., before, last] = chain[..] {
                if (points[next] - points[before]).norm() > 0.0
                    && -distance_inside(&points[before], &points[next], &points[last]) > 0.0
                {
                    break;
                }
                chain.pop();
            }
            chain.push(next);
        }
        chain.pop();
        chain
    };
    let mut corners = chain(&mut order.iter().copied());
    corners.extend(chain(&mut order.iter().rev().copied()));
    drop_flat_corners(points, corners, tolerance)
}

fn drop_flat_corners(
    points: &[Vector2<f64>],
    mut corners: Vec<usize>,
    tolerance: f64,
) -> Vec<usize> {
    while corners.len() > 2 {
        let n = corners.len();
        let height = |k: usize| {
            -distance_inside(
                &points[corners[(k + n - 1) % n]],
                &points[corners[(k + 1) % n]],
                &points[corners[k]],
            )
        };
        let Some(flattest) = (0..n).min_by(|&a, &b| height(a).total_cmp(&height(b))) else {
            break;
        };
        if height(flattest) >= tolerance {
            break;
        }
        corners.remove(flattest);
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(points: &[(f64, f64)], names: &[&str]) -> SupportPolygon {
        let points: Vec<_> = points.iter().map(|&(x, y)| Vector2::new(x, y)).collect();
        SupportPolygon::build(&points, names).unwrap()
    }

    #[test]
    fn four_wheels_give_named_edges() {
        let p = polygon(
            &[(1.0, 0.8), (1.0, -0.8), (-1.0, 0.8), (-1.0, -0.8)],
            &["FL", "FR", "RL", "RR"],
        );
        let edges: Vec<_> = p
            .edges()
            .iter()
            .map(|e| (e.name.as_str(), e.from, e.to))
            .collect();
        assert_eq!(
            edges,
            [
                ("front", 1, 0),
                ("left", 0, 2),
                ("rear", 2, 3),
                ("right", 3, 1)
            ]
        );
    }

    #[test]
    fn middle_wheels_of_six_lie_on_side_edges() {
        let p = polygon(
            &[
                (2.0, 0.8),
                (2.0, -0.8),
                (0.0, 0.81),
                (0.0, -0.79),
                (-1.0, 0.8),
                (-1.0, -0.8),
            ],
            &["L1", "R1", "L2", "R2", "L3", "R3"],
        );
        assert_eq!(p.edges().len(), 4);
        let left = p.edges().iter().find(|e| e.name == "l1_l3").unwrap();
        assert_eq!(left.carries, [true, false, true, false, true, false]);
    }

    #[test]
    fn wheels_in_line_span_no_polygon() {
        let points: Vec<_> = (0..3).map(|i| Vector2::new(f64::from(i), 0.0)).collect();
        assert!(SupportPolygon::build(&points, &["A", "B", "C"]).is_none());
    }
}
