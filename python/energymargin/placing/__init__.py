"""What is at rest, how a thing can lie, where to set it down, and what a stack can take."""

from energymargin.base.doors import check_doors
from energymargin.placing.places import Placements, placements
from energymargin.placing.pushes import Push
from energymargin.placing.resting import RestingPose, RestingPoses, resting_poses
from energymargin.placing.settling import RestingBody, Settled, settle
from energymargin.placing.stacks import StackRobustness, stack_robustness

__all__ = ["Placements", "Push", "RestingBody", "RestingPose", "RestingPoses", "Settled"]
__all__ += ["StackRobustness", "placements", "resting_poses", "settle", "stack_robustness"]

check_doors(globals(), __all__)
