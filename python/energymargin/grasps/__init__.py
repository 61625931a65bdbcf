"""Grasps from files of others, how well each of them holds, and back into the same formats."""

from energymargin.base.doors import check_doors
from energymargin.grasps.baselines import BASELINES, LESS_IS_BETTER, baselines
from energymargin.grasps.belief import GraspBelief
from energymargin.grasps.calibration import GraspCalibration, calibrate, recalibrate
from energymargin.grasps.comparison import ComparedScore, GraspComparison, compare
from energymargin.grasps.files import SUFFIXES, read, read_poses, write
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
__all__ += ["ComparedScore", "GraspBelief", "GraspCalibration", "GraspComparison", "GraspLimits"]
__all__ += ["GraspObject", "GraspScores", "GraspSet", "Grip", "Hand", "HandFile", "Motion"]
__all__ += ["ObjectFacts", "ParallelGripper", "Protocol", "Source", "WrenchSpace", "baselines"]
__all__ += ["calibrate", "compare", "grip", "limits", "read", "read_poses", "recalibrate"]
__all__ += ["score", "wrench_space", "write"]

check_doors(globals(), __all__)
