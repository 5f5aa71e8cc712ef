//! Masses and centres of mass of the frames, the carrier and the superstructure.
//!
//! With M the mass of the sum of the axle loads `L_i` at `x_i`, and the bodies of known mass m at c in the posture of
//! the sheet, what remains is exact on the horizontal axes:
//!
//! ```text
//!     sum of unknown masses                  R   = M - sum m
//!     sum of unknown masses times positions  R c = sum L_i (x_i, 0) - sum m c
//! ```
//!
//! How R is shared among several bodies, and its height unless the sheet states it, is a prior.

use nalgebra::{Point3, Vector3};

use crate::body::{Machine, poses, sheet_poses};
use crate::error::SheetError;
use crate::prior::{Assumptions, Balance, SHEET_MASS_SIGMA};
use crate::sheet::Sheet;

/// Least share of the operating mass that frames and superstructure have.
const LEAST_REST: f64 = 0.15;
/// Least share of one of two bodies in their common mass.
const LEAST_SHARE: f64 = 0.15;
/// Standard deviation of a height that was assumed, as a share of the overall height.
const HEIGHT_SIGMA: f64 = 0.06;

pub(super) fn balance(sheet: &Sheet, machine: &mut Machine) -> Result<(), SheetError> {
    let mut assumed = Assumptions::default();
    set_mass(sheet, machine);
    let at = sheet_poses(&machine.links);
    let known: f64 = machine.links.iter().map(|link| link.mass).sum();
    let moment: Vector3<f64> = (machine.links.iter().zip(&at))
        .map(|(link, pose)| (pose * Point3::from(link.com)).coords * link.mass)
        .sum();
    let rest = machine.mass - known;
    if !(rest > LEAST_REST * machine.mass) {
        return Err(sheet.wrong(
            "mass",
            format!(
                "more than {:.0} kg: arm, tool, wheels and axles have {known:.0} kg by themselves, and frame, engine and \
                 cab need at least {:.0} % of the whole",
                known / (1.0 - LEAST_REST),
                100.0 * LEAST_REST
            ),
            format!("{} kg", machine.mass),
            "Check the masses of arm, tool and wheels, and their units",
        ));
    }
    let unknown = machine.unknown.clone();
    let mut places: Vec<Vector3<f64>> = unknown.iter().map(|(_, at)| Vector3::from(*at)).collect();
    // a superstructure turns with its slew in the posture of the sheet
    for ((link, _), place) in unknown.iter().zip(&mut places) {
        let zero = poses(&machine.links, &vec![0.0; at.len()])[*link];
        *place = (at[*link] * zero.inverse() * Point3::from(*place)).coords;
    }
    let target = horizontal(machine);
    let masses = shares(
        sheet,
        rest,
        &places,
        target.map(|x| x * machine.mass - moment.x),
        &mut assumed,
    )?;
    let free = free_bodies(sheet, unknown.len());
    // horizontal: exact where there are axle loads
    if let Some(x) = target {
        let wanted = Vector3::new(x * machine.mass, 0.0, 0.0) - moment;
        shift(&mut places, &masses, &free, 0, wanted.x);
        shift(&mut places, &masses, &free, 1, wanted.y);
    }
    let all: Vec<usize> = (0..unknown.len()).collect();
    match stated_height(sheet, machine)? {
        Some(height) => {
            shift(
                &mut places,
                &masses,
                &all,
                2,
                height * machine.mass - moment.z,
            );
            machine.height_sigma = 0.02 * machine.height;
        }
        None => {
            machine.height_sigma = HEIGHT_SIGMA * machine.height;
            let first: Vector3<f64> = places.iter().zip(&masses).map(|(p, m)| p * *m).sum();
            let height = (first.z + moment.z) / machine.mass;
            assumed.add(
                format!(
                    "height of the centre of mass of the whole machine {height:.2} m, with a standard deviation of {:.2} m",
                    machine.height_sigma
                ),
                format!(
                    "the frame's share of a {} lies at some {:.0} % of the overall height; a tilt angle or a height on the \
                     sheet would tell it",
                    machine.template,
                    100.0 * machine.template.prior().com_height
                ),
            );
        }
    }
    check_places(sheet, machine, &places, &free)?;
    for (((link, _), place), mass) in unknown.iter().zip(&places).zip(&masses) {
        let local = at[*link].inverse() * Point3::from(*place);
        machine.links[*link].mass = *mass;
        machine.links[*link].com = local.coords.into();
    }
    spread(sheet, machine, rest);
    let first: Vector3<f64> = places.iter().zip(&masses).map(|(p, m)| p * *m).sum();
    machine.centre_of_mass = ((first + moment) / machine.mass).into();
    check_stands(sheet, machine)?;
    machine.assumptions.extend(assumed.into_vec());
    Ok(())
}

