#!/usr/bin/env python3
"""Adds a program to a wheel: WHEEL PROGRAM OUT. pip installs it into the folder of the environment's programs."""

import base64
import csv
import hashlib
import io
import os
import sys
import time
import zipfile


def digest(data: bytes) -> str:
    return "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def main() -> None:
    wheel, program, out = sys.argv[1:]
    moment = time.gmtime(max(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), 315532800))[:6]
    with zipfile.ZipFile(wheel) as old:
        files = {info.filename: (info.external_attr >> 16 or 0o644, old.read(info)) for info in old.infolist()}
    record = next(name for name in files if name.endswith(".dist-info/RECORD"))
    name = record.split(".dist-info/")[0] + ".data/scripts/" + os.path.basename(program)
    with open(program, "rb") as file:
        files[name] = (0o755, file.read())
    # RECORD lists every file but itself, and stands last
    del files[record]
    table = io.StringIO()
    rows = csv.writer(table, lineterminator="\n")
    for path, (_, data) in sorted(files.items()):
        rows.writerow([path, digest(data), len(data)])
    rows.writerow([record, "", ""])
    files[record] = (0o644, table.getvalue().encode())
    path = os.path.join(out, os.path.basename(wheel))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for name, (mode, data) in files.items():
            info = zipfile.ZipInfo(name, moment)
            info.external_attr = (0o100000 | mode & 0o777) << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            new.writestr(info, data)
    print(path)


main()
