"""Poses of links, and drawings of machines and logs."""

import sys
from pathlib import Path

import numpy as np
import pytest

import tipwatch as tw
from conftest import DEMO

DATA = Path(__file__).resolve().parents[3] / "tests" / "data"


@pytest.fixture(scope="module")
def moved(machine):
    """A posture with every joint off zero."""
    return machine.zero_posture + np.linspace(0.05, 0.3, len(machine.joints))


def test_poses_are_rigid_and_follow_the_joints(machine, moved):
    poses, at_zero = machine.link_poses(moved), machine.link_poses()
    assert poses.keys() == at_zero.keys()
    assert np.array_equal(poses["base_link"], np.eye(4))
    for pose in poses.values():
        assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
        assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0) and np.array_equal(pose[3], [0, 0, 0, 1])
    slewed = machine.zero_posture
    slewed[machine.joint("slew")] = 0.5
    turn = machine.link_poses(slewed)["arm_slew"][:3, :3] @ at_zero["arm_slew"][:3, :3].T
    assert np.allclose(turn, [[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]])


@pytest.mark.parametrize("name", ["forklift", "crane"])
def test_val_poses_are_those_of_pinocchio(name):
    pinocchio = pytest.importorskip("pinocchio")
    machine = tw.Machine(DATA / f"{name}.toml")
    model = pinocchio.buildModelFromXML(machine.urdf)
    data, q = model.createData(), pinocchio.neutral(model)
    posture = machine.zero_posture + np.linspace(0.1, 0.4, len(machine.joints))
    for joint, position in zip(machine.joints, posture):
        of = model.joints[model.getJointId(joint)]
        q[of.idx_q : of.idx_q + of.nq] = [position] if of.nq == 1 else [np.cos(position), np.sin(position)]
    pinocchio.framesForwardKinematics(model, data, q)
    poses = machine.link_poses(posture)
    root = next(link for link, pose in poses.items() if np.array_equal(pose, np.eye(4)))
    base = data.oMf[model.getFrameId(root, pinocchio.BODY)]
    assert len(poses) > 3
    for link, pose in poses.items():
        assert np.allclose((base.inverse() * data.oMf[model.getFrameId(link, pinocchio.BODY)]).homogeneous, pose, atol=1e-9), link


def test_the_zmp_at_rest_is_below_the_centre_of_mass(machine, moved):
    layout, result = machine.layout(moved), machine.evaluate(moved)
    normal, com, contacts = (layout[name] for name in ("normal", "centre_of_mass", "contacts"))
    # the soft tyres let the machine lean a little in the ground's plane
    assert np.allclose(normal, [0, 0, 1], atol=0.01)
    foot = com - np.array([0, 0, normal @ (com - contacts[0]) / normal[2]])
    forward = np.array([1.0, 0, 0]) - normal * normal[0]
    forward /= np.linalg.norm(forward)
    zmp = [forward @ foot, np.cross(normal, forward) @ foot]
    assert np.allclose(zmp, [result.zmp_x[0], result.zmp_y[0]], atol=1e-6)
    drop = layout["wheel_centres"] - layout["contacts"]
    assert np.allclose(np.linalg.norm(drop, axis=1), layout["wheel_radii"], rtol=0.1)
    assert set(layout["edges"].ravel()) == set(range(len(machine.wheels)))


def test_postures_are_checked(machine):
    joints = len(machine.joints)
    with pytest.raises(tw.TipwatchError, match=rf"expected posture of shape \({joints},\), found \[2\]"):
        machine.link_poses([0.0, 0.0])
    unknown = machine.zero_posture
    unknown[0] = np.nan
    with pytest.raises(tw.TipwatchError, match=f"expected finite joint positions, found NaN of joint {machine.joints[0]}"):
        machine.layout(unknown)


