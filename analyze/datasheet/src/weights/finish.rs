//! Quantities that follow from the masses: inertias, tyre stiffness, and the loads with the rated load.

use nalgebra::Point3;

use crate::body::{Machine, Solid, sheet_poses};
use crate::error::SheetError;
use crate::prior::{TRACK_DEFLECTION, TYRE_DEFLECTION};
use crate::sheet::Sheet;

/// Gravity (m/s^2), for stiffness from a deflection.
const GRAVITY: f64 = 9.806_65;

/// Inertias of homogeneous boxes and of round wheels: valid for any dimensions.
///
/// ```text
///     box      I_xx = m (b^2 + c^2) / 12, and so on
///     wheel    I_yy = m r^2 / 2, I_xx = I_zz = m (3 r^2 + w^2) / 12
/// ```
pub(super) fn inertias(machine: &mut Machine) {
    for link in &mut machine.links {
        let m = link.mass;
        let round = link.shapes.iter().find_map(|shape| match shape.solid {
            Solid::CylinderY { radius, length } => Some((radius, length)),
            Solid::Box(_) => None,
        });
        link.inertia = match round {
            Some((r, w)) => {
                let across = m * (3.0 * r * r + w * w) / 12.0;
                [across, m * r * r / 2.0, across]
            }
            None => {
                // thin parts keep an inertia about every axis
                let longest = link.extent.iter().copied().fold(0.0, f64::max);
                let [a, b, c] = link.extent.map(|side| side.max(0.02 * longest).powi(2));
                [b + c, a + c, a + b].map(|sum| m * sum / 12.0)
            }
        };
    }
}

/// Tyres that all deflect alike under the loads of the sheet: then springs of these stiffnesses carry exactly these
/// loads, on any number of axles.
pub(super) fn stiffness(sheet: &Sheet, machine: &mut Machine) {
    let count = machine.wheels.len() as f64;
    let mean = machine.mass * GRAVITY / count;
    if machine.has_tracks {
        let k = sheet
            .tyre_stiffness
            .map_or(mean / TRACK_DEFLECTION, |k| k.si);
        machine
            .wheels
            .iter_mut()
            .for_each(|wheel| wheel.stiffness = k);
        return;
    }
    let loads = axle_loads(machine);
    let radius = machine.wheels.iter().map(|w| w.radius).sum::<f64>() / count;
    let deflection = match sheet.tyre_stiffness {
        Some(k) => mean / k.si,
        None => TYRE_DEFLECTION * radius,
    };
    let per_axle: Vec<f64> = (0..loads.len())
        .map(|axle| machine.wheels.iter().filter(|w| w.axle == axle).count() as f64)
        .collect();
    for wheel in &mut machine.wheels {
        wheel.stiffness = loads[wheel.axle] * GRAVITY / per_axle[wheel.axle] / deflection;
    }
    let (what, why) = match sheet.tyre_stiffness {
        None => (
            format!(
                "tyres deflect by {:.0} mm under the loads of the sheet",
                1000.0 * deflection
            ),
            "tyres of such machines do so by some 4 % of their radius, within a factor of two",
        ),
        Some(_) => (
            "the stiffness of a tyre is in proportion to its load on the sheet".into(),
            "all axles then sink alike, as they do where pressures and suspensions follow the load",
        ),
    };
    machine.assumptions.push(crate::prior::Assumption {
        what,
        why: why.into(),
    });
}

/// Stated or assumed axle loads, else those of two axles from the centre of mass (kg).
fn axle_loads(machine: &Machine) -> Vec<f64> {
    let stated: Option<Vec<f64>> = machine.axles.iter().map(|axle| axle.load).collect();
    stated.unwrap_or_else(|| match &machine.axles[..] {
        [front, rear] => {
            let share = (machine.centre_of_mass[0] - rear.x) / (front.x - rear.x);
            vec![share * machine.mass, (1.0 - share) * machine.mass]
        }
        axles => vec![machine.mass / axles.len() as f64; axles.len()],
    })
}

/// Compares the sheet's axle loads with the rated load; refuses a machine that tips forward under it.
pub(super) fn laden(sheet: &Sheet, machine: &mut Machine) -> Result<(), SheetError> {
    /// Largest difference to a laden axle load on the sheet, as a share of the rated load.
    const LADEN: f64 = 0.15;
    let laden: Vec<Option<f64>> = sheet.axles.iter().map(|a| a.laden.map(|m| m.si)).collect();
    let (Some((load, centre)), [front, rear]) = (machine.rated_load, &machine.axles[..]) else {
        return match laden.iter().any(Option::is_some) {
            true => Err(sheet.wrong(
                "axles.laden",
                "loads of two axles beside [rated_load]",
                "laden without them",
                "",
            )),
            false => Ok(()),
        };
    };
    if laden.iter().all(Option::is_none) {
        return Ok(());
    }
    let tool = machine.tool.as_deref().and_then(|tool| machine.link(tool));
    let Some(tool) = tool else {
        return Err(sheet.wrong("arm.tool", "a tool that carries the rated load", "none", ""));
    };
    let at = sheet_poses(&machine.links)[tool] * Point3::new(centre, 0.0, 0.0);
    let unladen = machine.centre_of_mass[0] * machine.mass;
    let total = machine.mass + load;
    let x = (unladen + load * at.x) / total;
    let share = (x - rear.x) / (front.x - rear.x);
    let model = [share * total, (1.0 - share) * total];
    for (index, (stated, model)) in laden.iter().zip(model).enumerate() {
        let Some(stated) = stated else { continue };
        if (stated - model).abs() > LADEN * load {
            return Err(sheet.wrong(
                format!("axles[{index}].laden"),
                format!("about {model:.0} kg, which follows from the rated load {:.3} m ahead of the front axle", at.x - front.x),
                format!("{stated} kg"),
                "Check the distance of the fork's face or the tool (arm.ahead) and the load's centre",
            ));
        }
        machine.notes.push(format!(
            "Axle {} with the rated load: {model:.0} kg by the model, {stated:.0} kg on the sheet.",
            index + 1
        ));
    }
    Ok(())
}
