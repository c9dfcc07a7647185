"""Pairs from a folder of real, posed RGB-D frames. For measuring finished models only, never for choosing between them."""

from pathlib import Path

import cv2
import numpy as np

from . import augment
from .geometry import View
from .posed_pair import PosedPair

# The depth camera of the 7-Scenes recordings; their depth is not registered to the colour image.
FOCAL_PX, CENTRE_PX = 585.0, (320.0, 240.0)
INVALID_MM = 65535


def rgbd_pairs(folder: Path, gap: int) -> list[PosedPair]:
    """Every frame with the one `gap` files later; frames are NAME.color.jpg, NAME.depth.png, NAME.pose.txt."""
    names = sorted(p.name.removesuffix(".pose.txt") for p in folder.glob("*.pose.txt"))
    if len(names) <= gap:
        raise ValueError(f"{folder} holds {len(names)} posed frames, too few for pairs {gap} apart")
    frames = [_frame(folder, name) for name in names]
    pairs = []
    for (grey_a, view_a), (grey_b, view_b) in zip(frames, frames[gap:]):
        pairs.append(PosedPair([grey_a, grey_b], (view_a, view_b), view_a.depth_m, float("nan"), float("nan")))
    return pairs


def _frame(folder: Path, name: str) -> tuple[np.ndarray, View]:
    rgb = cv2.imread(str(folder / f"{name}.color.jpg"), cv2.IMREAD_COLOR)[:, :, ::-1]
    depth = cv2.imread(str(folder / f"{name}.depth.png"), cv2.IMREAD_UNCHANGED)
    pose = np.loadtxt(folder / f"{name}.pose.txt").reshape(4, 4)
    u, _, vt = np.linalg.svd(pose[:3, :3])
    pose[:3, :3] = u @ vt
    k = np.array([[FOCAL_PX, 0, CENTRE_PX[0]], [0, FOCAL_PX, CENTRE_PX[1]], [0, 0, 1]])
    depth_m = np.where(depth == INVALID_MM, 0, depth).astype(np.float32) * np.float32(1e-3)
    return augment.luma(rgb), View(k, pose, depth_m)
