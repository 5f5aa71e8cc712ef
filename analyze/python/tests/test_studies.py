"""Sensors, comparisons, replays and fleets."""

import shutil
from pathlib import Path

import polars as pl
import pytest

import tipwatch as tw

ROOT = Path(__file__).resolve().parents[3]
DEMO = ROOT / "analyze" / "demo"
DATA = ROOT / "tests" / "data"


def test_sensors_come_on_one_clock(machine, analysis):
    states = pl.DataFrame(tw.read(DEMO / "demo.mcap", machine))
    assert states["time_ns"].to_list() == pl.DataFrame(analysis.samples)["time_ns"].to_list()
    assert states[f"{machine.joints[0]}.position"].null_count() == 0
    assert abs(states["imu.specific_force_z"].mean() - machine.gravity) < 0.5


def test_evaluate_of_the_sensors_has_the_loads_of_the_analysis(machine, analysis):
    states, samples = pl.DataFrame(tw.read(DEMO / "demo.mcap", machine)), pl.DataFrame(analysis.samples)
    joints = lambda what: states.select(f"{name}.{what}" for name in machine.joints).to_numpy()
    imu = lambda what: states.select(f"imu.{what}_{axis}" for axis in "xyz").to_numpy()
    found = machine.evaluate(
        joints("position"), joints("rate"), joints("acceleration"), frame="imu",
        specific_force=imu("specific_force"), angular_velocity=imu("angular_velocity"),
        angular_acceleration=imu("angular_acceleration"),
    )
    for place, name in enumerate(found.columns("otf")):
        assert found.otf[:, place].tolist() == samples[name].to_list()


def test_a_log_does_not_differ_from_itself(machine):
    comparison = tw.compare(DEMO / "demo.mcap", DEMO / "demo.mcap", machine=machine)
    assert comparison["same_log"]


def test_a_fleet_is_a_data_set(tmp_path):
    counts = []
    fleet = tw.screen(
        [DATA / "tiny.mcap", DATA / "tiny_lift.mcap"], machine=DATA / "tiny_lift.toml", out=tmp_path / "fleet",
        progress=lambda done, logs: counts.append((done, logs)),
    )
    logs = pl.scan_parquet(fleet.logs_uri).collect()
    assert logs.height == fleet.totals["logs"] == 2
    assert fleet.page.exists() and counts[-1] == (2, 2)
    assert len(fleet.logs) == 2 and "wheel_lift" in fleet.events.to_polars()["kind"].to_list()
    found = fleet.query("SELECT path, worst_margin FROM logs ORDER BY worst_margin").to_polars()
    assert found["path"][0].endswith("tiny_lift.mcap") and found["worst_margin"][0] < 0
    with pytest.raises(tw.TipwatchError, match="not answered"):
        fleet.query("SELECT nothing FROM logs")
    with pytest.raises(FileNotFoundError):
        tw.screen("nope", machine=DATA / "tiny_lift.toml", out=tmp_path / "none")
    with pytest.raises(tw.TipwatchError, match="--resume|empty folder"):
        tw.screen(DATA / "tiny.mcap", machine=DATA / "tiny_lift.toml", out=tmp_path / "fleet")
    with pytest.raises(tw.TipwatchError, match="either machine or fleet"):
        tw.screen(DATA / "tiny.mcap", out=tmp_path / "other")


def test_another_motion_of_the_suspension(tmp_path):
    replay = tw.whatif(DATA / "second_paper.mcap", DATA / "second_paper.toml", suspension="locked", out=tmp_path)
    assert len(replay.samples) > 100 and replay.findings
    assert (tmp_path / "whatif.parquet").exists()


def test_identify_tells_what_the_program_tells(tmp_path):
    from tipwatch import _tipwatch

    machine = tw.Machine(weighed_machine(tmp_path))
    found = tw.identify(machine, out=tmp_path / "identified.toml")
    assert found.document["parameters"] and str(found) == found.text
    assert found.file == tmp_path / "identified.toml" and "[identified]" in found.file.read_text()
    # several parameters share the added mass, the sum is weighed
    assert tw.Machine(found.file).mass == pytest.approx(machine.mass + 150.0, abs=10.0)
    assert _tipwatch.main(["tipwatch", "identify", "--machine", str(tmp_path / "weighed.toml")]) == 0
    with pytest.raises(tw.TipwatchError, match="expected a positive level"):
        tw.identify(machine, level=-1.0)
    with pytest.raises(tw.TipwatchError, match="nothing to identify from"):
        tw.identify(DATA / "tiny_lift.toml")


def weighed_machine(folder):
    """A machine whose scales read what a chassis of 150 kg more weighs, in four postures."""
    machine = tw.Machine(DATA / "tiny_lift.toml")
    heavier = machine.changed({"base_link.mass": 150.0})
    shutil.copy(DATA / "tiny_lift.urdf", folder)
    tables = ["[uncertainty]\nmass_share = 0.05\n[weighed]\nunit = \"N\"\nsigma = 20.0\n"]
    for lift, tilt, slew in [(-1.3, -1.4, 0.0), (-1.0, -1.8, 0.0), (-1.3, -1.4, 1.5), (-1.0, -1.8, -1.5)]:
        posture = machine.zero_posture
        for name, position in [("lift", lift), ("tilt", tilt), ("slew", slew)]:
            posture[machine.joint(name)] = position
        loads = heavier.evaluate(posture).otf[0]
        wheels = ", ".join(f"{name} = {load:.1f}" for name, load in zip(machine.wheels, loads))
        tables.append(
            f"[[weighed.postures]]\nposture = {{ lift = {lift}, tilt = {tilt}, slew = {slew} }}\nwheels = {{ {wheels} }}\n"
        )
    path = folder / "weighed.toml"
    path.write_text((DATA / "tiny_lift.toml").read_text() + "\n" + "".join(tables))
    return path
