//! The area on which a machine stands, seen from above: it stays on its supports while the zero moment point is within.

use nalgebra::Vector2;
use tipwatch_mechanics::{Placement, State};

use crate::base::table::Table;

/// The area, in the contact plane: forward and left (m).
#[derive(Debug, Default)]
pub(super) struct Area {
    /// Its corners, counter-clockwise; none where the supports are unknown.
    pub(super) corners: Vec<Vector2<f64>>,
    /// Two contacts of each axle that swings about a pivot and carries there.
    pub(super) axles: Vec<[Vector2<f64>; 2]>,
}

impl Area {
    /// Returns the area of the supports at a row: within the contact points, and on the inner side of each line about which the
    /// machine tips.
    pub(super) fn of(rows: &Table, row: usize, state: &State<f64>) -> Self {
        let Some(machine) = rows.machine_at(row) else {
            return Self::default();
        };
        let mut placement = Placement::new(machine);
        placement.place(state);
        let contacts = placement.contacts.iter();
        let contacts: Vec<_> = contacts.map(|at| placement.on_plane(at)).collect();
        if contacts.iter().flatten().any(|part| !part.is_finite()) {
            return Self::default();
        }
        let mut area = Self {
            corners: hull(contacts.clone()),
            axles: Vec::new(),
        };
        for (index, edge) in machine.polygon().edges().iter().enumerate() {
            for axle in machine.axles_astride(edge) {
                area.corners = left_of(&area.corners, placement.tipping_line(index).on_ground);
                let own = contacts.iter().zip(&axle.supports_wheel);
                let mut own = own.filter(|(_, is_own)| **is_own).map(|(at, _)| *at);
                let wheels = own.next().zip(own.next_back()).map(|(a, b)| [a, b]);
                let is_new = |wheels: &[Vector2<f64>; 2]| !area.axles.contains(wheels);
                if let Some(wheels) = wheels.filter(is_new) {
                    area.axles.push(wheels);
                }
            }
        }
        area
    }

    /// Whether a point is in the area; `None` where the supports are unknown.
    pub(super) fn is_inside(&self, point: &Vector2<f64>) -> Option<bool> {
        let next = self.corners.iter().cycle().skip(1);
        let mut edges = self.corners.iter().zip(next);
        let is_known = !self.corners.is_empty();
        is_known.then(|| edges.all(|(from, to)| left([*from, *to], point) > 0.0))
    }
}

/// Returns the distance of a point to the left of a line, times the length of the line (m²).
fn left([from, to]: [Vector2<f64>; 2], point: &Vector2<f64>) -> f64 {
    (to - from).perp(&(point - from))
}

/// The corners around some points, counter-clockwise: those inside and on the edges are left out.
fn hull(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    // Andrew's monotone chain: the lower side from the least x to the greatest, then the upper side back
    let side = |points: &mut dyn Iterator<Item = &Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for next in points {
            while let [.., a, b] = chain[..] {
                if left([a, b], next) > 1e-9 {
                    break;
                }
                chain.pop();
            }
            chain.push(*next);
        }
        chain.pop();
        chain
    };
    let mut corners = side(&mut points.iter());
    corners.extend(side(&mut points.iter().rev()));
    corners
}

/// The part of a convex area to the left of a line.
fn left_of(corners: &[Vector2<f64>], line: [Vector2<f64>; 2]) -> Vec<Vector2<f64>> {
    let mut kept = Vec::new();
    let next = corners.iter().cycle().skip(1);
    for (from, to) in corners.iter().zip(next) {
        let [here, there] = [from, to].map(|corner| left(line, corner));
        if here >= 0.0 {
            kept.push(*from);
        }
        if here * there < 0.0 {
            kept.push(from + (to - from) * (here / (here - there)));
        }
    }
    hull(kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(all: &[[f64; 2]]) -> Vec<Vector2<f64>> {
        all.iter().map(|&point| point.into()).collect()
    }

    #[test]
    fn points_inside_and_on_the_edges_are_no_corners() {
        let found = hull(points(&[
            [2.0, 1.0],
            [2.0, -1.0],
            [0.0, 1.0],
            [-2.0, 1.0],
            [-2.0, -1.0],
            [0.5, 0.3],
        ]));
        let expected = points(&[[-2.0, -1.0], [2.0, -1.0], [2.0, 1.0], [-2.0, 1.0]]);
        assert_eq!(found, expected);
    }

    #[test]
    fn an_axle_with_a_pivot_leaves_the_triangle_to_it() {
        let square = points(&[[-2.0, -1.0], [0.0, -1.0], [0.0, 1.0], [-2.0, 1.0]]);
        let pivot = Vector2::new(-2.0, 0.0);
        let right_of_it = left_of(&square, [pivot, Vector2::new(0.0, -1.0)]);
        let found = left_of(&right_of_it, [Vector2::new(0.0, 1.0), pivot]);
        assert_eq!(found, points(&[[-2.0, 0.0], [0.0, -1.0], [0.0, 1.0]]));
    }
}
