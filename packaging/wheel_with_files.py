#!/usr/bin/env python3
"""Adds programs, other files and licences to a wheel. pip installs the programs into the folder of the environment's programs, the
other files into the environment's own folder. What the library was compiled for becomes the build tag of the wheel, such as
1_x86_64_v3: the tags of platforms know no levels of x86-64."""

import argparse
import base64
import csv
import hashlib
import io
import os
import re
import time
import zipfile


def digest(data: bytes) -> str:
    return "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def content(path: str) -> bytes:
    with open(path, "rb") as file:
        return file.read()


def with_licences(metadata: bytes, names: list[str]) -> bytes:
    """The metadata with the names of the licences (PEP 639)."""
    head, separator, body = metadata.decode().partition("\n\n")
    lines = [f"License-File: {name}" for name in names]
    return ("\n".join([head, *lines]) + separator + body).encode()


def build_tag(files: dict[str, tuple[int, bytes]]) -> str | None:
    """The build tag for what the library in a wheel was compiled for; None for one that runs on every processor."""
    for name, (_, data) in files.items():
        if name.endswith((".so", ".pyd")) and (level := re.search(rb"tipwatch-is-built-for:(x86-64-v[0-9]);", data)):
            return f"1_{level[1].decode().replace('-', '_')}"
    return None


def tagged(wheel: str, tag: str) -> str:
    """The name of a wheel without a build tag, with one: it stands behind the version."""
    name, version, *tags = wheel.split("-")
    return "-".join([name, version, tag, *tags])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("wheel")
    parser.add_argument("out", help="folder of the new wheel")
    parser.add_argument("--program", action="append", default=[])
    parser.add_argument("--data", help="folder of what the environment's own folder receives")
    parser.add_argument("--licence", action="append", default=[])
    asked = parser.parse_args()
    moment = time.gmtime(max(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), 315532800))[:6]
    with zipfile.ZipFile(asked.wheel) as old:
        files = {info.filename: (info.external_attr >> 16 or 0o644, old.read(info)) for info in old.infolist()}
    record = next(name for name in files if name.endswith(".dist-info/RECORD"))
    information = record.removesuffix("/RECORD")
    data = f"{information.removesuffix('.dist-info')}.data"
    for program in asked.program:
        files[f"{data}/scripts/{os.path.basename(program)}"] = (0o755, content(program))
    for folder, _, names in os.walk(asked.data or os.devnull):
        for name in names:
            path = os.path.join(folder, name)
            files[f"{data}/data/{os.path.relpath(path, asked.data)}"] = (0o644, content(path))
    licences = [os.path.basename(path) for path in asked.licence]
    for path, name in zip(asked.licence, licences):
        files[f"{information}/licenses/{name}"] = (0o644, content(path))
    mode, metadata = files[f"{information}/METADATA"]
    files[f"{information}/METADATA"] = (mode, with_licences(metadata, licences))
    name = os.path.basename(asked.wheel)
    if tag := build_tag(files):
        name = tagged(name, tag)
        mode, wheel = files[f"{information}/WHEEL"]
        files[f"{information}/WHEEL"] = (mode, wheel.rstrip(b"\n") + f"\nBuild: {tag}\n".encode())
    # RECORD lists every file but itself, and stands last
    del files[record]
    table = io.StringIO()
    rows = csv.writer(table, lineterminator="\n")
    for path, (_, data) in sorted(files.items()):
        rows.writerow([path, digest(data), len(data)])
    rows.writerow([record, "", ""])
    files[record] = (0o644, table.getvalue().encode())
    path = os.path.join(asked.out, name)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for name, (mode, data) in files.items():
            info = zipfile.ZipInfo(name, moment)
            info.external_attr = (0o100000 | mode & 0o777) << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            new.writestr(info, data)
    print(path)


main()
