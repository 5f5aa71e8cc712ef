"""The stubs and docstrings against the module."""

import ast
import inspect
import os
import subprocess
import sys
from pathlib import Path

import pytest

import tipwatch as tw
from tipwatch import _tipwatch

SOURCE = Path(__file__).resolve().parents[1] / "tipwatch" / "_tipwatch.pyi"
TEXT = Path(tw.__file__).with_name("_tipwatch.pyi").read_text()
STUB = ast.parse(TEXT)
TOP = {node.name: node for node in STUB.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
FUNCTIONS = [name for name, value in vars(_tipwatch).items() if inspect.isroutine(value)]
CLASSES = [name for name, value in vars(_tipwatch).items() if inspect.isclass(value)]


def test_every_name_is_in_the_stub():
    stated = TOP.keys() | {node.target.id for node in STUB.body if isinstance(node, ast.AnnAssign)}
    assert set(FUNCTIONS) | set(CLASSES) | {"__version__"} <= stated
    assert TOP.keys() <= set(vars(_tipwatch))
    assert set(tw.__all__) <= stated


@pytest.mark.parametrize("name", FUNCTIONS)
def test_parameters_of_functions_are_those_of_the_stub(name):
    assert parameters(getattr(_tipwatch, name)) == stated(TOP[name])


@pytest.mark.parametrize("name", CLASSES)
def test_members_of_classes_are_those_of_the_stub(name):
    nodes = {node.name: node for node in TOP[name].body if isinstance(node, ast.FunctionDef)}
    members = {
        member: value
        for member, value in vars(getattr(_tipwatch, name)).items()
        if (not member.startswith("_") and not isinstance(value, str)) or member in nodes.keys() - {"__new__", "__getattr__"}
    }
    assert members.keys() <= nodes.keys() and nodes.keys() <= members.keys() | {"__new__", "__getattr__"}
    for member, value in members.items():
        is_property = any(getattr(decorator, "id", "") == "property" for decorator in nodes[member].decorator_list)
        assert is_property == inspect.isgetsetdescriptor(value), member
        if not is_property and not member.startswith("_"):
            assert parameters(value) == stated(nodes[member]), member


def test_the_stub_has_the_docstrings_of_the_module():
    """What editors show; TIPWATCH_BLESS=1 writes them into the sources."""
    expected = documented(TEXT)
    if os.environ.get("TIPWATCH_BLESS"):
        SOURCE.write_text(expected)
    else:
        assert expected == TEXT, "run this test with TIPWATCH_BLESS=1"
    # the second time nothing is added
    assert documented(expected) == expected


def documented(text):
    """A stub with the docstrings of the module for all that has a public name."""
    tree, lines = ast.parse(text), text.splitlines()
    places = []
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            places.append((node, getattr(_tipwatch, node.name)))
        if isinstance(node, ast.ClassDef):
            of_class = getattr(_tipwatch, node.name)
            places.append((node, of_class))
            public = [n for n in node.body if isinstance(n, ast.FunctionDef) and not n.name.startswith("_")]
            places += [(member, getattr(of_class, member.name)) for member in public]
    for node, value in reversed(places):
        indent, first = " " * (node.col_offset + 4), node.body[0]
        written = [indent + line if line else "" for line in f'"""{inspect.getdoc(value)}"""'.replace("\\", r"\\").splitlines()]
        has_docstring = ast.get_docstring(node) is not None
        if isinstance(node, ast.FunctionDef) and not has_docstring:
            lines[first.lineno - 1] = lines[first.lineno - 1].removesuffix(" ...")
        begin = min([first.lineno, *(d.lineno for d in getattr(first, "decorator_list", []))]) - 1
        if isinstance(node, ast.FunctionDef) and not has_docstring:
            begin += 1
        lines[begin : first.end_lineno if has_docstring else begin] = written
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("name", [name for name in tw.__all__ if name != "__version__"])
def test_help_reads_well(name):
    value = getattr(tw, name)
    assert inspect.getdoc(value), name
    sections = ["Parameters", "Returns", "Raises"] if inspect.isroutine(value) else []
    for section in sections:
        assert f"\n{section}\n{'-' * len(section)}\n" in inspect.getdoc(value), section
    for member, of in vars(value).items() if inspect.isclass(value) else []:
        if not member.startswith("_"):
            assert inspect.getdoc(of), f"{name}.{member}"
            assert "](" not in inspect.getdoc(of), f"a link of another language: {name}.{member}"


def test_every_parameter_is_explained():
    for name in FUNCTIONS:
        if name in tw.__all__:
            text = inspect.getdoc(getattr(tw, name))
            missing = [word for word, _, _ in parameters(getattr(tw, name)) if word not in text]
            assert not missing, name


def test_mypy_takes_the_stub(tmp_path):
    pytest.importorskip("mypy")
    # the extension has it under the name __getattribute__
    allowed = tmp_path / "allowed"
    allowed.write_text("tipwatch._tipwatch.Evaluation.__getattr__\n")
    command = [sys.executable, "-m", "mypy.stubtest", "tipwatch._tipwatch", "--allowlist", str(allowed)]
    checked = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert checked.returncode == 0, checked.stdout + checked.stderr


def parameters(function):
    """Name, kind and default of each parameter."""
    found = [p for p in inspect.signature(function).parameters.values() if p.name != "self"]
    return [(p.name, p.kind.name, None if p.default is p.empty else repr(p.default)) for p in found]


def stated(node):
    """The same of a function in the stub."""
    arguments = node.args
    at_place = [*arguments.posonlyargs, *arguments.args]
    defaults = [None] * (len(at_place) - len(arguments.defaults)) + arguments.defaults
    kinds = ["POSITIONAL_ONLY"] * len(arguments.posonlyargs) + ["POSITIONAL_OR_KEYWORD"] * len(arguments.args)
    rows = [*zip(at_place, kinds, defaults), *((a, "KEYWORD_ONLY", d) for a, d in zip(arguments.kwonlyargs, arguments.kw_defaults))]
    return [(a.arg, kind, None if d is None else repr(ast.literal_eval(d))) for a, kind, d in rows if a.arg != "self"]
