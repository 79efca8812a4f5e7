"""Figures, pages, films and files of the program, made by the program in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from . import _core
from ._errors import ComputationError, SceneError
from ._scene import Given

__all__ = ["Drawing"]


class Drawing:
    """A figure of the program, or a film, as SVG. Notebooks show it."""

    name: str
    """The name of the figure, as the program gives it to its file."""
    svg: str
    """The text of the figure."""

    def __init__(self, name: str, svg: str) -> None:
        self.name, self.svg = name, svg

    def save(self, path: str | os.PathLike[str], *, scale: float = 2.0) -> None:
        """Writes the figure as SVG, PNG or PDF, by the end of the path.

        Each pixel of the figure becomes ``scale`` pixels of a PNG.
        """
        end = Path(path).suffix.lower()
        if end not in (".svg", ".png", ".pdf"):
            raise ValueError(f"{os.fspath(path)}: the path of a figure ends in .svg, .png or .pdf")
        text = self.svg.encode()
        Path(path).write_bytes(text if end == ".svg" else bytes(_core.picture(self.svg, end[1:], scale)))

    def __repr__(self) -> str:
        return f"<Drawing: {self.name}, {len(self.svg)} bytes of SVG>"

    def _repr_svg_(self) -> str:
        return self.svg


def made(given: Given, command: str, options: list[str], film: str = "") -> dict[str, bytes]:
    """Returns the files that a command of the program writes for a scene, by their names.

    The motion or branch is computed once more. ``film`` is the end of the name of a film.

    Raises SceneError for options that the program refuses, and ComputationError for a film that is not made.
    """
    text, overrides, name, loads = given
    if loads:
        raise SceneError(["loads: the program knows no functions of Python; plot(), at() and shape() do"])
    with TemporaryDirectory() as directory:
        scene, out = Path(directory, f"{Path(name or 'scene').stem}.toml"), Path(directory, "out")
        scene.write_text(text, encoding="utf-8")
        call = [sys.executable, "-m", "snaprod", command, str(scene), "--quiet", "--out", str(out), *options]
        call += [word for one in overrides for word in ("--set", one)]
        if film:
            call += ["--film", str(Path(directory, f"film.{film}"))]
        # The process finds the package where this one found it.
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
        done = subprocess.run(call, capture_output=True, text=True, encoding="utf-8", env=environment, check=False)
        if done.returncode not in (0, 1):
            raise SceneError([done.stderr.strip().replace(directory + os.sep, "")])
        files = [*out.iterdir(), *Path(directory).glob("film.*")]
        found = {path.name: path.read_bytes() for path in files if path.is_file()}
    if film and f"film.{film}" not in found:
        raise ComputationError(done.stderr.strip().replace(directory + os.sep, ""))
    return found


def figure(given: Given, command: str, name: str | None, usual: tuple[str, ...], options: list[str]) -> Drawing:
    """Returns a figure of a command by its name, without a name the first of the usual ones."""
    files = made(given, command, options)
    drawn = {Path(file).stem: text.decode() for file, text in files.items() if file.endswith(".svg")}
    if name is None:
        name = next((one for one in usual if one in drawn), next(iter(sorted(drawn)), None))
    if name is None or name not in drawn:
        raise ValueError(f"name = {name!r}: the program draws {', '.join(sorted(drawn)) or 'no figure'}")
    return Drawing(name, drawn[name])
