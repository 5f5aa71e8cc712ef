//! ROS 2 messages; fields in the order of their definitions.

use serde::Serialize;
use serde::ser::{SerializeTuple, Serializer};

use crate::base::options::Precision;

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Time {
    sec: i32,
    nanosec: u32,
}

impl Time {
    /// Converts a time in nanoseconds; zero if out of range.
    pub(super) fn from_ns(time_ns: i64) -> Self {
        let whole = i32::try_from(time_ns.div_euclid(1_000_000_000));
        whole.map_or(Self { sec: 0, nanosec: 0 }, |sec| Self {
            sec,
            // always below 1e9
            nanosec: time_ns.rem_euclid(1_000_000_000) as u32,
        })
    }
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Header<'a> {
    pub(super) stamp: Time,
    pub(super) frame_id: &'a str,
}

/// A header followed by numbers, one field each.
#[derive(Debug)]
pub(super) struct Flat<'a> {
    pub(super) header: Header<'a>,
    pub(super) values: &'a [f64],
    /// Type of the fields.
    pub(super) precision: Precision,
}

impl Serialize for Flat<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_tuple(1 + self.values.len())?;
        fields.serialize_element(&self.header)?;
        for &value in self.values {
            // The bits of a computed or rounded NaN depend on how the program was optimised.
            match (self.precision, value.is_nan()) {
                (Precision::Single, true) => fields.serialize_element(&f32::NAN)?,
                (Precision::Single, false) => fields.serialize_element(&(value as f32))?,
                (Precision::Double, true) => fields.serialize_element(&f64::NAN)?,
                (Precision::Double, false) => fields.serialize_element(&value)?,
            }
        }
        fields.end()
    }
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Point {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Quaternion {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
    pub(super) w: f64,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Pose {
    pub(super) position: Point,
    pub(super) orientation: Quaternion,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct ColorRgba {
    pub(super) r: f32,
    pub(super) g: f32,
    pub(super) b: f32,
    pub(super) a: f32,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Duration {
    pub(super) sec: i32,
    pub(super) nanosec: u32,
}

#[derive(Debug, Serialize)]
pub(super) struct Marker<'a> {
    pub(super) header: Header<'a>,
    pub(super) ns: &'a str,
    pub(super) id: i32,
    #[serde(rename = "type")]
    pub(super) shape: i32,
    pub(super) action: i32,
    pub(super) pose: Pose,
    pub(super) scale: Point,
    pub(super) color: ColorRgba,
    pub(super) lifetime: Duration,
    pub(super) frame_locked: bool,
    pub(super) points: Vec<Point>,
    pub(super) colors: Vec<ColorRgba>,
    pub(super) texture_resource: &'a str,
    pub(super) texture: CompressedImage<'a>,
    pub(super) uv_coordinates: Vec<[f32; 2]>,
    pub(super) text: String,
    pub(super) mesh_resource: &'a str,
    pub(super) mesh_file: MeshFile<'a>,
    pub(super) mesh_use_embedded_materials: bool,
}

#[derive(Debug, Serialize)]
pub(super) struct CompressedImage<'a> {
    pub(super) header: Header<'a>,
    pub(super) format: &'a str,
    pub(super) data: &'a [u8],
}

#[derive(Debug, Serialize)]
pub(super) struct MeshFile<'a> {
    pub(super) filename: &'a str,
    pub(super) data: &'a [u8],
}

#[derive(Debug, Serialize)]
pub(super) struct MarkerArray<'a> {
    pub(super) markers: Vec<Marker<'a>>,
}

#[derive(Debug, Serialize)]
pub(super) struct DiagnosticArray<'a> {
    pub(super) header: Header<'a>,
    pub(super) status: Vec<DiagnosticStatus<'a>>,
}

#[derive(Debug, Serialize)]
pub(super) struct DiagnosticStatus<'a> {
    pub(super) level: u8,
    pub(super) name: &'a str,
    pub(super) message: String,
    pub(super) hardware_id: &'a str,
    pub(super) values: Vec<KeyValue>,
}

#[derive(Debug, Serialize)]
pub(super) struct KeyValue {
    pub(super) key: String,
    pub(super) value: String,
}
