#!/usr/bin/env python3
"""Writes python/python/snaprod/_types.py, the types of scenes as dicts, from the JSON Schema of `snaprod schema`.

    snaprod schema | python3 tools/python_types.py            writes the file
    snaprod schema | python3 tools/python_types.py --check    fails if the file is out of date
"""

import json
import pathlib
import sys

TARGET = pathlib.Path(__file__).parents[1] / "python/python/snaprod/_types.py"
HEAD = '''"""Types of scenes as dicts, for type checkers and editors. The script tools/python_types.py writes this file."""

from __future__ import annotations

from typing import Any, Literal, Sequence, TypedDict, Union

from numpy import float64
from numpy.typing import NDArray

Numbers = Union[Sequence[float], NDArray[float64]]
"""Numbers in a row."""

Table = Union[Sequence[Sequence[float]], NDArray[float64]]
"""Rows of numbers."""
'''


class Types:
    """Types that are needed so far, each with the source of its definition."""

    def __init__(self) -> None:
        self.sources: dict[str, str] = {}
        self.names: dict[str, str] = {}

    def of(self, schema: dict, path: list[str]) -> str:
        """Returns the type of a value."""
        if "enum" in schema or "const" in schema:
            words = schema.get("enum", [schema.get("const")])
            return f"Literal[{', '.join(json.dumps(word) if isinstance(word, str) else repr(word) for word in words)}]"
        if branches := schema.get("anyOf", schema.get("oneOf")):
            return union([self.of(one, path) for one in branches])
        kind = schema.get("type")
        if isinstance(kind, list):
            return union([self.of({**schema, "type": one}, path) for one in kind])
        if kind == "array":
            return self.array(schema, path)
        if kind == "object" and schema.get("properties"):
            return self.table(schema, path)
        plain = {"number": "float", "integer": "int", "string": "str", "boolean": "bool", "null": "None"}
        return plain.get(kind, "Any")

    def array(self, schema: dict, path: list[str]) -> str:
        """Returns the type of a sequence."""
        inner = self.of(schema.get("items", {}), path)
        return {"float": "Numbers", "int": "Sequence[int]", "Numbers": "Table"}.get(inner, f"Sequence[{inner}]")

    def table(self, schema: dict, path: list[str]) -> str:
        """Returns the name of the type of a table. Tables of the same fields share a type."""
        fields = {name: self.of(one, [*path, name]) for name, one in schema["properties"].items()}
        body = filled([f"{json.dumps(name)}: {kind}," for name, kind in sorted(fields.items())])
        if body in self.names:
            return self.names[body]
        name = "".join(part.title().replace("_", "") for part in path) or "Scene"
        while name in self.sources:
            name += "_"
        self.names[body] = name
        self.sources[name] = f"{name} = TypedDict(\n    {json.dumps(name)},\n    {{\n{body}\n    }},\n    total=False,\n)\n"
        return name


def filled(fields: list[str]) -> str:
    """Returns lines with as many fields as they have room for."""
    lines = [" " * 7]
    for field in fields:
        if len(lines[-1]) > 8 and len(lines[-1]) + len(field) > 116:
            lines.append(" " * 7)
        lines[-1] += " " + field
    return "\n".join(lines)


def union(kinds: list[str]) -> str:
    """Returns the union of types, each once."""
    parts: list[str] = []
    for kind in kinds:
        inner = kind.removeprefix("Union[").removesuffix("]").split(", ") if kind.startswith("Union[") and kind.count("[") == 1 else [kind]
        parts += [part for part in inner if part not in parts]
    if "float" in parts and "int" in parts:
        parts.remove("int")
    rows = [part for part in parts if part == "Numbers" or part.startswith("Sequence[")]
    if len(rows) > 1:
        # mypy does not tell sequences of numbers from those of tables inside of a literal.
        parts = [part for part in parts if part not in rows] + ["Sequence[Any]", "NDArray[float64]"]
    return parts[0] if len(parts) == 1 else f"Union[{', '.join(parts)}]"


def main() -> None:
    types = Types()
    types.of(json.load(sys.stdin), [])
    text = HEAD + "".join("\n" + source for source in types.sources.values())
    text += '"""A scene as a dict: every field with its type. Which fields belong together the reader says."""\n'
    if "--check" not in sys.argv:
        TARGET.write_text(text, encoding="utf-8")
    elif TARGET.read_text(encoding="utf-8") != text:
        sys.exit(f"{TARGET} is out of date: snaprod schema | python3 tools/python_types.py")


main()
