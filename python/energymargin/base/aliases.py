"""Types that many modules name: arrays by the kind of their numbers, whose meaning and shape
docstrings say, and paths."""

import os

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
AnyPath = str | os.PathLike[str]
