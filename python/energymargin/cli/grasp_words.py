"""Options of `energymargin grasps`, and what their words mean: hands, protocols, beliefs, frames,
rows."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from cyclopts import Parameter

import energymargin as em
from energymargin.base.checks import check_type, one_of, shown, whole_number
from energymargin.cli.options import panel, parsed, split

Made = TypeVar("Made")
OF_FILE = {
    "scale=0.001": "--scale 0.001",
    "object is None": "--object-pose is not given",
    "frame is None": "--frame is not given",
    "need object=": "need --object-pose",
}
OF_OBJECT = {
    "mesh is None": "--object is not given",
    "mass is None and density is None": "--mass is not given",
    "scale=0.001": "--mesh-scale 0.001",
    "object= of em.grasps.read": "--object-pose",
}
SIGNED, MAIN = Parameter(allow_leading_hyphen=True), Parameter(group="Parameters")


@panel("Which grasps of the file", "*")
@dataclass(frozen=True, eq=False)
class Rows:
    """The grasps of a file that are asked about."""

    frame: Annotated[str | None, SIGNED] = None
    """What its poses are of: grasp (midway between the pads, z the approach, x the way the fingers
    open), franka_panda, panda_hand, panda_tcp, robotiq_2f_85, robotiq_2f_140, a distance along z
    [m], or x,y,z,qx,qy,qz,qw. Needed for GraspGen's and isaac_grasp's."""
    scale: float = 1.0
    """What makes metres of its lengths."""
    where: list[str] | None = None
    """Rows with these values alone: COLUMN=VALUE, with commas between; may be repeated."""
    most: int | None = None
    """At most so many of the rows, evenly spaced."""
    object_pose: Annotated[str | None, SIGNED] = None
    """Where the object is, if the poses are not in its frame: x,y,z,qx,qy,qz,qw, or a CSV file with
    columns in common, as layout and object."""

    def read(self, file: Path) -> em.grasps.GraspSet:
        """The grasps. Raises ValueError on those of several objects."""
        pose: Path | list[float] | None = None
        if self.object_pose is not None:
            there = Path(self.object_pose).exists()
            pose = Path(self.object_pose) if there else numbers("--object-pose", self.object_pose)
        frame = None if self.frame is None else chosen_frame(self.frame)
        rows = chosen_rows(self.where or [])
        with arguments_as_options(OF_FILE):
            found = em.grasps.read(file, frame=frame, object=pose, where=rows, scale=self.scale)
        if self.most is not None and whole_number("--most", self.most, 1) < len(found):
            found = found[np.linspace(0, len(found) - 1, self.most).round().astype(int)]
        objects = list(dict.fromkeys(found.columns.get("object", ())))
        if len(objects) > 1:
            text = f"{file} has grasps of {len(objects)} objects"
            raise ValueError(f"{text}, expected one of them: --where object={objects[0]}")
        return found


@panel("The object", "*")
@dataclass(frozen=True)
class Thing:
    """Arguments of `GraspObject.of`."""

    mesh: Annotated[Path | None, MAIN, Parameter(name="--object")] = None
    """The object's mesh or URDF, if the file of grasps does not name it."""
    mass: Annotated[float | None, MAIN] = None
    """Mass of the object [kg], if the file does not say it."""
    density: float | None = None
    """In place of the mass [kg/m^3]."""
    friction: float | None = None
    """Coefficient of its surface; that of a contact is its product with the hand's. That of the
    file, or else 0.5."""
    scale: Annotated[float | None, Parameter(name="--mesh-scale")] = None
    """What makes metres of the mesh's lengths."""
    accuracy: float | None = None
    """The mesh's convex parts are nowhere farther from it [m]."""


TRIAL = panel("What a trial is", "*")


@TRIAL
@dataclass(frozen=True)
class TrialOptions:
    """Arguments of `em.grasps.score`."""

    rollouts: Annotated[int, MAIN] = 30
    """Trials of each grasp."""
    colliding: Literal["lost", "redraw", "retreat"] = "lost"
    """What is done with a draw that puts the hand into the object or the table: it counts as lost,
    or redraw its pose, or retreat along the approach."""
    step: float | None = None
    """Of the simulation [s], 1/960 by default. 0.004 is faster, and holds too much."""
    seed: int = 0
    """The same seed gives the same numbers, to the last bit."""
    effort: int | None = None
    """Also search for the least effort of escape at the weakest moment, with so many nodes."""


@contextmanager
def arguments_as_options(options: Mapping[str, str]) -> Iterator[None]:
    """Errors name the options of the command where they name arguments of Python."""
    try:
        yield
    except ValueError as error:
        text = str(error)
        for argument, option in options.items():
            text = text.replace(argument, option)
        raise ValueError(text) from error


