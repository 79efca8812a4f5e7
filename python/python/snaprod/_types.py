"""Types of scenes as dicts, for type checkers and editors. The script tools/python_types.py writes this file."""

from __future__ import annotations

from typing import Any, Literal, Sequence, TypedDict, Union

from numpy import float64
from numpy.typing import NDArray

Numbers = Union[Sequence[float], NDArray[float64]]
"""Numbers in a row."""

Table = Union[Sequence[Sequence[float]], NDArray[float64]]
"""Rows of numbers."""

BodyCoupleBlock = TypedDict(
    "BodyCoupleBlock",
    {
        "size": float, "start": float, "until": float,
    },
    total=False,
)

BodyCouplePulse = TypedDict(
    "BodyCouplePulse",
    {
        "amplitude": float, "at": float, "width": float,
    },
    total=False,
)

BodyCoupleRamp = TypedDict(
    "BodyCoupleRamp",
    {
        "from": float, "start": float, "to": float, "until": float,
    },
    total=False,
)

BodyCouple = TypedDict(
    "BodyCouple",
    {
        "amplitude": float, "block": BodyCoupleBlock, "columns": Sequence[str], "constant": float,
        "direction": Numbers, "file": str, "follower": bool, "frequency": float, "phase": float,
        "pulse": BodyCouplePulse, "ramp": BodyCoupleRamp, "table": Table,
    },
    total=False,
)

BodyGrooveCircle = TypedDict(
    "BodyGrooveCircle",
    {
        "axis": Numbers, "centre": Numbers, "radius": float,
    },
    total=False,
)

BodyGrooveLine = TypedDict(
    "BodyGrooveLine",
    {
        "direction": Numbers, "point": Numbers,
    },
    total=False,
)

BodyGroove = TypedDict(
    "BodyGroove",
    {
        "circle": BodyGrooveCircle, "closed": bool, "line": BodyGrooveLine, "spline": Table,
    },
    total=False,
)

BodyGuessRotation = TypedDict(
    "BodyGuessRotation",
    {
        "angle": float, "angle_degrees": float, "axis": Numbers,
    },
    total=False,
)

BodyGuess = TypedDict(
    "BodyGuess",
    {
        "position": Numbers, "quaternion": Numbers, "rotation": BodyGuessRotation,
    },
    total=False,
)

BodyShape = TypedDict(
    "BodyShape",
    {
        "ball": float, "box": Numbers, "capsule": Numbers, "cylinder": Numbers,
    },
    total=False,
)

BodySolid = TypedDict(
    "BodySolid",
    {
        "ball": float, "box": Numbers, "cylinder": Numbers, "density": float,
    },
    total=False,
)

Body = TypedDict(
    "Body",
    {
        "angular_velocity": Numbers, "area": float, "axis": Numbers,
        "couple": Union[float, Union[BodyCouple, Sequence[Any], NDArray[float64]]], "damping": float, "drag": float,
        "force": Union[float, Union[BodyCouple, Sequence[Any], NDArray[float64]]], "groove": BodyGroove,
        "guess": BodyGuess, "inertia": Union[Numbers, Table],
        "joint": Literal["weld", "ball", "hinge", "universal", "slider", "roller"], "mass": float, "name": str,
        "offset": Numbers, "position": Numbers, "quaternion": Numbers, "rest": float, "rotation": BodyGuessRotation,
        "rotational_drag": float, "rotor": Numbers, "second_axis": Numbers,
        "shape": Union[Union[Literal["point"], BodyShape], Union[Literal["point", "solid"], BodyShape]],
        "slide": Numbers, "solid": BodySolid, "stiffness": float, "velocity": Numbers,
    },
    total=False,
)

ClampMotionTranslate = TypedDict(
    "ClampMotionTranslate",
    {
        "amplitude": float, "direction": Numbers, "frequency": float, "phase": float,
    },
    total=False,
)

ClampMotionTurn = TypedDict(
    "ClampMotionTurn",
    {
        "amplitude": float, "axis": Numbers, "frequency": float, "phase": float, "rate": float, "table": Table,
    },
    total=False,
)

ClampMotion = TypedDict(
    "ClampMotion",
    {
        "translate": Union[Table, ClampMotionTranslate], "turn": ClampMotionTurn,
    },
    total=False,
)