/// Sets the standard deviations of the bodies that take the remaining mass. The sheet weighs the whole machine; a mass that a
/// prior shares among two bodies is known worse, and so is a position that no axle load determines.
fn spread(sheet: &Sheet, machine: &mut Machine, rest: f64) {
    let is_weighed = machine.stated_axle_loads().is_some();
    let several = machine.unknown.len() > 1;
    let of_whole = SHEET_MASS_SIGMA * machine.mass;
    let height = machine.height_sigma * machine.mass / rest;
    let stated = sheet
        .superstructure
        .as_ref()
        .is_some_and(|upper| upper.mass.is_some())
        || sheet
            .articulation
            .as_ref()
            .is_some_and(|joint| joint.front_mass.is_some());
    for (index, (link, _)) in machine.unknown.clone().into_iter().enumerate() {
        let link = &mut machine.links[link];
        let shared = if several && !stated {
            0.15 * link.mass
        } else {
            0.0
        };
        link.mass_sigma = of_whole.hypot(shared);
        let length = match (index, &sheet.superstructure) {
            (1, Some(upper)) => 2.0 * upper.tail.si,
            _ => link.extent[0],
        };
        let along = if is_weighed && !several { 0.015 } else { 0.05 };
        link.com_sigma = [along * length, 0.01 + 0.01 * link.extent[1], height];
    }
}

/// The axle loads weigh the machine better than the rounded operating mass.
fn set_mass(sheet: &Sheet, machine: &mut Machine) {
    let Some(loads) = machine.stated_axle_loads() else {
        return;
    };
    let sum: f64 = loads.iter().sum();
    if (sum - machine.mass).abs() > 1e-9 * sum {
        machine.notes.push(format!(
            "The axle loads add up to {sum} kg, the sheet's operating mass is {} kg: the axle loads are used.",
            sheet.mass.si
        ));
        machine.mass = sum;
    }
}

/// The place of the centre of mass that the axle loads give (m); `None` without axle loads.
fn horizontal(machine: &Machine) -> Option<f64> {
    let loads: Option<Vec<f64>> = machine.axles.iter().map(|axle| axle.load).collect();
    let loads = loads.filter(|loads| !loads.is_empty())?;
    let sum: f64 = loads.iter().sum();
    let moment: f64 = machine
        .axles
        .iter()
        .zip(&loads)
        .map(|(axle, load)| axle.x * load)
        .sum();
    Some(moment / sum)
}

/// Returns the bodies that take the remaining mass on the horizontal axes.
fn free_bodies(sheet: &Sheet, count: usize) -> Vec<usize> {
    let stated = sheet
        .superstructure
        .as_ref()
        .is_some_and(|s| s.centre_of_mass_behind.is_some());
    match sheet.template.prior().balance {
        Balance::Base => vec![0],
        Balance::Superstructure if stated => vec![0],
        Balance::Superstructure => vec![1],
        Balance::Frames => (0..count).collect(),
    }
}

