//! Samples of whole logs as columns, on one clock.

mod decoder;
mod field_recording;
mod merged_parts;
mod part;
mod pass;
mod record_sensors;
mod sample_stream;
mod sensor_blocks;
mod sensor_reading;
mod sensor_recording;
mod whole_columns;

pub use self::{
    field_recording::{FieldRequest, record_fields},
    record_sensors::record_sensors,
    sample_stream::{SampleStream, StreamClock, StreamRefusals},
    sensor_blocks::{SensorBlock, read_sensor_blocks},
    sensor_reading::SensorReading,
    sensor_recording::{SensorRecording, SensorRequest, arrival_order},
};
