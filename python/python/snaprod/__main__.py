"""The program ``snaprod``: ``python -m snaprod run scene.toml``."""

import sys

from . import _core


def main() -> int:
    """Runs the program with the words of the command line, and returns its exit code."""
    return _core.program(["snaprod", *sys.argv[1:]])


if __name__ == "__main__":
    raise SystemExit(main())
