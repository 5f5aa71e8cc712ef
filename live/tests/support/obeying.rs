//! Simulated rods that obey the commands of the control.

use tipwatch_live::wire::topics::{Wire, WireSample};
use tipwatch_mechanics::Machine;
use tipwatch_suspension::hydraulics::{Actuator, ActuatorInput, ActuatorState, Valve};

/// The suspension of a recording, its rods moved by the commands through valves, oil and cylinders.
pub struct Obeying {
    machine: Machine,
    actuator: Actuator,
    pub cylinders: [ActuatorState; 2],
    valves: [Valve; 2],
    /// Index of each rod in the samples of the joints.
    places: [usize; 2],
    before_ns: Option<i64>,
}

/// Load of each cylinder (N), and the mass that moves with it (kg).
const LOAD: ActuatorInput = ActuatorInput::Load {
    force: 1e4,
    mass: 1e4,
};

impl Obeying {
    pub fn new(machine: &Machine, joints: &[String]) -> Self {
        let suspension = machine.suspension().unwrap();
        let actuator = Actuator {
            parameters: suspension.hydraulics,
        };
        let ActuatorInput::Load { force, .. } = LOAD else {
            unreachable!("a load");
        };
        let place = |rod: &str| joints.iter().position(|name| name == rod).unwrap();
        Self {
            machine: machine.clone(),
            // near the stop, where a swinging arm leaves them something to do
            cylinders: [actuator.at_rest(0.02, force); 2],
            actuator,
            valves: [Valve::closed(); 2],
            places: ["suspension_right", "suspension_left"].map(place),
            before_ns: None,
        }
    }

    /// Moves the rods with these openings until this sample, and writes them into it.
    pub fn obey(&mut self, openings: &[f64; 2], sample: &mut WireSample) {
        let before_ns = self.before_ns.replace(sample.time_ns);
        let seconds = before_ns.map_or(0.0, |before| (sample.time_ns - before) as f64 * 1e-9);
        // the command is the opening itself
        let mut direct = self.actuator.parameters;
        direct.gain = 1.0;
        let [least, _] = self.machine.suspension().unwrap().stroke;
        let joints = sample.value_count as usize / 2;
        for (k, place) in self.places.into_iter().enumerate() {
            self.valves[k] = self.valves[k].follow(&direct, openings[k], 0.0, seconds);
            let (valve, before) = (self.valves[k], self.cylinders[k]);
            self.cylinders[k] = self.actuator.step(&before, valve, LOAD, seconds).unwrap();
            sample.values[place] = least + self.cylinders[k].extension;
            sample.values[joints + place] = self.cylinders[k].velocity;
        }
        sample.seal(sample.head());
    }
}