Clamp = TypedDict(
    "Clamp",
    {
        "angle": float, "axis": Numbers, "couple": float, "damping": float, "force": float, "free": bool,
        "joint": Union[Literal["weld", "ball", "hinge", "universal", "slider", "roller"], Literal["weld", "hinge"]],
        "motion": ClampMotion, "normal": Numbers, "position": Numbers, "quaternion": Numbers, "rest": float,
        "rotation": BodyGuessRotation, "second_axis": Numbers, "slide": Numbers, "stiffness": float,
        "tangent": Numbers,
    },
    total=False,
)

ContactPairs = TypedDict(
    "ContactPairs",
    {
        "apart": bool, "between": Sequence[str], "friction": float, "restitution": float,
    },
    total=False,
)

Contact = TypedDict(
    "Contact",
    {
        "friction": float, "gap": float, "halve": bool, "law": Literal["stronge", "poisson", "newton"],
        "method": Literal["auto", "exact", "barrier"], "pairs": Sequence[ContactPairs], "restitution": float,
        "rods": Literal["all", "none", "obstacles", "others"], "settle_speed": float, "stick": float,
    },
    total=False,
)

ContinueSecond = TypedDict(
    "ContinueSecond",
    {
        "from": float, "max_step": float, "min_step": float, "parameter": str, "points": int, "step": float,
        "to": float,
    },
    total=False,
)

Continue = TypedDict(
    "Continue",
    {
        "at": Numbers, "back": bool, "both": bool, "deflate": bool, "from": float, "max_step": float,
        "min_step": float,
        "parameter": Union[Literal["outside.pressure", "tube.area"], Literal["membrane.stretch"], str],
        "points": int, "second": ContinueSecond, "step": float, "switch": bool, "to": float,
    },
    total=False,
)

DownstreamFlow = TypedDict(
    "DownstreamFlow",
    {
        "amplitude": float, "block": BodyCoupleBlock, "constant": float, "frequency": float, "phase": float,
        "pulse": BodyCouplePulse, "ramp": BodyCoupleRamp, "table": Table,
    },
    total=False,
)

Downstream = TypedDict(
    "Downstream",
    {
        "closed": bool, "flow": Union[float, DownstreamFlow], "inertance": float,
        "pressure": Union[float, DownstreamFlow], "recovery": float, "resistance": float,
    },
    total=False,
)

EndPose = TypedDict(
    "EndPose",
    {
        "normal": Numbers, "position": Sequence[Union[float, Literal["free"]]], "quaternion": Numbers,
        "rotation": BodyGuessRotation, "tangent": Numbers,
    },
    total=False,
)

End = TypedDict(
    "End",
    {
        "couple": Numbers, "follower": bool, "follower_couple": Numbers, "follower_force": Numbers, "force": Numbers,
        "load": float, "normal": Numbers, "pose": EndPose, "position": Sequence[Union[float, Literal["free"]]],
        "quaternion": Numbers, "rotation": BodyGuessRotation, "tangent": Numbers,
    },
    total=False,
)

Fluid = TypedDict(
    "Fluid",
    {
        "density": float, "friction": Literal["none", "linear", "darcy"], "viscosity": float,
    },
    total=False,
)

Gas = TypedDict(
    "Gas",
    {
        "contents": float, "outside": float, "volume": float,
    },
    total=False,
)

Load = TypedDict(
    "Load",
    {
        "couple": Union[Numbers, Union[BodyCouple, Sequence[Any], NDArray[float64]]], "factor": float,
        "follows": bool, "force": Union[Numbers, Union[BodyCouple, Sequence[Any], NDArray[float64]]], "from": float,
        "on": Union[Literal["end"], str], "rod": str, "s": float, "to": float,
    },
    total=False,
)

LoadsDistributed = TypedDict(
    "LoadsDistributed",
    {
        "polynomial": Table, "table": Table,
    },
    total=False,
)

Loads = TypedDict(
    "Loads",
    {
        "couple": Union[BodyCouple, Sequence[Any], NDArray[float64]], "dead": Numbers,
        "distributed": Union[Numbers, LoadsDistributed], "drag": float, "follower": Union[Numbers, LoadsDistributed],
        "force": Union[Union[BodyCouple, Sequence[BodyCouple]], float, DownstreamFlow, BodyCouple],
        "gravity": Numbers, "load": float, "pressure": Union[float, DownstreamFlow], "rotational_drag": float,
    },
    total=False,
)

