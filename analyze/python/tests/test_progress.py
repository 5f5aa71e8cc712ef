"""Progress bars and interruptions."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import tipwatch as tw

ROOT = Path(__file__).resolve().parents[3]
DEMO, DATA = ROOT / "analyze" / "demo", ROOT / "tests" / "data"
# seconds from Ctrl+C to the end of the process
SOON_S = 2.0


@pytest.mark.parametrize("library", ["tqdm", "rich"])
def test_a_bar_ends_full(library, machine, monkeypatch, capfd):
    pytest.importorskip(library)
    for other in {"tqdm", "rich"} - {library}:
        hide(other, monkeypatch)
    tw.analyze(DEMO / "demo.mcap", machine, rate=50, progress=True)
    told = capfd.readouterr()
    assert "analyze demo.mcap" in told.err and "100%" in told.err and not told.out


def test_a_bar_of_logs_counts_them(tmp_path, capfd):
    pytest.importorskip("tqdm")
    tw.screen([DATA / "tiny.mcap", DATA / "tiny_lift.mcap"], machine=DATA / "tiny_lift.toml", out=tmp_path, progress=True)
    assert "2/2" in capfd.readouterr().err


def test_without_a_library_nothing_is_shown(machine, monkeypatch, capfd):
    hide("tqdm", monkeypatch)
    hide("rich", monkeypatch)
    tw.analyze(DEMO / "demo.mcap", machine, rate=50, progress=True)
    tw.analyze(DEMO / "demo.mcap", machine, rate=50, progress=False)
    told = capfd.readouterr()
    assert not told.err and not told.out


def test_a_bar_ends_with_a_failed_call(tmp_path, machine, capfd):
    (tmp_path / "no.mcap").write_bytes(b"not a log")
    with pytest.raises(tw.TipwatchError, match="no.mcap"):
        tw.analyze(tmp_path / "no.mcap", machine, progress=True)
    assert "100%" not in capfd.readouterr().err


def test_progress_is_checked(machine):
    with pytest.raises(TypeError, match="expected progress True, False or a function, found 3"):
        tw.analyze(DEMO / "demo.mcap", machine, progress=3)


def test_errors_of_a_function_end_the_call(machine):
    def fail(read):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        tw.analyze(DEMO / "demo.mcap", machine, rate=50, progress=fail)


# each takes much longer than the pause before the interruption, however fast the processor is
LONG = {
    "evaluate": "machine.evaluate(np.tile(machine.zero_posture, (1_000_000, 1)), what=['sigma'])",
    "analyze": "[tw.analyze(LOG, machine, rate=10_000) for _ in range(20)]",
    "read": "[tw.read(LOG, machine, rate=10_000) for _ in range(20)]",
    "compare": "[tw.compare(LOG, LOG, machine=machine, rate=10_000) for _ in range(20)]",
}


@pytest.mark.skipif(os.name != "posix", reason="needs signals")
@pytest.mark.parametrize("call", LONG)
def test_ctrl_c_ends_a_call(call):
    script = f"""
import numpy as np, tipwatch as tw
LOG = {str(DEMO / "demo.mcap")!r}
machine = tw.Machine({str(DEMO / "demo.toml")!r})
print("begun", flush=True)
try:
    {LONG[call]}
    print("finished", flush=True)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert child.stdout.readline() == "begun\n", child.stderr.read()
        time.sleep(0.7)
        asked = time.monotonic()
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=60)
        took = time.monotonic() - asked
    finally:
        child.kill()
    assert (out, child.returncode) == ("interrupted\n", 0), err
    assert took < SOON_S


def hide(library, monkeypatch):
    """Lets imports of a library fail."""
    for name in {library, "tqdm.auto", "rich.console", "rich.progress"}:
        if name.split(".")[0] == library:
            monkeypatch.setitem(sys.modules, name, None)
