#!/usr/bin/env python3
"""Writes docs/files.md, the index of source files, from the first sentence of each file's head comment.

    python3 tools/index.py           writes the index
    python3 tools/index.py --check   fails if the index is not the one that would be written
"""

import pathlib
import re
import subprocess
import sys

INDEX = pathlib.Path("docs/files.md")
ROOMS = ["core/src", "systems/src", "waves/src", "walls/src", "motion/src", "plot/src", "src", "python/src", "play/src"]


def first_sentence(path):
    lines = []
    for line in pathlib.Path(path).read_text(encoding="utf-8").splitlines():
        if not line.startswith("//!") or line.strip() == "//!":
            break
        lines.append(line[3:].strip())
    sentence = re.split(r"(?<=\.)\s+(?=[A-Z`])", " ".join(lines))[0]
    # Links between items mean nothing outside the library's own documentation.
    return re.sub(r"\[(`[^`]*`)\](\([^)]*\))?", r"\1", sentence).replace("|", "\\|")


def index():
    listed = subprocess.run(["git", "ls-files", "--", *ROOMS], capture_output=True, text=True, check=True)
    parts = ["# Source files\n\nThis index is written by `python3 tools/index.py` from the first sentence of each file.\n"]
    folders = {}
    for path in listed.stdout.split():
        if path.endswith(".rs") and not path.endswith("tests.rs") and pathlib.Path(path).exists():
            folder, name = path.rsplit("/", 1)
            folders.setdefault(folder, []).append((name, first_sentence(path)))
    room = {folder: next(i for i, r in enumerate(ROOMS) if (folder + "/").startswith(r + "/")) for folder in folders}
    for folder in sorted(folders, key=lambda f: (room[f], f)):
        parts.append(f"\n## {folder}\n\n| file | content |\n| --- | --- |\n")
        parts += [f"| [{name}](../{folder}/{name}) | {text} |\n" for name, text in folders[folder]]
    return "".join(parts)


if "--check" in sys.argv:
    if not INDEX.exists() or INDEX.read_text(encoding="utf-8") != index():
        sys.exit(f"{INDEX} is out of date: run `python3 tools/index.py`")
else:
    INDEX.write_text(index(), encoding="utf-8")
