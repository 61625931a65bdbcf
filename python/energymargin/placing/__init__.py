"""What is at rest, how a thing can lie, where to set it down, and what a stack can take."""

from energymargin.base.doors import check_doors
from energymargin.placing.resting import RestingPose, RestingPoses, resting_poses
from energymargin.placing.settling import RestingBody, Settled, settle

__all__ = ["RestingBody", "RestingPose", "RestingPoses", "Settled", "resting_poses", "settle"]

check_doors(globals(), __all__)
