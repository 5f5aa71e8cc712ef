"""A processor without the instructions that the library was compiled for."""

import platform
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import tipwatch as tw
from tipwatch import _processor, _tipwatch

PACKAGE = Path(tw.__file__).parent
OLD = "fpu sse sse2 ssse3 sse4_1 sse4_2 popcnt avx xsave"
of_x86 = pytest.mark.skipif(platform.machine() != "x86_64", reason="the levels are those of x86-64")


def cpuinfo(tmp_path, flags):
    file = tmp_path / "cpuinfo"
    file.write_text(f"processor\t: 0\nflags\t\t: {flags}\nbugs\t\t: none\n")
    return file


def library(tmp_path, level):
    (tmp_path / "_tipwatch.abi3.so").write_bytes(b"\x7fELF\0" * 1000 + f"tipwatch-is-built-for:{level};".encode() + b"\0")
    return tmp_path


def test_the_file_says_what_the_loaded_library_says():
    level = _tipwatch.__processor__.removeprefix("tipwatch-is-built-for:").removesuffix(";")
    assert _processor._built_for(Path(_tipwatch.__file__)) == level
    assert level == "any" or level in _processor._LEVELS


@of_x86
def test_what_is_missing_is_an_error_before_the_library_is_loaded(tmp_path):
    package = library(tmp_path, "x86-64-v3")
    with pytest.raises(ImportError, match="avx2") as raised:
        _processor.check(package, cpuinfo(tmp_path, OLD))
    assert raised.value.path == str(package / "_tipwatch.abi3.so")
    _processor.check(package, cpuinfo(tmp_path, f"{OLD} abm avx2 bmi1 bmi2 f16c fma movbe"))


@of_x86
def test_a_library_for_every_processor_loads_on_an_old_one(tmp_path):
    _processor.check(library(tmp_path, "any"), cpuinfo(tmp_path, OLD))
    with pytest.raises(ImportError, match="avx512f"):
        _processor.check(library(tmp_path, "x86-64-v4"), cpuinfo(tmp_path, f"{OLD} abm avx2 bmi1 bmi2 f16c fma movbe"))


@pytest.mark.parametrize("level, tag", [("x86-64-v3", "1_x86_64_v3-"), ("any", "")])
def test_the_name_of_a_wheel_says_what_its_library_needs(tmp_path, level, tag):
    wheel, out = tmp_path / "tipwatch-0.1.0-cp311-abi3-linux_x86_64.whl", tmp_path / "out"
    out.mkdir()
    information = "tipwatch-0.1.0.dist-info"
    with zipfile.ZipFile(wheel, "w") as made:
        made.write(library(tmp_path, level) / "_tipwatch.abi3.so", "tipwatch/_tipwatch.abi3.so")
        made.writestr(f"{information}/METADATA", "Metadata-Version: 2.4\nName: tipwatch\nVersion: 0.1.0\n\nText")
        made.writestr(f"{information}/WHEEL", "Wheel-Version: 1.0\nTag: cp311-abi3-linux_x86_64\n")
        made.writestr(f"{information}/RECORD", "")
    script = Path(__file__).resolve().parents[3] / "packaging" / "wheel_with_files.py"
    subprocess.run([sys.executable, script, wheel, out], check=True)
    (made,) = out.iterdir()
    assert made.name == f"tipwatch-0.1.0-{tag}cp311-abi3-linux_x86_64.whl"
    told = zipfile.ZipFile(made).read(f"{information}/WHEEL").decode().splitlines()
    assert [line for line in told if line.startswith("Build")] == [f"Build: {tag[:-1]}"] * bool(tag)


def test_nothing_is_said_where_the_system_does_not_tell(tmp_path):
    _processor.check(library(tmp_path, "x86-64-v3"), tmp_path / "missing")
