"""Cables of MuJoCo as scenes, through MuJoCo's own parser."""

from __future__ import annotations

from os import PathLike, fspath
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

PLUGIN = "mujoco.elasticity.cable"
"""The plugin whose elements are a cable."""

UNEVEN = 1e-4
"""Largest difference of the lengths of elements, over their length, and of the turns between neighbours, in radians, of a
uniform cable. MuJoCo keeps places in single precision."""


def from_mjcf(source: Union[str, "PathLike[str]"], duration: float | None = None) -> dict[str, Any]:
    """Reads the cable of a MuJoCo model as a scene of one rod.

    The elements of the cable become one rod that bends and twists, and that neither shears nor stretches, as MuJoCo's
    cable. Length, mass, stiffnesses, place and gravity are those of the compiled model. Friction of the joints counts
    as viscosity along the rod: friction times the length of an element. Contacts, actuators and other bodies are left
    out. The tangent d3 of the rod is the x axis of the elements, d1 is their y axis.

    Parameters
    ----------
    source : str or path
        MJCF as text, or the path of a file.
    duration : float, optional
        Duration of a motion of the rod with all of its mass, from the shape of the file. Without it the scene is one of
        statics, the cable at rest under its weight.

    Returns
    -------
    dict
        The scene, which can be changed, run, or written as TOML.

    Raises
    ------
    ImportError
        MuJoCo is not installed: ``pip install "mujoco<4"``.
    ValueError
        A model without a cable, or with several; elements that differ; a cable that is curved unevenly without
        ``flat``, or whose shape is not its unloaded shape; an end that is held.
    """
    try:
        import mujoco
    except ImportError:
        raise ImportError('from_mjcf reads files by MuJoCo\'s own parser: pip install "mujoco<4"') from None
    text = fspath(source)
    read = mujoco.MjModel.from_xml_string if "<" in text else mujoco.MjModel.from_xml_path
    model = read(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bend, twist, flat = _attributes(mujoco, model)
    bodies = np.flatnonzero(model.body_plugin >= 0)
    if not np.array_equal(model.body_parentid[bodies[1:]], bodies[:-1]):
        raise ValueError("the elements of the cable are not one chain: several cables are several scenes")
    if model.neq:
        raise ValueError("the model has equality constraints, which may hold the end of the cable: leave them out")
    length = _element(model, bodies)
    quaternions = data.xquat[bodies]
    turn = _uniform_turn(quaternions)
    if flat and np.linalg.norm(turn) > UNEVEN:
        raise ValueError("flat = true: the cable is straight without load and curved in the file; start from a straight cable")
    bending, torsion = _stiffness(mujoco, model, bodies[0], bend, twist)
    # Turns about the x, y and z axes of the elements are those about d3, d1 and d2.
    curvature = turn / length
    rod: dict[str, Any] = {
        "model": "cosserat",
        "length": length * len(bodies),
        "mass": float(model.body_mass[bodies].sum()),
        "section": {"bending": bending, "torsion": torsion},
    }
    if np.linalg.norm(turn) > UNEVEN:
        rod["rest"] = {"curvature": [float(curvature[1]), float(curvature[2])], "twist": float(curvature[0])}
    clamp: dict[str, Any] = {
        "position": data.xpos[bodies[0]].tolist(),
        "quaternion": _product(quaternions[0], np.array([0.5, 0.5, 0.5, 0.5])).tolist(),
    }
    scene: dict[str, Any] = {
        "units": "si",
        "rod": rod,
        "clamp": clamp,
        "loads": {"gravity": model.opt.gravity.tolist()},
    }
    joints = model.body_jntnum[bodies[0]]
    kind = mujoco.mjtJoint(int(model.jnt_type[model.body_jntadr[bodies[0]]])) if joints else None
    if duration is None:
        if kind is not None:
            raise ValueError("at rest the first element must be held, initial = \"none\": give a duration, or hold it")
        return scene | {"end": {}}
    if kind == mujoco.mjtJoint.mjJNT_FREE:
        scene["clamp"] = clamp | {"free": True}
    elif kind is not None:
        scene["clamp"] = clamp | {"joint": "ball"}
    rod["inertia"] = "full"
    friction = float(model.dof_damping[model.body_dofadr[bodies[1]]]) * length
    if friction > 0.0:
        rod["damping"] = {"viscosity": [friction] * 6}
    return scene | {"run": {"duration": float(duration), "tolerance": 1e-4}, "start": {"rest": "straight"}}


def _attributes(mujoco: Any, model: Any) -> tuple[float, float, bool]:
    """Returns the moduli of bending and twist, and whether the unloaded cable is straight."""
    found = sorted(set(model.body_plugin[model.body_plugin >= 0].tolist()))
    if len(found) != 1:
        raise ValueError(f"the model must have one cable, the plugin {PLUGIN}: it has {len(found)} plugins on bodies")
    start = model.plugin_attradr[found[0]]
    twist, bend, flat = bytes(model.plugin_attr[start:]).split(b"\0")[:3]
    return float(bend), float(twist), flat == b"true"


def _element(model: Any, bodies: NDArray[np.int64]) -> float:
    """Returns the length of an element; all have the same."""
    lengths = np.linalg.norm(model.body_pos[bodies[1:]], axis=1)
    if len(bodies) < 2 or np.ptp(lengths) > UNEVEN * lengths.max():
        raise ValueError("the elements of the cable must be two at least, and of one length")
    return float(lengths.mean())


def _uniform_turn(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the rotation vector from each element to the next, the same all along."""
    conjugate = quaternions * np.array([1.0, -1.0, -1.0, -1.0])
    steps = np.array([_product(a, b) for a, b in zip(conjugate[:-1], quaternions[1:])])
    steps *= np.where(steps[:, :1] < 0.0, -1.0, 1.0)
    sines = np.linalg.norm(steps[:, 1:], axis=1, keepdims=True)
    angles = 2.0 * np.arctan2(sines, steps[:, :1])
    turns = np.where(sines > 0.0, angles / np.where(sines > 0.0, sines, 1.0), 2.0) * steps[:, 1:]
    if np.abs(turns - turns[0]).max() > UNEVEN:
        raise ValueError("the cable is curved unevenly: write its points into a file, and read them by rest = { centreline }")
    return turns[0]


def _stiffness(mujoco: Any, model: Any, body: int, bend: float, twist: float) -> tuple[list[float], float]:
    """Returns the stiffnesses as the plugin has them: bending about y and z of an element, torsion about x."""
    geom = model.body_geomadr[body]
    size, kind = model.geom_size[geom], mujoco.mjtGeom(int(model.geom_type[geom]))
    if kind in (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER):
        second = np.pi * size[0] ** 4 / 4.0
        return [float(bend * second)] * 2, float(twist * 2.0 * second)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        height, width = size[1], size[2]
        a, b = max(height, width), min(height, width)
        polar = a * b**3 * (16.0 / 3.0 - 3.36 * b / a * (1.0 - b**4 / a**4 / 12.0))
        about_y, about_z = (2.0 * width) ** 3 * 2.0 * height / 12.0, (2.0 * height) ** 3 * 2.0 * width / 12.0
        return [float(bend * about_y), float(bend * about_z)], float(twist * polar)
    raise ValueError("the elements of a cable are capsules, cylinders or boxes")


def _product(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the product of two quaternions (w, x, y, z)."""
    (a, u), (b, v) = (p[0], p[1:]), (q[0], q[1:])
    return np.concatenate([[a * b - u @ v], a * v + b * u + np.cross(u, v)])