/// Masses of the unknown bodies.
fn shares(
    sheet: &Sheet,
    rest: f64,
    places: &[Vector3<f64>],
    moment_x: Option<f64>,
    assumed: &mut Assumptions,
) -> Result<Vec<f64>, SheetError> {
    let prior = sheet.template.prior();
    let [least, most] = [LEAST_SHARE, 1.0 - LEAST_SHARE];
    let (stated, share, key, what) = match prior.balance {
        _ if places.len() == 1 => return Ok(vec![rest]),
        Balance::Frames => {
            let joint = sheet.articulation.as_ref();
            let stated = joint.and_then(|j| j.front_mass).map(|m| m.si);
            let is_front_first = !prior.cab_is_rear;
            let stated = stated.map(|m| if is_front_first { m } else { rest - m });
            // m0 x0 + m1 x1 = S with m0 + m1 = R: each frame near the middle of its own length
            let [a, b] = [places[0].x, places[1].x];
            let share = moment_x.map_or(0.5, |s| (s / rest - b) / (a - b));
            (
                stated,
                share,
                "articulation.front_mass",
                "the frame with the cab",
            )
        }
        Balance::Base | Balance::Superstructure => {
            let upper = sheet
                .superstructure
                .as_ref()
                .and_then(|s| s.mass)
                .map(|m| m.si);
            let stated = upper.map(|m| rest - m);
            (
                stated,
                1.0 - prior.superstructure,
                "superstructure.mass",
                "the carrier",
            )
        }
    };
    if let Some(mass) = stated {
        if !(0.05 * rest..=0.95 * rest).contains(&mass) {
            let expected = format!(
                "{:.0} to {:.0} kg of the {rest:.0} kg that arm and wheels leave",
                0.05 * rest,
                0.95 * rest
            );
            return Err(sheet.wrong(key, expected, format!("{:.0} kg", rest - mass), ""));
        }
        return Ok(vec![mass, rest - mass]);
    }
    let share = if share.is_finite() {
        share.clamp(least, most)
    } else {
        0.5
    };
    let why = match prior.balance {
        Balance::Frames => {
            "each frame's centre of mass is then near the middle of its own length; both together are as the axle loads say"
        }
        _ => "the sheet states only the mass of the whole machine",
    };
    assumed.add(
        format!(
            "mass of {what} {:.0} kg, of the other part {:.0} kg",
            share * rest,
            (1.0 - share) * rest
        ),
        why,
    );
    Ok(vec![share * rest, (1.0 - share) * rest])
}

/// Shifts some of the bodies alike along an axis until all of them have this first moment (kg m).
fn shift(places: &mut [Vector3<f64>], masses: &[f64], free: &[usize], axis: usize, wanted: f64) {
    let moment: f64 = places
        .iter()
        .zip(masses)
        .map(|(place, mass)| place[axis] * mass)
        .sum();
    let mass: f64 = free.iter().map(|&body| masses[body]).sum();
    for &body in free {
        places[body][axis] += (wanted - moment) / mass;
    }
}

