"""Signs that a unit is wrong, or that columns are swapped: motions that no camera sees."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from energymargin.recordings.csv_files import UNITS, FrameTable, SourceFile, of_body

__all__ = ["require_agreement", "require_clock", "require_units"]

FARTHEST = 50.0  # m, from the frame's origin
MOST_TURNED = 4 * math.pi  # rad
FASTEST = 10.0  # m/s
FASTEST_TURN = 20.0  # rad/s
USUAL = 75.0  # percent of the frames, of which a rate is judged: outliers are fewer
RESTARTED = 0.1  # of an episode: numbers that fall to its beginning start another
STEPS = (5e-4, 0.5)  # s; a frame's
TIME_UNITS = {"ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}

DISAGREEMENT = 0.5  # of the larger velocity
LEAST_DISAGREEMENT = (0.01, 0.2)  # m/s, rad/s; three times what noise makes of poses


def require_clock(table: FrameTable) -> None:
    """Raises ValueError unless frames and times rise, and the time step is plausible."""
    for name in ("frame", "time"):
        values = table.values[name]
        falls = np.flatnonzero(np.diff(values) <= 0)
        if len(falls):
            _refuse_falls(table, name, falls + 1)
    step = float(np.median(np.diff(table.values["time"])))
    if not STEPS[0] <= step <= STEPS[1]:
        raise table.source.error(
            f"its frames are {step:.3g} s apart, expected {STEPS[0]:g} to {STEPS[1]:g} s: "
            f"is the time in {_likely_unit(step)}? {table.source.of_units}"
        )


def _refuse_falls(table: FrameTable, name: str, rows: NDArray[np.int64]) -> None:
    """Raises ValueError: at these rows, from 1 on, the frame or the time does not rise."""
    values, k = table.values[name], int(rows[0])
    text = f"{name} is {values[k]:.10g} after {values[k - 1]:.10g}, expected it to rise"
    again = values[0] + RESTARTED * (values[k - 1] - values[0])
    if values[rows].max() < again:
        text += f". Are these {len(rows) + 1} episodes? Cut the file there: each is a recording"
    elif values[k] < values[k - 1]:
        text += ". Was the clock set? Cut the file there"
    raise table.source.error(text, int(table.lines[k]))


def _likely_unit(step: float) -> str:
    """The unit of a time whose steps, taken for seconds, are too long or too short."""
    fits = [unit for unit, size in UNITS["time"].items() if step * size <= STEPS[1]]
    return TIME_UNITS[fits[0]] if step > STEPS[1] and fits else "another unit"


def require_units(table: FrameTable, body: str) -> None:
    """Raises ValueError unless positions, angles and their rates are plausible on a table."""
    poses, _ = of_body(body)
    for name in poses:
        angle = name.endswith("yaw")
        far = np.abs(table.values[name]) > (MOST_TURNED if angle else FARTHEST)
        if far.any():
            k = int(np.argmax(far))
            raise table.source.error(
                f"{name} is {table.values[name][k]:.6g} {'rad' if angle else 'm'}, "
                + (
                    f"expected at most {MOST_TURNED:.4g}: is it in degrees? "
                    if angle
                    else f"expected at most {FARTHEST:g}: is it in millimetres or centimetres? "
                )
                + table.source.of_units,
                int(table.lines[k]),
            )
    times, x, y, yaw = (table.values[name] for name in ("time", *poses))
    moves, turns = np.hypot(np.diff(x), np.diff(y)), np.angle(np.exp(1j * np.diff(yaw)))
    speed, rate = _usual(moves / np.diff(times)), _usual(np.abs(turns) / np.diff(times))
    if speed > FASTEST:
        raise table.source.error(
            f"{poses[0]}, {poses[1]} change by {speed:.3g} m/s from frame to frame, expected at "
            f"most {FASTEST:g}: are they in millimetres or centimetres? "
            f"{table.source.of_units}"
        )
    if rate > FASTEST_TURN:
        raise table.source.error(
            f"{poses[2]} changes by {rate:.3g} rad/s from frame to frame, expected at most "
            f"{FASTEST_TURN:g}: is it in degrees? {table.source.of_units}"
        )


def _usual(rates: NDArray[np.float64]) -> float:
    seen = rates[np.isfinite(rates)]
    return float(np.percentile(seen, USUAL)) if len(seen) else 0.0


def require_agreement(
    source: SourceFile,
    body: str,
    given: NDArray[np.float64],
    derived: NDArray[np.float64],
    of_other: NDArray[np.float64] | None,
) -> None:
    """Raises ValueError if a file's velocities, shape (N, 3), contradict those of its poses.

    The root mean square of their difference may be half of the larger one's, and a bit more.
    `of_other`: the file's velocities of the other body.
    """
    poses, rates = of_body(body)
    for columns, least in zip((slice(0, 2), slice(2, 3)), LEAST_DISAGREEMENT, strict=True):
        if not _contradict(given[:, columns], derived[:, columns], least):
            continue
        unit = "m/s" if columns.stop == 2 else "rad/s"
        raise source.error(
            f"{', '.join(rates[columns])} contradict the changes of {', '.join(poses[columns])}: "
            f"{_rms(given[:, columns]):.3g} {unit} (root mean square) in the file, "
            f"{_rms(derived[:, columns]):.3g} by the poses, "
            f"{_rms((given - derived)[:, columns]):.3g} apart; expected the same. "
            + _explanation(given, derived, of_other, columns, least)
        )


_CHANGES: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "x and y are swapped": lambda rates: rates[:, [1, 0, 2]],
    "their signs are turned": lambda rates: -rates,
    "the velocities are in mm or the time is in ms": lambda rates: rates / 1e3,
    "the poses are in mm": lambda rates: rates * 1e3,
    "the velocities are in cm": lambda rates: rates / 1e2,
    "the poses are in cm": lambda rates: rates * 1e2,
    "the velocities are in degrees": np.radians,
    "the poses are in degrees": np.degrees,
}


def _explanation(
    given: NDArray[np.float64],
    derived: NDArray[np.float64],
    of_other: NDArray[np.float64] | None,
    columns: slice,
    least: float,
) -> str:
    """The change that makes both velocities agree best, if they then agree."""
    changed = {reason: change(given)[:, columns] for reason, change in _CHANGES.items()}
    if of_other is not None:
        changed["they are those of the other body"] = of_other[:, columns]
    differences = {reason: _rms(rates - derived[:, columns]) for reason, rates in changed.items()}
    reason = min(differences, key=lambda reason: differences[reason])
    if _contradict(changed[reason], derived[:, columns], least):
        return "Are columns swapped, or units others? They may be left out"
    return f"It would fit if {reason}"


def _contradict(given: NDArray[np.float64], derived: NDArray[np.float64], least: float) -> bool:
    allowed = DISAGREEMENT * max(_rms(given), _rms(derived)) + least
    return _rms(given - derived) > allowed


def _rms(rates: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.sum(np.square(rates), axis=1))))
