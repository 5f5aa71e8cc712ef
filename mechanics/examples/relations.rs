//! The evidence against sound sensors in recorded samples: `relations MACHINE.toml MACHINE.urdf SAMPLES...`.
//!
//! A file of samples holds numbers of 64 bits: the number of joints in the stream, their indices in the machine, then for each
//! sample its sensor (0 joints, 1 IMU, 2 odometry), its stamp (ns) and its values. Printed is the largest evidence of each
//! alternative that grew beyond a tenth of the threshold, and when it first exceeded it.

use std::collections::BTreeMap;

use tipwatch_mechanics::estimation::plausibility::Plausibility;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::state::{JointStream, Sample, Sensor, Sensors};

#[expect(clippy::print_stdout, reason = "what one runs it for")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [toml, urdf, samples @ ..] = &args[..] else {
        return Err("expected MACHINE.toml MACHINE.urdf SAMPLES...".into());
    };
    let spec = MachineSpec::from_toml(&std::fs::read_to_string(toml)?, toml)?;
    let machine = spec.check(&std::fs::read_to_string(urdf)?, urdf, LogFacts::default())?;
    let names: Vec<&str> = (machine.joints().iter().map(|it| it.name.as_str())).collect();
    println!("joints {}", names.join(" "));
    for path in samples {
        let bytes = std::fs::read(path)?;
        let words = bytes.chunks_exact(8);
        let mut words = words.map(|word| f64::from_le_bytes(word.try_into().unwrap_or_default()));
        let mut next = || words.next();
        let count = next().unwrap_or(0.0) as usize;
        let joints: Vec<usize> = (0..count)
            .filter_map(|_| next())
            .map(|n| n as usize)
            .collect();
        let sensors = Sensors {
            joints: vec![JointStream { joints }],
            imu: true,
            odometry: true,
            ..Sensors::default()
        };
        let mut checks = Plausibility::new(&machine, &sensors);
        let mut largest: BTreeMap<String, (f64, Option<f64>)> = BTreeMap::new();
        let mut threshold = f64::NAN;
        let mut looked_ns = 0;
        while let (Some(sensor), Some(stamp)) = (next(), next()) {
            let (sensor, length) = match sensor as i64 {
                0 => (Sensor::Joints(0), 2 * count),
                1 => (Sensor::Imu, 10),
                _ => (Sensor::Odometry, 10),
            };
            let values: Vec<f64> = (0..length).filter_map(|_| next()).collect();
            let stamp_ns = stamp as i64;
            let sample = Sample::new(sensor, stamp_ns, &values);
            // A stamp that is not later is not used.
            let _ = checks.step(&sample);
            if stamp_ns - looked_ns < 250_000_000 {
                continue;
            }
            looked_ns = stamp_ns;
            let (evidence, limit) = checks.evidence();
            threshold = limit;
            for (part, explanation, value) in evidence {
                let name = format!("{part:?} {explanation:?}");
                let it = largest.entry(name).or_insert((0.0, None));
                it.0 = it.0.max(value);
                if value > limit && it.1.is_none() {
                    it.1 = Some(stamp_ns as f64 * 1e-9);
                }
            }
        }
        for (name, (value, first_s)) in largest {
            if value > 0.1 * threshold {
                let first = first_s.map_or(String::new(), |s| format!("{s:.2}"));
                println!("{path}\t{name}\t{value:.2}\t{first}");
            }
        }
        println!("{path}\tdone\t{threshold:.2}\t");
    }
    Ok(())
}
