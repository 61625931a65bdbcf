"""Grasps from files of others, and back into the same formats."""

from energymargin.grasps.files import read, write
from energymargin.grasps.frames import FRAMES
from energymargin.grasps.grasp_set import GraspSet, ObjectFacts, Source

__all__ = ["FRAMES", "GraspSet", "ObjectFacts", "Source", "read", "write"]