def test_a_drawing_shows_shapes_wheels_and_centre_of_mass(tmp_path):
    pyplot = matplotlib()
    machine = tw.Machine(DATA / "forklift.toml")
    figure = machine.draw()
    figure.savefig(tmp_path / "machine.png")
    side, top = figure.axes
    assert (tmp_path / "machine.png").stat().st_size > 5000
    shapes = machine.urdf.count("<box") + machine.urdf.count("<cylinder")
    assert 0 < len(side.patches) == len(top.patches) <= shapes
    com = machine.layout()["centre_of_mass"]
    drawn = [line for line in top.lines if line.get_label() == "centre of mass"]
    assert np.allclose(drawn[0].get_xydata(), [com[:2]])
    assert [text.get_text() for text in top.texts] == machine.wheels
    # on axes of the caller
    figure, axes = pyplot.subplots(2, 1)
    assert machine.draw(machine.zero_posture, ax=axes) is figure
    with pytest.raises(ValueError, match="expected ax to be a pair of matplotlib axes"):
        machine.draw(ax=axes[0])
    pyplot.close("all")


def test_an_arm_without_shapes_is_drawn_as_lines(machine, moved):
    pyplot = matplotlib()
    side, _ = machine.draw(moved).axes
    place = machine.link_poses(moved)["tilt_link"][[0, 2], 3]
    ends = np.concatenate([line.get_xydata() for line in side.lines])
    assert np.isclose(ends, place).all(axis=1).any()
    pyplot.close("all")


def test_a_plot_shows_loads_bands_and_events(analysis, machine, tmp_path):
    pyplot = matplotlib()
    figure = analysis.plot()
    figure.savefig(tmp_path / "log.png")
    loads, margins = figure.axes
    assert (tmp_path / "log.png").stat().st_size > 20_000
    assert [line.get_label() for line in loads.lines] == machine.wheels
    drawn, load = loads.lines[2].get_ydata(), np.asarray(analysis.samples["load_rl"])
    valid = np.asarray(analysis.samples["valid"])
    assert np.array_equal(drawn, np.where(valid, load, np.nan), equal_nan=True)
    assert len(loads.collections) == len(machine.wheels)
    kinds = set(analysis.events["kind"].to_list())
    assert {"wheel_light", "wheel_lift"} <= kinds
    assert {patch.get_label() for patch in loads.patches} >= {"wheel light", "wheel lift"}
    assert margins.lines[0].get_label() == "utilisation"
    # a part of it, on axes of the caller
    figure, axes = pyplot.subplots(2, 1)
    assert analysis.plot(start=6.0, end=9.0, ax=axes) is figure
    seconds = axes[0].lines[0].get_xdata()
    assert seconds.min() >= 6.0 and seconds.max() <= 9.0
    with pytest.raises(ValueError, match="expected rows between start 900"):
        analysis.plot(start=900.0)
    pyplot.close("all")


def test_a_log_that_ends_during_an_event_is_drawn(machine):
    pyplot = matplotlib()
    # the wheel is off the ground from 9.8 to 13.4 s
    found = tw.analyze(DEMO / "demo.mcap", machine, end=11.0)
    lift = found.events.to_polars().filter(kind="wheel_lift")
    assert lift["end_ns"].to_list() == [None]
    loads, _ = found.plot().axes
    (shade,) = [patch for patch in loads.patches if patch.get_label() == "wheel lift"]
    last = loads.lines[0].get_xdata()[-1]
    assert shade.get_x() < 10.0 and shade.get_x() + shade.get_width() == pytest.approx(last)
    pyplot.close("all")


def test_a_plot_names_the_columns_that_it_lacks(machine):
    pyplot = matplotlib()
    few = tw.analyze(DEMO / "demo.mcap", machine, columns=["time_ns", "load_fl"])
    with pytest.raises(ValueError, match="expected samples with valid, load_WHEEL, load_WHEEL_sigma to plot") as wrong:
        few.plot()
    assert wrong.value.kind == "value"
    enough = tw.analyze(DEMO / "demo.mcap", machine, columns=["time_ns", "valid", "load_fl", "load_fl_sigma"])
    assert [line.get_label() for line in enough.plot().axes[0].lines] == ["FL"]
    pyplot.close("all")


def test_without_matplotlib_the_error_says_so(machine, analysis, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match="expected matplotlib for Machine.draw"):
        machine.draw()
    with pytest.raises(ImportError, match="expected matplotlib for Analysis.plot"):
        analysis.plot()


def matplotlib():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot
