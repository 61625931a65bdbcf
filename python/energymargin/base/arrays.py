"""Arrays by the kind of their numbers; what they mean, with their shapes, docstrings say."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
