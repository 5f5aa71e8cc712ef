"""Sensors, comparisons, replays and fleets."""

import inspect
import pickle
import re
import shutil
from concurrent.futures import ThreadPoolExecutor
from datetime import date, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
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


def test_evaluate_of_the_sensors_has_the_loads_of_the_analysis(machine):
    analysis = tw.analyze(DEMO / "demo.mcap", machine, precision=64)
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
    # pandas takes lists of text in their older type only
    assert [list(names) for names in pd.read_parquet(Path(fleet.logs_uri).parent)["findings"]] == logs["findings"].to_list()
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


def test_a_fleet_has_the_language_that_is_asked_for(tmp_path):
    asked = dict(machine=DATA / "tiny_lift.toml", reports="all")
    for lang, written in [("de", "de"), ("en", "en"), (None, "en")]:
        fleet = tw.screen(DATA / "tiny_lift.mcap", out=tmp_path / str(lang), lang=lang, **asked)
        reports = list((tmp_path / str(lang) / "reports").rglob("*.html"))
        assert reports
        for page in [fleet.page, *reports]:
            assert f'<html lang="{written}"' in page.read_text()
    parted = tw.screen(DATA / "tiny_lift.mcap", records=tmp_path / "records", lang="de", **asked)
    gathered = tw.screen(gather=tmp_path / "records", out=tmp_path / "gathered", lang="de")
    assert parted.page is None and '<html lang="de"' in gathered.page.read_text()


def test_the_tasks_of_an_engine_speak_the_language_of_the_screening(tmp_path):
    from tipwatch import _tipwatch

    task = _tipwatch.FleetTask(tmp_path / "fleet", machine=DATA / "tiny_lift.toml", reports="all", lang="de")
    for log, _ in task.logs([DATA / "tiny_lift.mcap"]):
        assert task.run(log) is None
    fleet = task.gather(tmp_path / "fleet", None, None, None, False)
    for page in [fleet.page, *(tmp_path / "fleet" / "reports").rglob("*.html")]:
        assert '<html lang="de"' in page.read_text()


def test_calls_at_once_have_their_own_languages(tmp_path):
    def language(lang, place):
        analysis = tw.analyze(DATA / "tiny_lift.mcap", DATA / "tiny_lift.toml", out=tmp_path / str(place), lang=lang)
        page = (tmp_path / str(place) / "report.html").read_text()
        return analysis.summary["provenance"].get("language", "en"), page.split('<html lang="')[1][:2]

    asked = ["de", "en", None, "de", "en", "de"]
    with ThreadPoolExecutor(len(asked)) as pool:
        found = list(pool.map(language, asked, range(len(asked))))
    assert found == [(lang or "en",) * 2 for lang in asked]


def test_a_comparison_has_a_language(machine):
    with pytest.raises(ValueError, match="expected lang en or de"):
        tw.compare(DEMO / "demo.mcap", DEMO / "demo.mcap", machine=machine, lang="fr")
    asked = DATA / "tiny.mcap", DATA / "tiny_lift.mcap"
    notes = [tw.compare(*asked, machine=DATA / "tiny_lift.toml", lang=lang)["series_note"] for lang in ("en", "de")]
    assert all(notes) and notes[0] != notes[1]


