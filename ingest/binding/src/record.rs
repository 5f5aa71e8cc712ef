//! Reads the samples of a machine's sensors, on one clock.

use tipwatch_ingest::{Log, Losses, SensorRecording, SensorRequest, record_sensors};

use crate::bound_log::BoundLog;

impl BoundLog {
    /// All samples of the sensors, in the order of [`BoundLog::all`], on the clock of the log,
    /// with the clock offsets of the machine file applied.
    ///
    /// `progress` is called from time to time with the number of bytes read so far.
    ///
    /// # Errors
    /// The log cannot be read.
    pub fn record(
        &self,
        log: &Log,
        progress: &mut dyn FnMut(u64),
    ) -> Result<(Vec<SensorRecording>, Losses), tipwatch_ingest::Error> {
        let requests: Vec<SensorRequest> = self.all().map(|b| b.request.clone()).collect();
        let (mut recordings, losses) = record_sensors(log, &requests, progress)?;
        for recording in &mut recordings {
            if let Some(&offset_s) = self
                .clock_offsets_s
                .get(&log.topic(recording.reading.topic)?.name)
            {
                recording.shift(offset_s);
            }
        }
        Ok((recordings, losses))
    }
}
