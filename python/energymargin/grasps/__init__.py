"""Grasps from files of others, how well each of them holds, and back into the same formats."""

from energymargin.base.doors import check_doors
from energymargin.grasps.baselines import BASELINES, LESS_IS_BETTER, baselines
from energymargin.grasps.belief import GraspBelief
from energymargin.grasps.calibration import GraspCalibration, calibrate, recalibrate
from energymargin.grasps.comparison import ComparedScore, GraspComparison, compare
from energymargin.grasps.files import SUFFIXES, read, write
from energymargin.grasps.frames import FRAMES
from energymargin.grasps.grasp_object import GraspObject
from energymargin.grasps.grasp_set import GraspSet, ObjectFacts, Source
from energymargin.grasps.hands import PRESETS as HANDS, Hand, HandFile, ParallelGripper
from energymargin.grasps.limits import GraspLimits, limits
from energymargin.grasps.protocols import PRESETS as PROTOCOLS, Motion, Protocol
from energymargin.grasps.scores import GraspScores
from energymargin.grasps.scoring import score
from energymargin.grasps.trials import Grip, grip
from energymargin.grasps.wrenches import WrenchSpace, wrench_space

__all__ = ["BASELINES", "FRAMES", "HANDS", "LESS_IS_BETTER", "PROTOCOLS", "SUFFIXES"]
__all__ += ["GraspBelief", "GraspObject", "GraspSet", "ObjectFacts", "Source"]
__all__ += ["Grip", "Hand", "HandFile", "Motion", "ParallelGripper", "Protocol", "WrenchSpace"]
__all__ += ["ComparedScore", "GraspCalibration", "GraspComparison", "GraspLimits", "GraspScores"]
__all__ += ["baselines", "calibrate", "compare", "grip", "limits", "recalibrate", "wrench_space"]
__all__ += ["read", "score", "write"]

check_doors(globals(), __all__)
