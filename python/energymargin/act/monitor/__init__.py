"""A stream of states scored as it comes, with an alarm, and the alarm's threshold from data.

`Monitor` scores the states that a robot's loop pushes, in the background. `threshold` chooses when
it is to raise its alarm, so that at most a given share of the trajectories has a false one;
`alarms` says what such an alarm announces. A threshold holds for scores that are made under the
same `Conditions`.
"""

from energymargin.act.monitor.alarm import Alarm, Alarms, Threshold, alarms, first_loss, threshold
from energymargin.act.monitor.monitor import Monitor
from energymargin.act.monitor.stream import Conditions, Counters, Reading
from energymargin.base.doors import check_doors
from energymargin.evaluate.futures import or_success

__all__ = ["Alarm", "Alarms", "Conditions", "Counters", "Monitor", "Reading", "Threshold"]
__all__ += ["alarms", "first_loss", "or_success", "threshold"]

check_doors(globals(), __all__)
