"""What of a MuJoCo model is not simulated: counted, named, and left out if that is meant."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable

from energymargin.scenes.additions import NO_DRIVE, NotSimulatedError, warn_of_loose

FEATURES = {
    "actuator/activation": "activation dynamics; the control acts at once",
    "actuator/motor": "forces without position or velocity control; they are 0",
    "actuator/site": "actuators of sites, bodies, free and ball joints, slider-cranks; left out",
    "actuator/tendon": "actuators of tendons that are not simulated; left out",
    "actuator/gain": "muscles, PID, DC motors, own gains and unstable ones; left out",
    "actuator.damping": "damping, armature and delay of the actuator itself; left out",
    "actuator.forcerange": (
        "limits that are uneven, or of one actuator beside others or a spring of the joint; the "
        "larger of the two, or the sum of the actuators', limits all of it"
    ),
    "equality/connect": "left out",
    "equality/weld": "left out",
    "equality/joint": "couplings that are not linear, or of more than two joints; left out",
    "equality/tendon": "the same, of tendons; left out",
    "equality/distance": "left out",
    "flex": "deformable bodies; left out",
    "geom/hfield": "height fields; left out",
    "geom/sdf": "signed distance functions; left out",
    "geom.adhesion": "adhesion and moving surfaces; left out",
    "geom.condim": "torsional and rolling friction; contacts slide with friction alone",
    "geom.margin": "contacts before geoms touch; they begin where these do",
    "joint/ball": "the body is fixed to its parent, as it starts",
    "joint.armature": "rotor inertia of free joints; left out",
    "joint.damping": "of free joints, and polynomials; left out",
    "joint.frictionloss": "dry friction of a joint; left out",
    "joint.stiffness": "of free joints, polynomials and springs that yield; left out",
    "option/fluid": "density, viscosity and wind; left out",
    "option/override": "contacts' overridden parameters; the geoms' own hold",
    "pair.friction": "another friction along each tangent; the first one holds",
    "plugin": "left out",
    "tendon": "tendons with a limit, a spring or damping that no single joint can have; left out",
    "tendon.frictionloss": "dry friction of a tendon; left out",
}
"""What `ignore` may name, and what happens then."""

OF_BODIES = ("equality/connect", "equality/weld")
LEAVES = {
    **dict.fromkeys(("actuator/motor", "actuator/tendon", "actuator/gain"), NO_DRIVE),
    **dict.fromkeys(("equality/joint", "equality/tendon"), "joints that follow no other"),
    **dict.fromkeys(OF_BODIES, "bodies without what held them"),
    "tendon": "joints without the limits and springs of their tendons",
}
"""By what `ignore` names, what moves freely then."""


class Features:
    """Counts what is not simulated, but for what is ignored, and names what that leaves loose."""

    def __init__(self, ignore: Collection[str]) -> None:
        """Raises ValueError on a name that is not in FEATURES."""
        for name in ignore:
            if name not in FEATURES:
                raise ValueError(f"ignore has {name!r}, expected one of {', '.join(FEATURES)}")
        self._ignored = frozenset(ignore)
        self._found: Counter[str] = Counter()
        self._loose: dict[str, list[str]] = {}

    def add(self, name: str, count: int = 1, loose: Iterable[str] = ()) -> None:
        """Something of a name in FEATURES is there. `loose`: the joints or bodies that it moves or
        holds, by name, which nothing does without it."""
        if count and name not in self._ignored:
            self._found[name] += int(count)
        elif count and name in LEAVES:
            own = self._loose.setdefault(name, [])
            own.extend(one for one in loose if one not in own)

    def require_none(self, source: str) -> None:
        """Raises NotSimulatedError that names all that was added."""
        if self._found:
            raise NotSimulatedError(source, dict(sorted(self._found.items())))

    def warn(self, source: str, held: Collection[str], fingerprint: str) -> None:
        """Warns, once for a fingerprint, of joints and bodies that nothing drives or holds without
        what is ignored; `held` are the joints that something else does."""
        for name, leaves in LEAVES.items():
            others = () if name in OF_BODIES else held
            names = [one for one in self._loose.get(name, ()) if one not in others]
            warn_of_loose(source, name, names, fingerprint, leaves=leaves)
