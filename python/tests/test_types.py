"""Types of scenes as dicts against the schema of the program."""

import subprocess
import sys
import tomllib
import typing
from pathlib import Path

import snaprod

ROOT = Path(__file__).parents[2]


def test_types_are_those_of_the_schema():
    """Catches a field that was added to scenes and not to their types."""
    schema = subprocess.run([sys.executable, "-m", "snaprod", "schema"], capture_output=True, text=True, check=True).stdout
    script = [sys.executable, str(ROOT / "tools/python_types.py"), "--check"]
    done = subprocess.run(script, input=schema, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_scene_has_the_fields_of_its_type(scenes):
    """Catches a table of the scenes that the types lack, or one under a wrong name."""
    fields = typing.get_type_hints(snaprod.Scene)
    paths = sorted(scenes.glob("*.toml"))
    assert len(paths) > 40
    for path in paths:
        for name, table in tomllib.loads(path.read_text()).items():
            kinds = [kind for kind in (fields[name], *typing.get_args(fields[name])) if typing.is_typeddict(kind)]
            rows = table if isinstance(table, list) else [table]
            for row in rows:
                if kinds and isinstance(row, dict):
                    assert set(row) <= set(kinds[0].__annotations__), (path.name, name)


def test_messages_to_dicts_speak_of_dicts(snap):
    """Catches advice in TOML for those who write dicts, and the other way round."""
    del snap["body"], snap["rod"]["length"]
    words = {snaprod.Scene: ['"length": 1.0', "a dict with mass"], str: ["`length = 1.0` in [rod]", "a table with mass"]}
    text = '[rod]\nmodel = "elastica"\n[run]\nduration = 1.0\n'
    for kind, scene in ((snaprod.Scene, snap), (str, text)):
        try:
            snaprod.check(scene)
        except snaprod.SceneError as error:
            assert all(word in str(error) for word in words[kind]), str(error)
        else:
            raise AssertionError("a scene without a body")
