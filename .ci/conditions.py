"""Prints how many outcomes of the conditions in a coverage export were seen, and each that was not."""

import json
import os
import sys


def main() -> None:
    with open(sys.argv[1]) as file:
        exported = json.load(file)
    root = os.getcwd()
    rows, missing = [], []
    for entry in exported["data"][0]["files"]:
        path = os.path.relpath(entry["filename"], root)
        with open(entry["filename"]) as file:
            lines = file.read().splitlines()
        # tests stand at the end of a file, or are a file of their own
        last = next((n for n, line in enumerate(lines, 1) if line.startswith("#[cfg(test)]")), len(lines) + 1)
        if os.path.basename(path) in ("rules.rs", "mod.rs"):
            continue
        outcomes: dict[tuple[int, int, int, int], list[int]] = {}
        for line, column, end_line, end_column, true, false, *_ in entry["branches"]:
            if line < last:
                seen = outcomes.setdefault((line, column, end_line, end_column), [0, 0])
                seen[0] += true
                seen[1] += false
        if not outcomes:
            continue
        seen = sum(count > 0 for counts in outcomes.values() for count in counts)
        rows.append((path, 2 * len(outcomes), seen))
        for (line, column, end_line, end_column), counts in sorted(outcomes.items()):
            text = lines[line - 1][column - 1 : end_column - 1 if end_line == line else None]
            for value, count in zip(("true", "false"), counts):
                if count == 0:
                    missing.append(f"{path}:{line}: never {value}: {text}")
    print("| file | outcomes of conditions | seen |\n|---|---|---|")
    for path, total, seen in sorted(rows):
        print(f"| `{path}` | {total} | {seen} |")
    total, seen = sum(row[1] for row in rows), sum(row[2] for row in rows)
    print(f"| all | {total} | {seen} ({100 * seen / max(total, 1):.1f} %) |\n")
    print("\n".join(missing))


main()
