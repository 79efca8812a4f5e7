"""Table of docs/accuracy.md: how far results of the bundled scenes differ between widths of registers.

    cargo test --no-run                # the release has no width of two numbers on x86
    python3 tools/widths.py            # some minutes; prints the table for the widths that this processor has

Each scene is computed at every width up to the processor's (SNAPROD_REGISTERS), and once more with the length of its
first rod changed by 1e-10. A difference is that of the last row of the scene's table, each column in units of its
largest value in the run; the largest column counts. The condition is the change over 1e-10.
"""
import csv
import json
import os
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = os.environ.get("SNAPROD_PROGRAM", ROOT / "target/debug/snaprod")
WIDTHS = ["scalar", "two", "avx2", "avx512"]
CHANGE = 1e-10


def widths():
    """Widths of this processor: a wider cap than it has changes nothing."""
    flags = set(Path("/proc/cpuinfo").read_text().split())
    has = {"scalar": True, "two": "avx2" in flags, "avx2": "avx2" in flags, "avx512": "avx512f" in flags}
    return [width for width in WIDTHS if has[width]]


def last_row(table):
    """Numbers of the last row, each in units of the largest of its column."""
    # Of branches the first: the order of mirror images is arbitrary.
    rows = [row for row in csv.DictReader(table.open()) if row.get("branch", "0") == "0"]
    found = {}
    for name in rows[-1]:
        try:
            column = [float(row[name]) for row in rows if row[name] != ""]
        except ValueError:
            continue
        largest = max(map(abs, column), default=0.0)
        # Columns that are noise about zero say nothing.
        if largest > 1e-9 and rows[-1][name] != "":
            found[name] = float(rows[-1][name]) / largest
    return found


def computed(scene, width, settings=()):
    """Last row and steps of a scene at a width, or None if the program refuses."""
    words = tomllib.loads(scene.read_text())
    command = "branch" if "continue" in words else "run" if "run" in words else None
    if command is None:
        return None
    with tempfile.TemporaryDirectory() as out:
        quiet = ["--quiet"] if command == "run" else []
        arguments = [PROGRAM, command, scene, "--out", out, *quiet, *settings]
        subprocess.run(arguments, env={**os.environ, "SNAPROD_REGISTERS": width}, check=False, capture_output=True)
        table = Path(out) / ("branch.csv" if command == "branch" else "trajectory.csv")
        if not table.exists():
            return None
        steps = None
        summary = Path(out) / "summary.json"
        if summary.exists():
            steps = json.loads(summary.read_text()).get("work", {}).get("steps")
        return last_row(table), steps


def difference(one, other):
    """Largest difference of two last rows, over the columns of both that are more than noise."""
    return max((abs(one[name] - other[name]) for name in one.keys() & other.keys()), default=float("nan"))


def longer(scene):
    """The setting that makes the first rod longer by CHANGE."""
    rod = tomllib.loads(scene.read_text())["rod"]
    path, length = (f"rod.{rod[0]['name']}.length", rod[0]["length"]) if isinstance(rod, list) else ("rod.length", rod["length"])
    return ["--set", f"{path}={float(length) * (1 + CHANGE)!r}"]


def main():
    names = widths()
    print("| scene | steps, " + ", ".join(names) + " | largest difference | condition |\n| --- | --- | --- | --- |")
    for scene in sorted((ROOT / "scenes").glob("*.toml")):
        if sys.argv[1:] and scene.stem not in sys.argv[1:]:
            continue
        found = [computed(scene, width) for width in names]
        if None in found:
            continue
        rows = [row for row, _ in found]
        largest = max(difference(row, rows[-1]) for row in rows[:-1])
        changed = computed(scene, names[-1], longer(scene))
        condition = f"{difference(changed[0], rows[-1]) / CHANGE:.1g}" if changed else "?"
        steps = [steps for _, steps in found]
        told = "" if steps[0] is None else str(steps[0]) if len(set(steps)) == 1 else ", ".join(map(str, steps))
        print(f"| {scene.stem} | {told} | {largest:.1e} | {condition} |", flush=True)


main()
