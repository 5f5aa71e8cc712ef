//! The machine as markers: loads as arrows, support polygon, zero moment point (ZMP), arm.

use anyhow::Result;
use nalgebra::{Vector2, Vector3};
use tipwatch_ingest::{Ros2Writer, WriterTopic};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Placement, Quantity};

use super::messages::{
    ColorRgba, CompressedImage, Duration, Header, Marker, MarkerArray, MeshFile, Point, Pose,
    Quaternion, Time,
};
use crate::base::rows::Rows;

const ARROW: i32 = 0;
const SPHERE: i32 = 2;
const LINE_STRIP: i32 = 4;
const LINE_LIST: i32 = 5;
const TEXT: i32 = 9;
const ADD: i32 = 0;
const DELETE: i32 = 2;
/// Length of the arrow of a wheel with its static load (m).
const ARROW_AT_REST_M: f64 = 1.0;

const BLUE: ColorRgba = colour(0.0, 0.45, 0.70);
const ORANGE: ColorRgba = colour(0.90, 0.62, 0.0);
const RED: ColorRgba = colour(0.84, 0.15, 0.05);
const GREY: ColorRgba = colour(0.35, 0.35, 0.35);
const BLACK: ColorRgba = colour(0.1, 0.1, 0.1);

const fn colour(r: f32, g: f32, b: f32) -> ColorRgba {
    ColorRgba { r, g, b, a: 1.0 }
}

/// The topic of the markers.
#[derive(Debug)]
pub(super) struct Markers {
    topic: WriterTopic,
}

impl Markers {
    pub(super) fn begin(writer: &mut Ros2Writer) -> Result<Self> {
        let topic = writer.topic(
            "/tipwatch/markers",
            "visualization_msgs/msg/MarkerArray",
            None,
        )?;
        Ok(Self { topic })
    }

    /// Writes the markers of a row and deletes those that cannot be placed.
    pub(super) fn write(
        &self,
        machine: &Machine,
        rows: &Rows,
        row: usize,
        placement: &Placement<'_>,
        writer: &mut Ros2Writer,
    ) -> Result<()> {
        let time_ns = rows.times_ns[row];
        let draw = Draw {
            header: Header {
                stamp: Time::from_ns(time_ns),
                frame_id: machine.base_link(),
            },
        };
        let mut markers = loads(machine, rows, row, placement, &draw);
        markers.push(polygon(machine, placement, &draw));
        markers.push(zmp(rows, row, placement, &draw));
        let arm = placement.arm_segments.iter().flatten().copied().collect();
        markers.push(draw.lines("arm", LINE_LIST, arm, 0.06, GREY));
        Ok(writer.write(self.topic, time_ns, &MarkerArray { markers })?)
    }
}

/// An arrow up from each contact point, proportional to the load, labelled in kN.
fn loads<'a>(
    machine: &Machine,
    rows: &Rows,
    row: usize,
    placement: &Placement<'_>,
    draw: &Draw<'a>,
) -> Vec<Marker<'a>> {
    let outcomes = &rows.outcomes;
    let at_rest = &machine.reference().static_load;
    let mut markers = Vec::new();
    for (wheel, contact) in placement.contacts.iter().enumerate() {
        let load_n = outcomes.column(Quantity::Load(wheel))[row];
        let share = load_n / at_rest[wheel];
        // an arrow without length has no direction
        let tip = contact + placement.normal * (share.clamp(0.001, 4.0) * ARROW_AT_REST_M);
        let colour = match share {
            share if share <= 0.0 => RED,
            share if share < 0.25 => ORANGE,
            _ => BLUE,
        };
        let id = i32::try_from(wheel).unwrap_or(0);
        let mut arrow = draw.lines("loads", ARROW, vec![*contact, tip], 0.08, colour);
        // shaft diameter, head diameter, head length
        (arrow.scale.y, arrow.scale.z) = (0.18, 0.2);
        markers.push(Marker { id, ..arrow });
        let text = format!("{} {:.1} kN", machine.wheels()[wheel].name, load_n / 1e3);
        markers.push(Marker {
            id,
            text,
            ..draw.at(
                "labels",
                TEXT,
                contact - placement.normal * 0.15,
                0.22,
                BLACK,
            )
        });
    }
    markers
}

fn polygon<'a>(machine: &Machine, placement: &Placement<'_>, draw: &Draw<'a>) -> Marker<'a> {
    let edges = machine.polygon().edges().iter();
    let mut corners: Vec<_> = edges.map(|edge| placement.contacts[edge.from]).collect();
    corners.extend(corners.first().copied());
    draw.lines("support_polygon", LINE_STRIP, corners, 0.03, BLACK)
}

fn zmp<'a>(rows: &Rows, row: usize, placement: &Placement<'_>, draw: &Draw<'a>) -> Marker<'a> {
    let value = |quantity| rows.outcomes.column(quantity)[row];
    let zmp = Vector2::new(value(Quantity::ZmpX), value(Quantity::ZmpY));
    let colour = match value(Quantity::ZmpMargin) {
        margin if margin <= 0.0 => RED,
        _ => BLUE,
    };
    draw.at("zmp", SPHERE, placement.from_plane(&zmp), 0.15, colour)
}

/// Markers of one instant.
struct Draw<'a> {
    header: Header<'a>,
}

impl<'a> Draw<'a> {
    fn at(
        &self,
        name: &'a str,
        shape: i32,
        place: Vector3<f64>,
        size_m: f64,
        colour: ColorRgba,
    ) -> Marker<'a> {
        let known = place.iter().all(|c| c.is_finite());
        let place = if known { place } else { Vector3::zeros() };
        Marker {
            header: self.header,
            ns: name,
            id: 0,
            shape,
            action: if known { ADD } else { DELETE },
            pose: Pose {
                position: point(&place),
                orientation: Quaternion {
                    x: 0.0,
                    y: 0.0,
                    z: 0.0,
                    w: 1.0,
                },
            },
            scale: point(&Vector3::repeat(size_m)),
            color: colour,
            lifetime: Duration { sec: 0, nanosec: 0 },
            frame_locked: false,
            points: Vec::new(),
            colors: Vec::new(),
            texture_resource: "",
            texture: CompressedImage {
                header: Header {
                    frame_id: "",
                    ..self.header
                },
                format: "",
                data: &[],
            },
            uv_coordinates: Vec::new(),
            text: String::new(),
            mesh_resource: "",
            mesh_file: MeshFile {
                filename: "",
                data: &[],
            },
            mesh_use_embedded_materials: false,
        }
    }

    fn lines(
        &self,
        name: &'a str,
        shape: i32,
        points: Vec<Vector3<f64>>,
        width_m: f64,
        colour: ColorRgba,
    ) -> Marker<'a> {
        let known = points.iter().flat_map(|p| p.iter()).all(|c| c.is_finite());
        let action = match known && !points.is_empty() {
            true => ADD,
            false => DELETE,
        };
        let points = if known { points } else { Vec::new() };
        Marker {
            action,
            points: points.iter().map(point).collect(),
            ..self.at(name, shape, Vector3::zeros(), width_m, colour)
        }
    }
}

fn point(place: &Vector3<f64>) -> Point {
    Point {
        x: place.x,
        y: place.y,
        z: place.z,
    }
}
