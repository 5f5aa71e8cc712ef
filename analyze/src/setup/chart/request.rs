//! Request for a chart: the joints that are swept, on which supports, and from where reach counts.

use std::str::FromStr;

use anyhow::{Context, Error, Result, bail};
use tipwatch_mechanics::machine::{Machine, SupportId, SupportKind, Supports};

/// Positions of a joint whose sweep states no number.
const DEFAULT_POSITIONS: usize = 9;
/// Most positions of one joint.
const MOST_POSITIONS: usize = 1000;
/// Most postures of a chart.
pub(super) const MOST_POSTURES: usize = 100_000;

/// Request for a chart.
#[derive(Debug, Clone, clap::Args)]
pub struct Request {
    /// Positions of a joint: JOINT=FROM:TO:NUMBER in rad or m, or in degrees, such as lift=-20deg:65deg:9; repeat it for
    /// other joints. Without it, every joint of the arm goes from limit to limit. A joint that is not swept stays as in the
    /// reference posture.
    #[arg(long = "sweep", value_name = "JOINT=FROM:TO:NUMBER")]
    pub sweeps: Vec<Sweep>,
    /// What the machine stands on: wheels, outriggers, or names of supports. Without it, its outriggers if it has some.
    #[arg(long, value_name = "SUPPORT", value_delimiter = ',')]
    pub on: Vec<String>,
    /// From where reach counts: tyres (the front of the front tyres), base (the origin of the base frame), or a joint's axis.
    #[arg(long, value_name = "PLACE", default_value = "tyres")]
    pub reach_from: ReachFrom,
    /// The link on which the load hangs; without it, the tool.
    #[arg(long)]
    pub link: Option<String>,
    /// Loads (kg) whose worst wheel is shown.
    #[arg(long = "payload", value_name = "KG", value_delimiter = ',')]
    pub payloads_kg: Vec<f64>,
    /// Limit of a wheel as a share of its static load; without it, min_load or min_load_share of the machine file.
    #[arg(long, value_name = "SHARE")]
    pub limit_share: Option<f64>,
    /// What the chart states of the tipping load: makers state a share, such as 0.75.
    #[arg(long, value_name = "SHARE", default_value_t = 1.0)]
    pub share: f64,
}

/// Positions of a joint: `NAME=FROM:TO:NUMBER`, in rad or m, or in degrees with `deg`.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Name of the joint.
    pub joint: String,
    /// Its positions (rad or m).
    pub positions: Vec<f64>,
}

/// Origin of the reach.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ReachFrom {
    /// The front of the front tyres, as the sheets of telehandlers and loaders have it.
    Tyres,
    /// The origin of the base frame.
    Base,
    /// The axis of a joint, as charts of cranes have it.
    Joint(String),
}

impl FromStr for ReachFrom {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Ok(match text {
            "tyres" => Self::Tyres,
            "base" => Self::Base,
            joint => Self::Joint(joint.into()),
        })
    }
}

impl Sweep {
    /// Returns a sweep of a joint over `number` evenly spaced positions.
    fn even(joint: &str, [from, to]: [f64; 2], number: usize) -> Self {
        let step = |k: usize| match number {
            1 => from,
            _ => from + (to - from) * k as f64 / (number - 1) as f64,
        };
        Self {
            joint: joint.into(),
            positions: (0..number).map(step).collect(),
        }
    }

    /// The joints of the arm that have limits, from one to the other; those that carry or spin wheels are left out.
    pub(super) fn of_arm(machine: &Machine) -> Vec<Self> {
        let joints = machine.joints().iter().enumerate();
        let of_arm = joints.filter(|(index, joint)| {
            joint.spins_wheel.is_none()
                && !machine.joint_carries_support(*index)
                && joint.constant.is_none()
        });
        let with_limits = of_arm.filter_map(|(_, joint)| {
            let limits = joint.limits.filter(|limits| limits[0] < limits[1])?;
            Some(Self::even(&joint.name, limits, DEFAULT_POSITIONS))
        });
        with_limits.collect()
    }
}

