"""The program ``tipwatch`` inside the package."""

import sys

from tipwatch import _tipwatch


def main() -> None:
    """Runs the program with the arguments of the command line, and exits with its code."""
    sys.exit(_tipwatch.main(["tipwatch", *sys.argv[1:]]))
