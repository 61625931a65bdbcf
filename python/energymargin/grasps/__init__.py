"""Grasps from files of others, how well each of them holds, and back into the same formats."""

from energymargin.grasps.belief import GraspBelief
from energymargin.grasps.files import read, write
from energymargin.grasps.frames import FRAMES
from energymargin.grasps.grasp_object import GraspObject
from energymargin.grasps.grasp_set import GraspSet, ObjectFacts, Source
from energymargin.grasps.hand_files import HandFile
from energymargin.grasps.hands import Hand, ParallelGripper
from energymargin.grasps.protocols import Motion, Protocol
from energymargin.grasps.scores import GraspScores
from energymargin.grasps.scoring import score

__all__ = [
    "FRAMES",
    "GraspBelief",
    "GraspObject",
    "GraspScores",
    "GraspSet",
    "Hand",
    "HandFile",
    "Motion",
    "ObjectFacts",
    "ParallelGripper",
    "Protocol",
    "Source",
    "read",
    "score",
    "write",
]
