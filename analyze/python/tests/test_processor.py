"""A processor without the instructions that the library was compiled for."""

import platform
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


def test_nothing_is_said_where_the_system_does_not_tell(tmp_path):
    _processor.check(library(tmp_path, "x86-64-v3"), tmp_path / "missing")