def chosen_hand(text: str) -> em.grasps.Hand:
    """The hand of --hand. Raises ValueError on what is none."""
    hands = em.grasps.HANDS
    if text in hands:
        return hands[text]
    if Path(text).suffix in (".urdf", ".xml"):
        hand = {"path": text, "close": {"JOINT": ["OPEN", "CLOSED"]}, "fingers": ["LINK", "LINK"]}
        way = json.dumps({**hand, "frame": "LINK"})
        raise ValueError(f"--hand is {text!r}, expected {', '.join(hands)}, or of a file '{way}'")
    given = _given("--hand", text, hands)
    if "path" in given:
        if given.get("pads") is not None:
            check_type("--hand pads", given["pads"], Mapping, "JSON of links and their pads")
            pads = given["pads"].items()
            given["pads"] = {link: _with("--hand pads", em.Pad, pad) for link, pad in pads}
        return _with("--hand", em.grasps.HandFile, given)
    if given.get("pads") is not None:
        given["pads"] = _with("--hand pads", em.Pad, given["pads"])
    return _with("--hand", em.grasps.ParallelGripper, given, hands)


def chosen_protocol(text: str) -> em.grasps.Protocol:
    """The protocol of --protocol. Raises ValueError on what is none."""
    protocols = em.grasps.PROTOCOLS
    if text in protocols:
        return protocols[text]
    given = _given("--protocol", text, protocols)
    for number, motion in enumerate(given.get("motions", [])):
        given["motions"][number] = _with("--protocol motions", em.grasps.Motion, motion)
    return _with("--protocol", em.grasps.Protocol, given, protocols)


def chosen_belief(text: str | None) -> em.grasps.GraspBelief | str | None:
    """The belief of --belief, or its name; distributions are those of an Uncertainty in JSON.
    Raises ValueError on what is none."""
    if text is None or text == "lab":
        return text
    given = _given("--belief", text)
    values = {"about": given.pop("about", "grasp"), "relative": bool(given.pop("relative", False))}
    for name, value in given.items():
        own = {"mass" if name == "force" else name: value}
        one_of("--belief", name, ("pose", "friction", "mass", "force", "about"))
        (values[name],) = em.beliefs.Uncertainty.from_json(json.dumps(own)).given.values()
    return em.grasps.GraspBelief(**values)


def chosen_frame(text: str) -> Any:
    """The frame of --frame: a name, a distance, or a pose."""
    if text in em.grasps.FRAMES:
        return text
    try:
        values = numbers("--frame", text)
    except ValueError as error:
        raise ValueError(f"{error}, or one of {', '.join(em.grasps.FRAMES)}") from None
    return values[0] if len(values) == 1 else values


def chosen_rows(texts: list[str]) -> dict[str, list[Any]]:
    """The values of each column of --where."""
    rows: dict[str, list[Any]] = {}
    for word in (word for text in texts for word in split(text)):
        name, equals, value = word.partition("=")
        if not equals:
            raise ValueError(f"--where is {word!r}, expected COLUMN=VALUE")
        (plain,) = parsed([f"value={value}"]).values()
        rows.setdefault(name, []).append(plain)
    return rows


def numbers(option: str, text: str) -> list[float]:
    """Numbers with commas between. Raises ValueError on other text."""
    try:
        return [float(word) for word in split(text)]
    except ValueError:
        raise ValueError(f"{option} is {text!r}, expected numbers with commas between") from None


def _with(
    option: str, kind: type[Made], given: Any, presets: Mapping[str, Made] | None = None
) -> Made:
    """An instance with these fields, or the "preset" among them with the others changed. Raises
    ValueError on others, and on those that are missing."""
    check_type(option, given, Mapping, "JSON such as {...}")
    name = given.pop("preset", None) if presets else None
    known = {field.name: field for field in fields(kind)}  # type: ignore[arg-type]
    if unknown := [name for name in given if name not in known]:
        raise ValueError(f"{option} has {unknown[0]!r}, expected some of {', '.join(known)}")
    if presets and name is not None:
        preset = presets[one_of(f"{option} preset", name, tuple(presets))]
        return replace(preset, **given)  # type: ignore[type-var]
    lacks = [n for n, f in known.items() if f.default is f.default_factory is MISSING]
    if missing := [name for name in lacks if name not in given]:
        raise ValueError(f"{option} has no {missing[0]!r}, expected at least {', '.join(lacks)}")
    return kind(**given)


def _given(option: str, text: str, presets: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """A JSON object, or the one in a file. Raises ValueError on other text."""
    names = "".join(f"{name}, " for name in presets or ())
    expected = f"expected {names}JSON such as {{...}}, or a file of it"
    if not text.lstrip().startswith("{"):
        if not Path(text).is_file():
            raise ValueError(f"{option} is {text!r}, {expected}")
        text = Path(text).read_text()
    try:
        given = json.loads(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"{option} is {shown(text)}, {expected}: {error}") from error
    if not isinstance(given, dict):
        raise ValueError(f"{option} is {shown(text)}, {expected}")
    return given
