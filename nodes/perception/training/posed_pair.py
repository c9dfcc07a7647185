"""What the evaluation measures on: two pictures with known cameras and poses."""

from dataclasses import dataclass

import numpy as np

from .geometry import View


@dataclass
class PosedPair:
    """Two grey images and their cameras; view b's pose is to be found from view a's depth as a sensor gives it.

    `overlap` (share) and `yaw_deg` group the results; they are NaN where unknown.
    """

    images: list[np.ndarray]
    views: tuple[View, View]
    sensor_depth_m: np.ndarray
    overlap: float
    yaw_deg: float