MembraneLaw = TypedDict(
    "MembraneLaw",
    {
        "biderman": Numbers, "linear": float, "mooney": Numbers, "neo_hookean": float, "polynomial": Numbers,
        "table": Table,
    },
    total=False,
)

Membrane = TypedDict(
    "Membrane",
    {
        "density": float, "elements": int, "law": MembraneLaw, "radius": float, "shape": Literal["sphere", "disc"],
        "thickness": float,
    },
    total=False,
)

ObstacleBox = TypedDict(
    "ObstacleBox",
    {
        "centre": Numbers, "rotation": BodyGuessRotation, "sides": Numbers,
    },
    total=False,
)

ObstacleCapsule = TypedDict(
    "ObstacleCapsule",
    {
        "from": Numbers, "radius": float, "to": Numbers,
    },
    total=False,
)

ObstacleCylinder = TypedDict(
    "ObstacleCylinder",
    {
        "axis": Numbers, "inside": bool, "point": Numbers, "radius": float,
    },
    total=False,
)

ObstacleDisc = TypedDict(
    "ObstacleDisc",
    {
        "centre": Numbers, "inside": bool, "radius": float,
    },
    total=False,
)

ObstaclePlane = TypedDict(
    "ObstaclePlane",
    {
        "normal": Numbers, "point": Numbers,
    },
    total=False,
)

Obstacle = TypedDict(
    "Obstacle",
    {
        "box": ObstacleBox, "capsule": ObstacleCapsule, "cylinder": ObstacleCylinder, "disc": ObstacleDisc,
        "friction": float, "motion": ClampMotion, "name": str, "plane": ObstaclePlane, "polygon": Table,
        "restitution": float, "segment": ObstacleCapsule, "sphere": ObstacleDisc, "touches": Sequence[str],
    },
    total=False,
)

Outside = TypedDict(
    "Outside",
    {
        "pressure": Union[float, DownstreamFlow],
    },
    total=False,
)

RodDampingBarrier = TypedDict(
    "RodDampingBarrier",
    {
        "half_widths": Numbers, "strength": float,
    },
    total=False,
)

RodDamping = TypedDict(
    "RodDamping",
    {
        "barrier": RodDampingBarrier, "exponent": float, "proportional": float, "rate": float,
        "viscosity": Union[float, Numbers, Table],
    },
    total=False,
)

RodDriveAmplitude = TypedDict(
    "RodDriveAmplitude",
    {
        "amplitude": float, "constant": float, "frequency": float, "mean": float, "phase": float,
        "pulse": BodyCouplePulse, "ramp": BodyCoupleRamp, "table": Table,
    },
    total=False,
)

RodDriveCurvature = TypedDict(
    "RodDriveCurvature",
    {
        "pieces": Table, "polynomial": Numbers, "s": Numbers, "values": Numbers,
    },
    total=False,
)

RodDrive = TypedDict(
    "RodDrive",
    {
        "amplitude": Union[float, RodDriveAmplitude], "curvature": Sequence[Union[float, RodDriveCurvature]],
        "stretch": Union[float, RodDriveCurvature], "twist": Union[float, RodDriveCurvature],
    },
    total=False,
)

RodFrom = TypedDict(
    "RodFrom",
    {
        "axis": Numbers, "body": str, "couple": float, "damping": float, "force": float,
        "joint": Literal["weld", "ball", "hinge", "universal", "slider", "roller"], "motion": ClampMotion,
        "normal": Numbers, "position": Numbers, "quaternion": Numbers, "rest": float, "rotation": BodyGuessRotation,
        "second_axis": Numbers, "slide": Numbers, "stiffness": float, "tangent": Numbers,
    },
    total=False,
)

RodMaterial = TypedDict(
    "RodMaterial",
    {
        "E": float, "G": float, "density": float, "nu": float,
    },
    total=False,
)

RodRelaxationStiffness = TypedDict(
    "RodRelaxationStiffness",
    {
        "proportional": float,
    },
    total=False,
)

RodRelaxation = TypedDict(
    "RodRelaxation",
    {
        "stiffness": Union[float, Numbers, Table, RodRelaxationStiffness], "time": float,
    },
    total=False,
)

RodRestArc = TypedDict(
    "RodRestArc",
    {
        "angle": float, "angle_degrees": float, "radius": float,
    },
    total=False,
)

