"""What was asked about grasps, in words."""

from __future__ import annotations

from energymargin.grasps.belief import GraspBelief
from energymargin.grasps.hands import Hand, HandFile
from energymargin.grasps.protocols import GRAVITY, Protocol
from energymargin.grasps.trials import LEVER, GraspTrials

OF_COLLIDING = {
    "lost": "counts as lost",
    "redraw": "its pose is drawn again, then moved back along the approach",
    "retreat": "is moved back along its approach",
}


def of_hand(hand: Hand) -> str:
    """Its numbers, and where it is from."""
    named = dict(hand.text)
    if isinstance(hand, HandFile):
        named["file"] = hand.path
    return f"{type(hand).__name__}: {', '.join(f'{n} {v}' for n, v in named.items())}"


def of_protocol(rules: Protocol) -> str:
    """Its motions, one after the other."""
    words = []
    for one in rules.motions:
        amount = {"hold": "", "lift": f" {one.amount:.3g} m", "shake": f" {one.amount:.3g} m"}
        how = amount.get(one.kind, f" {one.amount:.3g} rad")
        how += f" at {one.frequency:.3g} Hz" if one.frequency else ""
        axis = f" along {one.frame} {one.axis}" if one.amount else ""
        words.append(f"{one.kind}{how}{axis} for {one.duration:.3g} s")
    gravity = {"always": "gravity acts", "closed": "gravity acts once closed"}
    words.append(gravity.get(str(rules.gravity), "no gravity") + ", on a table" * rules.table)
    return "; ".join(words)


def of_loss(rules: Protocol) -> str:
    """When a grasp is lost."""
    parts = [f"more than {rules.radius:g} m from where it was gripped, in the hand"]
    parts += [] if rules.angle is None else [f"turned by more than {rules.angle:.3g} rad"]
    parts += ["a finger off it"] if rules.touching else []
    return f"{', or '.join(parts)}, for {rules.dwell:g} s"


def of_belief(belief: GraspBelief) -> str:
    """What is not known exactly."""
    named = {n: v for n, v in vars(belief).items() if n != "about" and v is not None}
    if not named:
        return "nothing"
    about = f", turned about the {belief.about.replace('_', ' ')}" * ("pose" in named)
    return "; ".join(f"{name} {value}" for name, value in named.items()) + about


def of_disturbance(asked: GraspTrials) -> str:
    """What pushes and turns the object."""
    rules, weight = asked.protocol, asked.object.mass * GRAVITY
    force, torque = rules.force * weight, rules.torque * weight * LEVER
    bounds = f"{force:.3g} N and {torque:.3g} N m along and about each axis"
    return f"{asked.disturbance}, of bounds {bounds}, each at most {rules.duration:g} s"