def test_days_and_times_of_a_fleet_have_their_types(tmp_path):
    fleet = tw.screen(DATA / "tiny.mcap", machine=DATA / "tiny_lift.toml", out=tmp_path / "fleet", reports="none")
    written = pl.scan_parquet(fleet.logs_uri).collect()
    for name, found in zip(written.columns, fleet.logs.to_polars()):
        assert found.dtype == written[name].dtype, name
    assert fleet.logs.to_polars().equals(written.sort("path"))
    day = fleet.logs["day"]
    assert day.to_list() == written["day"].to_list() and isinstance(day[0], date)
    assert np.asarray(day).dtype == "datetime64[D]" and f"<td>{day[0]}</td>" in day._repr_html_()
    found = fleet.query(
        "SELECT max(day) - min(day) AS span, CAST(start_ns / 1000 AS TIMESTAMP) AS start FROM logs GROUP BY start_ns"
    )
    assert found["span"].to_list() == [timedelta(0)]
    (start,), (start_ns,) = found["start"].to_list(), written["start_ns"]
    # the division is one of floating point
    assert abs(start - datetime(1970, 1, 1) - timedelta(microseconds=start_ns // 1000)) <= timedelta(microseconds=1)
    assert np.asarray(found["start"])[0] == np.datetime64(start)
    assert found.to_polars().schema == {"span": pl.Duration("us"), "start": pl.Datetime("us")}


def test_a_fleet_tells_its_notes_and_is_opened_again(tmp_path):
    (tmp_path / "logs").mkdir()
    shutil.copy(DATA / "tiny.mcap", tmp_path / "logs")
    (tmp_path / "logs" / "weather.csv").write_text("time,wind\n0,1\n")
    asked = dict(machine=DATA / "tiny_lift.toml", out=tmp_path / "fleet", reports="none")
    with pytest.warns(UserWarning, match="tables or packed texts in folders that were left out.*: 1, the first"):
        fleet = tw.screen(tmp_path / "logs", **asked)
    assert len(fleet.notes) == 1 and "1 log, 0 failed" in repr(fleet) and fleet.notes[0] in fleet._repr_html_()
    assert pickle.loads(pickle.dumps(fleet)).notes == fleet.notes
    shutil.copy(DATA / "tiny_lift.mcap", tmp_path / "logs")
    (tmp_path / "logs" / "tiny.mcap").unlink()
    with pytest.warns(UserWarning) as told:
        fleet = tw.screen(tmp_path / "logs", resume=True, **asked)
    assert [str(warning.message) for warning in told] == fleet.notes
    assert "(prune=True removes them)" in fleet.notes[1]
    again = tw.Fleet(tmp_path / "fleet")
    assert again.out == fleet.out == tmp_path / "fleet"
    compared = again.comparisons.to_polars()
    assert compared.columns == again.query("SELECT * FROM comparisons").columns and "verdict" in compared.columns
    assert again.totals == fleet.totals and again.page == fleet.page and again.notes == []
    assert again.logs.to_polars().equals(fleet.logs.to_polars())
    assert pickle.loads(pickle.dumps(again)).totals == fleet.totals
    assert again.undecided == fleet.undecided == []
    with pytest.warns(UserWarning):
        fleet = tw.screen(tmp_path / "logs", resume=True, min_valid=1.0, **asked)
    again = tw.Fleet(tmp_path / "fleet")
    assert again.undecided == fleet.undecided and len(again.undecided) == 2
    with pytest.raises(FileNotFoundError, match="expected a complete data set"):
        tw.Fleet(tmp_path)


def test_the_tasks_of_an_engine_tell_notes_once(tmp_path):
    from tipwatch import _tipwatch

    (tmp_path / "logs").mkdir()
    shutil.copy(DATA / "tiny.mcap", tmp_path / "logs")
    (tmp_path / "logs" / "weather.csv").write_text("time,wind\n0,1\n")
    task = _tipwatch.FleetTask(tmp_path / "fleet", machine=DATA / "tiny_lift.toml", reports="none")
    for _ in range(2):
        ((log, _),) = task.logs([tmp_path / "logs"])
        assert task.run(log) is None
        with pytest.warns(UserWarning, match="left out"):
            fleet = task.gather(tmp_path / "fleet", None, None, None, False)
        assert len(fleet.notes) == 1


def test_the_tasks_of_an_engine_search_as_threads_do(tmp_path):
    from tipwatch import _tipwatch

    (tmp_path / "logs").mkdir()
    for name in ("tiny.mcap", "tiny_lift.mcap"):
        shutil.copy(DATA / name, tmp_path / "logs")
    task = _tipwatch.FleetTask(tmp_path / "fleet", machine=DATA / "tiny_lift.toml", reports="none")
    with pytest.raises(FileNotFoundError, match="expected folders or logs, found nothing there"):
        task.logs([tmp_path / "nope"])
    for log, _ in task.logs([tmp_path / "logs"]):
        assert task.run(log) is None
    assert task.gather(tmp_path / "fleet", None, None, None, False).totals["logs"] == 2
    (tmp_path / "logs" / "tiny.mcap").unlink()
    task.logs([tmp_path / "logs"])
    # it was in a folder that is named: that it is gone is known
    with pytest.warns(UserWarning, match="logs that no longer exist and stay in the data set"):
        fleet = task.gather(tmp_path / "fleet", None, None, None, False)
    assert len(fleet.notes) == 1 and fleet.totals["logs"] == 2


def test_logs_are_named_by_anything_that_has_paths(tmp_path):
    def totals(logs, name):
        return tw.screen(logs, machine=DATA / "tiny_lift.toml", out=tmp_path / name, reports="none").totals["logs"]

    assert totals((DATA / name for name in ("tiny.mcap", "tiny_lift.mcap")), "generator") == 2
    assert totals({str(DATA / "tiny.mcap")}, "set") == 1
    for wrong, found in [(42, "int"), (None, "NoneType")]:
        with pytest.raises(TypeError, match=f"expected a path or an iterable of paths, found {found}"):
            totals(wrong, "wrong")
    with pytest.raises(TypeError, match="expected a word or an iterable of words, found int"):
        tw.screen(DATA / "tiny.mcap", machine=DATA / "tiny_lift.toml", out=tmp_path / "wrong", fail_on=3)
    for wrong in (Path("s3://bucket/logs"), [Path("s3://bucket/logs")]):
        with pytest.raises(ValueError, match="^expected s3://… as text, found a path object"):
            totals(wrong, "wrong")
    assert not (tmp_path / "wrong").exists()


def test_the_parts_of_a_fleet_are_gathered(tmp_path):
    asked = dict(machine=DATA / "tiny_lift.toml", records=tmp_path / "records")
    logs = [DATA / "tiny.mcap", DATA / "tiny_lift.mcap"]
    for part in ["1/2", "2/2"]:
        fleet = tw.screen(logs, shard=part, attempts=2, **asked)
        assert fleet.page is None and fleet.totals["logs"] == 1
    assert not (tmp_path / "records" / "logs").exists()
    fleet = tw.screen(gather=tmp_path / "records", out=tmp_path / "fleet")
    assert fleet.totals["logs"] == 2 and fleet.page.exists() and len(fleet.logs) == 2
    named = tw.screen([*logs, DATA / "second_paper.mcap"], gather=tmp_path / "records", out=tmp_path / "named")
    assert named.totals["failed"] == 1
    assert named.logs.to_polars()["failure"].drop_nulls().to_list() == ["no_record"]
    again = tw.screen(gather=True, out=tmp_path / "records")
    assert again.totals == fleet.totals and again.page == tmp_path / "records" / "fleet.html"


def test_kinds_of_events_are_refused_as_by_a_policy(tmp_path):
    asked = dict(machine=DATA / "tiny_lift.toml", resume=True, out=tmp_path / "fleet")
    assert tw.screen(DATA / "tiny_lift.mcap", **asked).totals["breaking_policy"] == 0
    assert tw.screen(DATA / "tiny_lift.mcap", fail_on="wheel_lift", **asked).totals["breaking_policy"] == 1
    assert tw.screen(DATA / "tiny_lift.mcap", fail_on=["tip_over"], **asked).totals["breaking_policy"] == 0


def test_impossible_inertias_are_accepted_in_a_fleet(tmp_path):
    for name in ["tiny_lift.toml", "tiny_lift.urdf"]:
        shutil.copy(DATA / name, tmp_path)
    urdf = (tmp_path / "tiny_lift.urdf").read_text()
    assert "ixx='480.0'" in urdf
    (tmp_path / "tiny_lift.urdf").write_text(urdf.replace("ixx='480.0'", "ixx='4800.0'"))
    asked = dict(machine=tmp_path / "tiny_lift.toml", reports="none")
    refused = tw.screen(DATA / "tiny_lift.mcap", out=tmp_path / "refused", **asked)
    accepted = tw.screen(DATA / "tiny_lift.mcap", out=tmp_path / "accepted", accept_inertias=True, **asked)
    assert (refused.totals["failed"], accepted.totals["failed"]) == (1, 0)


def test_every_option_of_the_program_is_a_keyword(capfd):
    from tipwatch import _tipwatch

    assert _tipwatch.main(["tipwatch", "screen", "--help"]) == 0
    told = capfd.readouterr().out
    options = set(re.findall(r"^ +(?:-\w, )?--([a-z-]+)", told, re.MULTILINE))
    assert {"machine", "gather", "time-column", "help"} <= options
    of_a_terminal = {"help", "quiet", "verbose"}
    named_otherwise = {"no-header": "header"}
    keywords = {named_otherwise.get(option, option.replace("-", "_")) for option in options - of_a_terminal}
    assert keywords <= {*inspect.signature(tw.screen).parameters, *inspect.signature(tw.set_read_options).parameters}


@pytest.mark.parametrize(
    "wrong, told",
    [
        (dict(jobs=-1), "expected jobs from 1 to 1024, found -1"),
        (dict(jobs=0), "expected jobs from 1 to 1024, found 0"),
        (dict(jobs=2**70), f"expected jobs from 1 to 1024, found {2**70}"),
        (dict(retries=-1, runner="ray"), "expected retries of at least 0"),
        (dict(runner="spark"), "expected runner"),
        (dict(memory=float("nan")), "expected a positive memory"),
        (dict(memory=float("inf")), "expected a positive memory"),
        (dict(rate=float("nan")), "expected a positive rate"),
        (dict(rate=1e9), "expected a rate of at most 10000 Hz"),
        (dict(min_valid=float("nan")), "expected min_valid from 0 to 1"),
        (dict(reports="some"), "expected reports none or events or all"),
        (dict(lang="fr"), "expected lang en or de"),
        (dict(fail_on="explosion"), "expected fail_on wheel_light or"),
        (dict(fail_on="tip_over", policy="policy.toml"), "expected policy without fail_on"),
        (dict(shard="3/2"), "part 3 of 2 does not exist"),
        (dict(shard=""), "expected I/N"),
        (dict(shard="1/2", prune=True), "expected shard without prune"),
        (dict(attempts=2), "expected attempts without out"),
        (dict(attempts=0, records="records", out=None), "expected attempts of at least 1"),
        (dict(records="records"), "expected records without out"),
        (dict(out=None), "expected either out or records"),
        (dict(gather=True), "expected gather without machine"),
        (dict(gather=True, machine=None, jobs=2), "expected gather without jobs"),
        (dict(fleet="fleet.toml"), "expected either machine or fleet"),
        (dict(gather=True, machine=None, logs=[], prune=True), "expected the folders or logs of the fleet with prune"),
        (dict(gather=True, machine=None, runner="dask"), 'expected gather with runner "threads" alone'),
    ],
)
def test_what_no_screen_can_do_is_refused_before_it_begins(tmp_path, monkeypatch, wrong, told):
    monkeypatch.chdir(tmp_path)
    asked = dict(logs=DATA / "tiny.mcap", machine=DATA / "tiny_lift.toml", out="fleet") | wrong
    with pytest.raises(ValueError, match=re.escape(told)) as refused:
        tw.screen(**asked)
    assert refused.value.kind == "value"
    assert not list(tmp_path.iterdir())


def test_nonsense_is_a_value_error(machine, analysis):
    nan, log = float("nan"), DEMO / "demo.mcap"
    second_paper = DATA / "second_paper.mcap", DATA / "second_paper.toml"
    calls = {
        "expected a finite start": lambda: tw.read(log, machine, start=nan),
        "expected start before end": lambda: tw.analyze(log, machine, start=3.0, end=1.0),
        "expected monte_carlo from 1": lambda: tw.analyze(log, machine, monte_carlo=-1),
        "expected precision 32 or 64": lambda: tw.analyze(log, machine, precision=512),
        "expected a step from 0.0001 to 10 s": lambda: tw.whatif(*second_paper, step=nan),
        "expected a step from 0.0001 to 10 s, found 0": lambda: tw.whatif(*second_paper, step=0.0),
        "expected suspension": lambda: tw.whatif(*second_paper, suspension=""),
        "expected a positive level": lambda: tw.identify(machine, level=nan),
        "expected widen_sigmas": lambda: tw.identify(machine, widen_sigmas=nan),
        "expected estimator": lambda: tw.compare(log, log, machine=machine, estimator=""),
        "expected a finite change": lambda: machine.changed({machine.parameters[0]: nan}),
        "expected the name of a parameter": lambda: machine.changed({"": 1.0}),
        "expected a joint": lambda: machine.joint(""),
        "expected a support": lambda: machine.standing_on([""]),
        "expected finite joint positions": lambda: machine.layout([nan] * len(machine.joints)),
        "expected posture of shape": lambda: machine.link_poses([]),
        "expected positions of shape": lambda: machine.evaluate([]),
        "in what": lambda: machine.evaluate(machine.zero_posture, what=""),
        "expected frame": lambda: machine.evaluate(machine.zero_posture, frame=""),
        "expected specific_force with frame": lambda: machine.evaluate(machine.zero_posture, frame="imu"),
        "expected up as unit vectors, found [0.0, 0.0, 0.0] in row 0": lambda: machine.evaluate(
            machine.zero_posture, up=[0, 0, 0]
        ),
        "in row 1": lambda: machine.evaluate(machine.zero_posture, up=[[0, 0, 1], [0, 0, float("inf")]]),
        "expected n of at least 0": lambda: analysis.samples.head(-1),
    }
    for told, call in calls.items():
        with pytest.raises(ValueError, match=re.escape(told)) as refused:
            call()
        assert refused.value.kind == "value", told
    # what is not known is NaN
    assert machine.evaluate(machine.zero_posture, up=[nan] * 3).load.tolist() == machine.evaluate(machine.zero_posture).load.tolist()


def test_a_machine_stands_on_something(machine):
    with pytest.raises(ValueError) as refused:
        machine.standing_on([])
    assert refused.value.kind == "value"


def test_another_motion_of_the_suspension(tmp_path):
    replay = tw.whatif(DATA / "second_paper.mcap", DATA / "second_paper.toml", suspension="locked", out=tmp_path)
    assert len(replay.samples) > 100 and replay.findings[0] in repr(replay)
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