RodRestCentreline = TypedDict(
    "RodRestCentreline",
    {
        "columns": Sequence[str], "file": str, "normal": Numbers, "pieces": int, "points": Table, "twist": float,
    },
    total=False,
)

RodRestHelix = TypedDict(
    "RodRestHelix",
    {
        "left": bool, "pitch": float, "radius": float, "turns": float,
    },
    total=False,
)

RodRest = TypedDict(
    "RodRest",
    {
        "arc": RodRestArc, "centreline": Union[str, Table, RodRestCentreline],
        "curvature": Sequence[Union[float, RodDriveCurvature]], "helix": RodRestHelix,
        "twist": Union[float, RodDriveCurvature],
    },
    total=False,
)

RodSectionCircle = TypedDict(
    "RodSectionCircle",
    {
        "diameter": Union[float, RodDriveCurvature],
    },
    total=False,
)

RodSectionRectangle = TypedDict(
    "RodSectionRectangle",
    {
        "thickness": Union[float, RodDriveCurvature], "width": Union[float, RodDriveCurvature],
    },
    total=False,
)

RodSectionTube = TypedDict(
    "RodSectionTube",
    {
        "diameter": Union[float, RodDriveCurvature], "thickness": Union[float, RodDriveCurvature],
    },
    total=False,
)

RodSection = TypedDict(
    "RodSection",
    {
        "circle": RodSectionCircle, "rectangle": RodSectionRectangle, "tube": RodSectionTube,
    },
    total=False,
)

RodSection_ = TypedDict(
    "RodSection_",
    {
        "axial": Union[Literal["rigid"], float, RodDriveCurvature], "barrier": RodDampingBarrier,
        "bending": Sequence[Union[Literal["rigid"], float, RodDriveCurvature]], "circle": RodSectionCircle,
        "diameter": Union[float, RodDriveCurvature], "height": Union[float, RodDriveCurvature],
        "law": Literal["linear", "barrier"], "outer_diameter": Union[float, RodDriveCurvature],
        "outer_radius": Union[float, RodDriveCurvature], "poisson": float, "radius": Union[float, RodDriveCurvature],
        "rectangle": RodSectionRectangle, "rigid": Sequence[Literal["u1", "u2", "u3", "v1", "v2", "v3"]],
        "shape": Literal["circle", "rectangle", "tube"],
        "shear": Union[Literal["rigid"], Sequence[Union[float, RodDriveCurvature]]], "shear_factor": float,
        "shear_modulus": float, "stiffness": Table, "thickness": Union[float, RodDriveCurvature],
        "torsion": Union[Literal["rigid"], float, RodDriveCurvature], "torsion_constant": float,
        "tube": RodSectionTube, "width": Union[float, RodDriveCurvature], "young": float,
    },
    total=False,
)

RodTendonOffsetHelix = TypedDict(
    "RodTendonOffsetHelix",
    {
        "distance": float, "phase": float, "turns": float,
    },
    total=False,
)

RodTendonOffset = TypedDict(
    "RodTendonOffset",
    {
        "helix": RodTendonOffsetHelix, "linear": Table, "table": Table,
    },
    total=False,
)

RodTendon = TypedDict(
    "RodTendon",
    {
        "length": float, "offset": Union[Numbers, RodTendonOffset], "tension": Union[float, RodDriveAmplitude],
        "to": float,
    },
    total=False,
)

Rod = TypedDict(
    "Rod",
    {
        "area": float, "base": Literal["wall", "free"], "bending_stiffness": float,
        "bends": Literal["weak", "strong"], "cells": int, "contact_diameter": float,
        "damping": Union[float, RodDamping, Numbers, Table], "density": float,
        "distributed": Union[Numbers, LoadsDistributed], "drive": RodDrive, "from": RodFrom,
        "inertia": Literal["none", "full", "first-order"], "law": MembraneLaw, "length": float, "mass": float,
        "material": Union[Literal["steel", "aluminium", "nitinol", "PET", "silicone"], RodMaterial],
        "model": Union[Literal["elastica"], Literal["cosserat", "elastica"], Literal["cosserat"], Literal["bar"]],
        "name": str, "nodes": int, "relaxation": Sequence[RodRelaxation], "rest": RodRest,
        "scheme": Literal["finite-volume", "spectral", "central-lumped", "central-consistent", "stretch-taylor", "stretch-sequential", "lax-wendroff"],
        "section": Union[RodSection, RodSection_], "section_inertia": Numbers, "tendon": Sequence[RodTendon],
        "tip": Literal["free", "wall"], "to": Union[Literal["free"], RodFrom], "unstable": bool,
    },
    total=False,
)