impl FromStr for Sweep {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        const EXPECTED: &str = "expected JOINT=FROM:TO or JOINT=FROM:TO:NUMBER, such as lift=-20deg:65deg:9 or extension=0:3.2";
        let (joint, range) = text.split_once('=').context(EXPECTED)?;
        let parts: Vec<&str> = range.split(':').collect();
        let (from, to, number) = match parts[..] {
            [only] => (only, only, "1"),
            [from, to] => (from, to, ""),
            [from, to, number] => (from, to, number),
            _ => bail!("{EXPECTED}, found \"{text}\""),
        };
        let found = || format!("{EXPECTED}, found \"{text}\"");
        let number = match number {
            "" => DEFAULT_POSITIONS,
            number => number.parse().with_context(found)?,
        };
        if joint.is_empty() || !(1..=MOST_POSITIONS).contains(&number) {
            bail!("{EXPECTED} with 1 to {MOST_POSITIONS} positions, found \"{text}\"");
        }
        let [from, to] = [from, to].map(position);
        let limits = [from.with_context(found)?, to.with_context(found)?];
        Ok(Self::even(joint, limits, number))
    }
}

/// A position: "0.5", "30deg".
fn position(text: &str) -> Option<f64> {
    let (number, factor) = match text.strip_suffix("deg") {
        Some(degrees) => (degrees, 1.0_f64.to_radians()),
        None => (text, 1.0),
    };
    let value: f64 = number.trim().parse().ok()?;
    (value * factor).is_finite().then_some(value * factor)
}

/// The machine on these supports; without any, on its feet if it has some, else on its wheels.
pub(super) fn standing(machine: &Machine, names: &[String]) -> Result<Machine> {
    let supports = machine.supports();
    let mut on = Vec::new();
    for name in names {
        let named = match name.as_str() {
            "wheels" => of_kind(supports, SupportKind::Wheel),
            "outriggers" => of_kind(supports, SupportKind::Foot),
            name => supports.named(name),
        };
        if named.is_empty() {
            let known: Vec<&str> = supports
                .ids()
                .map(|id| supports.support(id).name.as_str())
                .collect();
            bail!(
                "--on: expected wheels, outriggers or names of supports ({}), found \"{name}\"",
                known.join(", ")
            );
        }
        on.extend(named);
    }
    if on.is_empty() {
        on = of_kind(supports, SupportKind::Foot);
        if on.len() < 3 {
            on = match supports.at_rest() {
                some if some.len() >= 3 => some,
                _ => supports.ids().collect(),
            };
        }
    }
    let mut machine = machine
        .standing_on(&on)
        .with_context(|| format!("the machine on {}", supports.names(&on)))?;
    // the loads of others are static ones, and without these the wheels have no limit
    let _ = machine.set_reference_loads();
    Ok(machine)
}

fn of_kind(supports: &Supports, kind: SupportKind) -> Vec<SupportId> {
    let all = supports.ids();
    all.filter(|id| supports.support(*id).kind == kind)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_is_read_in_radians_metres_or_degrees() {
        let sweep: Sweep = "lift=-90deg:90deg:3".parse().unwrap();
        let half = std::f64::consts::FRAC_PI_2;
        assert_eq!(sweep.positions, [-half, 0.0, half]);
        let fixed: Sweep = "boom=1.5".parse().unwrap();
        assert_eq!(fixed.positions, [1.5]);
        for wrong in [
            "lift",
            "=0:1",
            "lift=a:1",
            "lift=0:1:0",
            "lift=0:1:2:3",
            "lift=0:inf",
        ] {
            let error = format!("{:#}", wrong.parse::<Sweep>().unwrap_err());
            assert!(error.contains("expected JOINT=FROM:TO"), "{wrong}: {error}");
        }
    }
}
