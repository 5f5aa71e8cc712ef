//! Shapes as outlines in a plane.

use nalgebra::{Isometry3, Point3};

use crate::body::{Machine, Shape, Solid, sheet_poses};

/// A plane of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum View {
    /// View from the right: x to the right, z up.
    Side,
    /// View from above: x to the right, y up.
    Top,
}

/// An outline of the picture: points, colour and depth.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) colour: [f64; 3],
    /// Nearness to the viewer (m).
    pub(super) depth: f64,
    pub(super) is_support: bool,
}

impl View {
    pub(super) fn of(self, p: &Point3<f64>) -> [f64; 2] {
        match self {
            Self::Side => [p.x, p.z],
            Self::Top => [p.x, p.y],
        }
    }

    fn depth(self, p: &Point3<f64>) -> f64 {
        match self {
            Self::Side => -p.y,
            Self::Top => p.z,
        }
    }
}

/// Outlines of all shapes in the posture of the sheet, the farthest first.
pub(super) fn outlines(machine: &Machine, view: View) -> Vec<Outline> {
    let at = sheet_poses(&machine.links);
    let mut found: Vec<Outline> = Vec::new();
    for (link, pose) in machine.links.iter().zip(&at) {
        let is_support = machine.outriggers.iter().any(|pad| pad.link == link.name);
        for shape in &link.shapes {
            found.push(outline(shape, pose, view, is_support));
        }
    }
    found.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    found
}

fn outline(shape: &Shape, pose: &Isometry3<f64>, view: View, is_support: bool) -> Outline {
    let [x, y, z] = shape.xyz;
    let corners: Vec<Point3<f64>> = match shape.solid {
        Solid::Box([a, b, c]) => {
            let signs = [-0.5, 0.5];
            let corner = |i: usize| {
                let sign = |bit: usize| signs[(i >> bit) & 1];
                Point3::new(x + a * sign(0), y + b * sign(1), z + c * sign(2))
            };
            (0..8).map(corner).collect()
        }
        Solid::CylinderY { radius, length } => (0..96)
            .map(|i| {
                let (sin, cos) = (f64::from(i / 2) * std::f64::consts::TAU / 48.0).sin_cos();
                let end = if i % 2 == 0 { -0.5 } else { 0.5 };
                Point3::new(x + radius * cos, y + end * length, z + radius * sin)
            })
            .collect(),
    };
    let placed: Vec<Point3<f64>> = corners.iter().map(|corner| pose * corner).collect();
    let nearest = placed
        .iter()
        .map(|p| view.depth(p))
        .fold(f64::NEG_INFINITY, f64::max);
    Outline {
        points: hull(placed.iter().map(|p| view.of(p)).collect()),
        colour: shape.colour,
        depth: nearest,
        is_support,
    }
}

/// The convex hull, counter-clockwise (Andrew's monotone chain).
pub(super) fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let turn = |o: [f64; 2], a: [f64; 2], b: [f64; 2]| {
        (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
    };
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while chain.len() >= 2
                && turn(chain[chain.len() - 2], chain[chain.len() - 1], point) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let lower = chain(&mut points.iter().copied());
    let upper = chain(&mut points.iter().rev().copied());
    [lower, upper].concat()
}