RunLanding = TypedDict(
    "RunLanding",
    {
        "mode": int, "order": int, "sign": Literal["+", "-"],
    },
    total=False,
)

Run = TypedDict(
    "Run",
    {
        "branches": int, "duration": float, "landing": Union[Literal["viscous", "lowest", "all"], RunLanding],
        "max_snaps": int, "max_steps": int, "method": Literal["auto", "explicit", "implicit", "symmetric"],
        "reduce": bool, "samples": int, "strobe": float, "time_step": float, "tolerance": float,
    },
    total=False,
)

Solve = TypedDict(
    "Solve",
    {
        "path": Literal["auto", "planar", "spatial", "closed-form"], "tolerance": float,
    },
    total=False,
)

StartArea = TypedDict(
    "StartArea",
    {
        "table": Table,
    },
    total=False,
)

StartEquilibrium = TypedDict(
    "StartEquilibrium",
    {
        "couple": Numbers, "force": Numbers,
    },
    total=False,
)

StartRelaxed = TypedDict(
    "StartRelaxed",
    {
        "u1": Numbers, "u2": Numbers, "u3": Numbers, "v1": Numbers, "v2": Numbers, "v3": Numbers,
    },
    total=False,
)

StartSheet = TypedDict(
    "StartSheet",
    {
        "mode": int, "near": float, "sign": Literal["+", "-"],
    },
    total=False,
)

Start = TypedDict(
    "Start",
    {
        "angular_velocity": Numbers, "area": Union[float, StartArea], "at": float, "curvature": Numbers,
        "curvature_rate": Numbers, "equilibrium": StartEquilibrium, "imperfection": float, "kappa": float,
        "lambda": float, "left": Numbers, "p": float, "pose": EndPose, "position": Numbers,
        "relaxed": Union[bool, Numbers, StartRelaxed], "rest": Literal["straight"], "right": Numbers,
        "settled": bool, "sheet": Union[Literal["stable", "lowest"], StartSheet], "strain": StartRelaxed,
        "strain_rate": StartRelaxed, "stretch": float, "velocity": Union[Numbers, float], "with_clamp": bool,
        "wrench": Numbers,
    },
    total=False,
)

Station = TypedDict(
    "Station",
    {
        "name": str, "rod": str, "s": float,
    },
    total=False,
)

TubeLaw = TypedDict(
    "TubeLaw",
    {
        "power": Numbers,
    },
    total=False,
)

TubeLumped = TypedDict(
    "TubeLumped",
    {
        "E": float, "chi": float, "l1": float, "l2": float, "lam": float, "r1": float, "r2": float,
    },
    total=False,
)

TubeMaterial = TypedDict(
    "TubeMaterial",
    {
        "E": float, "nu": float,
    },
    total=False,
)

Tube = TypedDict(
    "Tube",
    {
        "area": float, "cells": int, "law": Union[Literal["ring", "extensible", "neo-hookean"], TubeLaw],
        "length": float, "lumped": TubeLumped, "material": TubeMaterial, "mode": int, "radius": float,
        "stiffness": float, "stretch": float, "tension": float, "thickness": float,
    },
    total=False,
)

Upstream = TypedDict(
    "Upstream",
    {
        "area": float, "closed": bool, "flow": Union[float, DownstreamFlow], "inertance": float,
        "pressure": Union[float, DownstreamFlow], "recovery": float, "resistance": float,
    },
    total=False,
)

Scene = TypedDict(
    "Scene",
    {
        "body": Union[Body, Sequence[Body]], "clamp": Clamp, "contact": Contact, "continue": Continue,
        "downstream": Downstream, "end": End, "fluid": Fluid, "gas": Gas, "load": Sequence[Load], "loads": Loads,
        "membrane": Membrane, "obstacle": Sequence[Obstacle], "outside": Outside, "plane": Numbers,
        "rod": Union[Rod, Sequence[Rod]], "run": Run, "solve": Solve, "start": Start, "station": Sequence[Station],
        "tube": Tube, "units": Literal["si", "dimensionless"], "upstream": Upstream,
    },
    total=False,
)
"""A scene as a dict: every field with its type. Which fields belong together the reader says."""
