"""Machines and evaluations of many postures."""

import threading
import time
from pathlib import Path

import numpy as np
import pytest

import tipwatch as tw

DATA = Path(__file__).resolve().parents[3] / "tests" / "data"


def test_a_machine_names_its_parts(machine):
    assert len(machine.wheels) == 4
    assert [machine.wheel(name) for name in machine.wheels] == [0, 1, 2, 3]
    assert [machine.joint(name) for name in machine.joints] == list(range(len(machine.joints)))
    assert machine.zero_posture.shape == (len(machine.joints),)
    assert machine.joint_limits.shape == (len(machine.joints), 2)
    assert set(machine.joint_units) <= {"rad", "m"}


def test_unknown_names_say_what_was_expected(machine):
    with pytest.raises(tw.TipwatchError, match='expected a wheel .*found "XX"'):
        machine.wheel("XX")
    with pytest.raises(tw.TipwatchError, match="expected the name of a parameter"):
        machine.changed({"nothing.mass": 1.0})
    with pytest.raises(tw.TipwatchError, match="no-such-file"):
        tw.Machine("no-such-file.toml")


def test_loads_at_rest_sum_to_the_weight(machine):
    postures = postures_of(machine, 2500)
    result = machine.evaluate(postures)
    assert result.load.shape == (2500, 4)
    weight = machine.mass * machine.gravity
    assert np.allclose(result.otf.sum(axis=1), weight, rtol=2e-3)
    assert np.allclose(result.normal_force, result.load.sum(axis=1), rtol=1e-9)
    assert np.all(result.load_min <= result.load + 1e-6)


def test_one_posture_has_the_bits_of_many(machine):
    postures = postures_of(machine, 1030)
    many = machine.evaluate(postures, what=["all", "gradient"])
    for row in (0, 1, 1023, 1024, 1029):
        one = machine.evaluate(postures[row], what=["all", "gradient"])
        for name in one.names:
            if name != "load_gradient":
                assert np.array_equal(getattr(one, name)[0], getattr(many, name)[row], equal_nan=True), name


def test_the_gradient_is_the_derivative(machine):
    posture = machine.zero_posture
    at = machine.evaluate(posture, what=["gradient"])
    place = machine.gradient_names.index(f"{machine.joints[0]}.position")
    step = 1e-5
    moved = [posture.copy(), posture.copy()]
    moved[0][0] -= step
    moved[1][0] += step
    low, high = (machine.evaluate(q).otf[0] for q in moved)
    assert np.allclose(at.load_gradient[0, :, place], (high - low) / (2 * step), rtol=1e-4, atol=0.05)


def test_a_changed_machine_carries_the_change(machine):
    name = next(name for name in machine.parameters if name.endswith(".mass"))
    heavier = machine.changed({name: 100.0})
    assert heavier.mass == pytest.approx(machine.mass + 100.0)
    assert machine.evaluate(machine.zero_posture).load.sum() < heavier.evaluate(machine.zero_posture).load.sum()


def test_analyses_refuse_a_changed_machine(machine):
    name = next(name for name in machine.parameters if name.endswith(".mass"))
    with pytest.raises(tw.TipwatchError, match="expected a machine as in its file .*demo.toml"):
        tw.analyze("drive.mcap", machine.changed({name: 100.0}))
    with pytest.raises(tw.TipwatchError, match="drive.mcap"):
        tw.analyze("drive.mcap", machine.changed({}))


def test_a_machine_stands_on_its_outriggers():
    crane = tw.Machine(DATA / "crane.toml")
    feet = [name for name in crane.supports if name not in crane.wheels]
    standing = crane.standing_on(feet)
    assert len(feet) == 4 and standing.wheels == feet
    loads = standing.evaluate(standing.zero_posture)
    assert loads.otf.sum() == pytest.approx(crane.mass * crane.gravity, rel=2e-3)
    # the feet are farther apart than the wheels
    assert loads.zmp_margin[0] > crane.evaluate(crane.zero_posture).zmp_margin[0]
    with pytest.raises(tw.TipwatchError, match='expected a support .*found "XX"'):
        crane.standing_on(["XX"])
    with pytest.raises(tw.TipwatchError, match="expected"):
        crane.standing_on(feet[:2])
    with pytest.raises(tw.TipwatchError, match="found one from Machine.changed or standing_on"):
        tw.analyze("drive.mcap", standing)


def test_causes_add_up(machine):
    result = machine.evaluate(postures_of(machine, 8), what=["causes"])
    assert result.cause.shape[0] == 8 and result.cause.shape[2] == 4
    names = result.columns("cause")[:: len(machine.wheels)]
    suffix = "_" + machine.wheels[0].lower()
    causes = dict(zip((name.removesuffix(suffix) for name in names), result.cause.swapaxes(0, 1)))
    # with the attitude known, the specific force is told apart into slope and accelerations
    assert np.isnan(causes.pop("cause_specific_force")).all()
    lift_off = causes.pop("cause_lift_off")
    assert np.allclose(sum(causes.values()), result.otf, atol=1e-6)
    assert np.allclose(sum(causes.values()) + lift_off, result.load, atol=1e-6)


def test_inputs_may_be_tuples_and_lists(machine):
    posture = machine.zero_posture
    stated = machine.evaluate(posture.tolist(), specific_force=(0, 0, machine.gravity))
    assert np.array_equal(stated.load, machine.evaluate(posture).load)


def test_wrong_shapes_are_refused(machine):
    joints = len(machine.joints)
    with pytest.raises(tw.TipwatchError, match=rf"expected positions of shape \({joints},\) or \(rows, {joints}\)"):
        machine.evaluate(np.zeros((3, joints + 1)))
    with pytest.raises(tw.TipwatchError, match="expected 3 rows of specific_force"):
        machine.evaluate(np.zeros((3, joints)), specific_force=np.zeros((2, 3)))
    for what in (["everything"], "everything"):
        with pytest.raises(tw.TipwatchError, match="expected loads, indicators") as raised:
            machine.evaluate(np.zeros((3, joints)), what=what)
        assert raised.value.kind == "value" and isinstance(raised.value, ValueError)


def test_one_word_says_what_is_wanted(machine):
    posture = postures_of(machine, 1)
    names = machine.evaluate(posture, what="indicators").names
    assert names == machine.evaluate(posture, what=["indicators"]).names != machine.evaluate(posture).names


def test_other_threads_run_meanwhile(machine):
    turns, is_done = [], threading.Event()

    def count():
        while not is_done.is_set():
            turns.append(time.monotonic())
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        started = time.monotonic()
        machine.evaluate(postures_of(machine, 200_000), what=["all"])
        ended = time.monotonic()
    finally:
        is_done.set()
        thread.join()
    during = [t for t in turns if started < t < ended]
    assert len(during) > 3


def postures_of(machine, rows):
    """Postures along the first joint."""
    postures = np.tile(machine.zero_posture, (rows, 1))
    low, high = machine.joint_limits[0]
    postures[:, 0] = np.linspace(max(low, -0.5), min(high, 0.5), rows) if low == low else np.linspace(-0.5, 0.5, rows)
    return postures


def test_a_machine_is_sent_to_workers(machine):
    import pickle

    sent = pickle.loads(pickle.dumps(machine))
    assert sent.name == machine.name and sent.mass == machine.mass and sent.joints == machine.joints
