"""What the words of `energymargin grasps` mean: hands, protocols, beliefs, frames, rows."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from energymargin.base.checks import check_type, one_of, shown
from energymargin.cli.fields import split
from energymargin.cli.options import parsed

if TYPE_CHECKING:
    from energymargin.grasps import GraspBelief, Hand, Protocol

Made = TypeVar("Made")


def chosen_hand(text: str) -> Hand:
    """The hand of --hand. Raises ValueError on what is none."""
    from energymargin.grasps import FRAMES, HandFile, ParallelGripper
    from energymargin.grasps.hands import PRESETS

    if text in PRESETS:
        return PRESETS[text]
    given = _given("--hand", text, PRESETS)
    if "path" in given:
        if isinstance(given.get("frame"), str):
            given["frame"] = FRAMES[one_of("--hand frame", given["frame"], tuple(FRAMES))]
        return _with("--hand", HandFile, given)
    return _with("--hand", ParallelGripper, given, _preset("--hand", given, PRESETS))


def chosen_protocol(text: str) -> Protocol:
    """The protocol of --protocol. Raises ValueError on what is none."""
    from energymargin.grasps import Motion, Protocol
    from energymargin.grasps.protocols import PRESETS

    if text in PRESETS:
        return PRESETS[text]
    given = _given("--protocol", text, PRESETS)
    for number, motion in enumerate(given.get("motions", [])):
        given["motions"][number] = _with("--protocol motions", Motion, motion)
    return _with("--protocol", Protocol, given, _preset("--protocol", given, PRESETS))


def chosen_belief(text: str | None) -> GraspBelief | None:
    """The belief of --belief; distributions are those of an Uncertainty in JSON. Raises ValueError
    on what is none."""
    if text is None:
        return None
    from energymargin.beliefs import Uncertainty
    from energymargin.grasps import GraspBelief

    given = _given("--belief", text)
    values = {"about": given.pop("about", "grasp")}
    for name, value in given.items():
        own = {"mass" if name == "force" else name: value}
        one_of("--belief", name, ("pose", "friction", "mass", "force", "about"))
        (values[name],) = Uncertainty.from_json(json.dumps(own)).given.values()
    return GraspBelief(**values)


def chosen_frame(text: str) -> Any:
    """The frame of --frame: a name, a distance, or a pose."""
    from energymargin.grasps import FRAMES

    if text in FRAMES:
        return text
    try:
        values = numbers("--frame", text)
    except ValueError as error:
        raise ValueError(f"{error}, or one of {', '.join(FRAMES)}") from None
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


def _preset(option: str, given: dict[str, Any], presets: Mapping[str, Made]) -> Made | None:
    """The preset that is changed; None if none is named."""
    name = given.pop("preset", None)
    return None if name is None else presets[one_of(f"{option} preset", name, tuple(presets))]


def _with(option: str, kind: type[Made], given: Any, preset: Made | None = None) -> Made:
    """An instance with these fields, or a preset with these changed. Raises ValueError on others,
    and on those that are missing."""
    check_type(option, given, Mapping, "JSON such as {...}")
    known = {field.name: field for field in fields(kind)}  # type: ignore[arg-type]
    if unknown := [name for name in given if name not in known]:
        raise ValueError(f"{option} has {unknown[0]!r}, expected some of {', '.join(known)}")
    if preset is not None:
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