/// Returns the height of the centre of mass that the sheet states (m).
fn stated_height(sheet: &Sheet, machine: &Machine) -> Result<Option<f64>, SheetError> {
    if let Some(height) = sheet.centre_of_mass_height {
        return Ok(Some(height.si));
    }
    let Some(angle) = sheet.tilt_angle.map(|angle| angle.si) else {
        return Ok(None);
    };
    let pivots = sheet
        .axles
        .iter()
        .any(|axle| axle.pendulum.is_some() || axle.track.is_none());
    let rolls = sheet
        .articulation
        .as_ref()
        .is_some_and(|joint| joint.roll.is_some());
    let bogies = sheet.axles.iter().any(|axle| axle.bogie.is_some());
    if pivots || rolls || bogies {
        return Err(sheet.wrong(
            "tilt_angle",
            "centre_of_mass_height for a machine with a pivot between its wheels",
            "tilt_angle",
            "Such a machine tips about an edge through the pivot; the angle alone does not tell the height",
        ));
    }
    // tan(angle) = half track / height
    let half = match &sheet.tracks {
        Some(tracks) => 0.5 * (tracks.gauge.si + tracks.shoe.si),
        None => {
            let tracks = sheet
                .axles
                .iter()
                .filter_map(|axle| axle.track)
                .map(|t| t.si);
            0.5 * tracks.fold(f64::INFINITY, f64::min)
        }
    };
    let height = half / angle.tan();
    if height > machine.height {
        return Err(sheet.wrong(
            "tilt_angle",
            format!(
                "a centre of mass below the overall height of {:.2} m",
                machine.height
            ),
            format!(
                "{:.1} degrees, a height of {height:.2} m",
                angle.to_degrees()
            ),
            "Check that the angle is against the horizontal, and the track",
        ));
    }
    Ok(Some(height))
}

/// Checks that the bodies with the remaining mass lie within the machine.
fn check_places(
    sheet: &Sheet,
    machine: &Machine,
    places: &[Vector3<f64>],
    free: &[usize],
) -> Result<(), SheetError> {
    let lengths = machine.axles.iter().map(|axle| axle.x.abs());
    let half = sheet
        .length
        .map_or(0.0, |l| l.si / 2.0)
        .max(1.5 * lengths.fold(0.0, f64::max));
    for &body in free {
        let place = places[body];
        let name = &machine.links[machine.unknown[body].0].name;
        let tail = sheet.superstructure.as_ref().map(|s| s.tail.si);
        let (middle, most, why) = match (body, tail, machine.slew_x) {
            (1, Some(tail), Some(slew)) => (slew, tail, "its tail swing radius"),
            _ => (0.0, half.max(0.3), "the machine"),
        };
        let away = (place.x - middle).hypot(place.y);
        if !(away <= most) {
            return Err(sheet.wrong(
                "axles.load",
                format!(
                    "loads that leave a centre of mass of {name} within {why}, {most:.2} m from x = {middle:.2} m (x = 0 \
                     in the middle of the axles)"
                ),
                format!("one at x = {:.2} m, y = {:.2} m", place.x, place.y),
                "Check the order of the axle loads (front first), the mass and posture of the arm, and whether the loads \
                 are without payload",
            ));
        }
        if !(0.0 < place.z && place.z < machine.height) {
            let expected = format!(
                "a centre of mass of {name} between the ground and {:.2} m",
                machine.height
            );
            let found = format!("{:.2} m", place.z);
            let key = if sheet.tilt_angle.is_some() {
                "tilt_angle"
            } else {
                "centre_of_mass_height"
            };
            return Err(sheet.wrong(
                key,
                expected,
                found,
                "Check the height against mass and place of the arm",
            ));
        }
    }
    Ok(())
}

/// The machine stands in the posture of the sheet.
fn check_stands(sheet: &Sheet, machine: &Machine) -> Result<(), SheetError> {
    let [x, ..] = machine.centre_of_mass;
    let (front, rear) = match &sheet.tracks {
        Some(tracks) => (tracks.length.si / 2.0, -tracks.length.si / 2.0),
        None => {
            let axles = machine.axles.iter().map(|axle| axle.x);
            (
                axles.clone().fold(f64::NEG_INFINITY, f64::max),
                axles.fold(f64::INFINITY, f64::min),
            )
        }
    };
    if rear < x && x < front {
        return Ok(());
    }
    Err(sheet.wrong(
        "superstructure",
        format!("a machine that stands: its centre of mass between x = {rear:.2} m and {front:.2} m"),
        format!("{x:.2} m, in the posture of the sheet"),
        "State superstructure.mass and centre_of_mass_behind, or axle loads; check the arm's mass and posture (at)",
    ))
}
