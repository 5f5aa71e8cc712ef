//! Samples of whole logs as columns, on one clock.

mod field_recording;
mod merged_parts;
mod record_sensors;
mod sensor_columns;
mod sensor_recording;

pub use self::{
    field_recording::{FieldRecording, FieldRequest, record_fields},
    record_sensors::record_sensors,
    sensor_recording::{SensorRecording, SensorRequest, arrival_order},
};
