"""Exact correspondences between two posed depth images.

Conventions: pixels are (x, y) with the centre of the top-left pixel at (0, 0); the camera looks along z, x right, y down;
`t_a_b` maps points of frame b to frame a; depth is z in metres, 0 where unknown.
"""

from dataclasses import dataclass

import numpy as np

# A projected point agrees with the depth it lands on within this share of the depth, or this many metres.
DEPTH_AGREEMENT_SHARE = 0.02
DEPTH_AGREEMENT_M = 0.02
# Second difference of inverse depth, relative to it, above which a pixel lies on a depth edge (it is 0 on any plane).
EDGE_CURVATURE = 0.04


@dataclass
class View:
    """A camera image's geometry: intrinsics k (3x3), world pose (4x4), and depth as rendered (height x width, metres)."""

    k: np.ndarray
    t_world_camera: np.ndarray
    depth_m: np.ndarray


@dataclass
class Warp:
    """Carries points of training image a to training image b, and back.

    `h_a`, `h_b` (3x3) map native pixels of each view to pixels of its training image, which is a zoomed, rolled or
    perspectively warped copy. When both sides are the same view, its pixels correspond to themselves and depth is not asked.
    """

    a: View
    b: View
    h_a: np.ndarray
    h_b: np.ndarray
    same_view: bool
    shape_a: tuple[int, int]
    shape_b: tuple[int, int]

    def reversed(self) -> "Warp":
        """The same pair seen from b."""
        return Warp(self.b, self.a, self.h_b, self.h_a, self.same_view, self.shape_b, self.shape_a)

    def points(self, points_a: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Carries n x 2 points of image a to image b.

        Returns their positions in b (n x 2), `visible` (n, the same surface point is seen there) and `known` (n, it can be
        told whether it is: the point has a depth, and where it lands so has b).
        """
        native_a = transform_points(np.linalg.inv(self.h_a), points_a)
        if self.same_view:
            native_b, known = native_a, np.ones(len(points_a), bool)
            agrees = in_bounds(native_a, self.a.depth_m.shape)
        else:
            native_b, agrees, known = reproject(self.a, self.b, native_a)
        points_b = transform_points(self.h_b, native_b)
        inside = in_bounds(points_b, self.shape_b)
        # A point that leaves the training image is known to have no counterpart, whatever the depth says there.
        return points_b, agrees & inside, known | ~inside

    def on_depth_edge(self, points_a: np.ndarray) -> np.ndarray:
        """Which of n x 2 points of image a lie where depth jumps: their surface, and so their depth, is ambiguous."""
        _, valid, smooth = sample_depth(self.a.depth_m, transform_points(np.linalg.inv(self.h_a), points_a))
        return valid & ~smooth


def transform_points(h: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Applies a 3x3 homography to n x 2 points; those at infinity come out far outside."""
    lifted = points @ h[:, :2].T + h[:, 2]
    w = np.where(np.abs(lifted[:, 2:]) < 1e-9, 1e-9, lifted[:, 2:])
    return lifted[:, :2] / w


def in_bounds(points: np.ndarray, shape: tuple[int, int], margin: float = 0.0) -> np.ndarray:
    """Which n x 2 points lie inside an image of `shape` (height, width), at least `margin` pixels from its border."""
    height, width = shape
    x, y = points[:, 0], points[:, 1]
    return (x >= margin) & (y >= margin) & (x <= width - 1 - margin) & (y <= height - 1 - margin)


def sample_depth(depth_m: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depth at n x 2 pixels, whether it is known, and whether the surface is smooth there (no depth edge).

    Interpolates inverse depth, which is affine in the pixel on a plane: exact there.
    """
    height, width = depth_m.shape
    inside = in_bounds(points, depth_m.shape)
    x = np.clip(points[:, 0], 0, width - 1.001)
    y = np.clip(points[:, 1], 0, height - 1.001)
    x0, y0 = x.astype(int), y.astype(int)
    fx, fy = x - x0, y - y0
    # A 4 x 4 neighbourhood, clamped at the border, of which the inner 2 x 2 is interpolated.
    columns = np.clip(x0[:, None] + np.arange(-1, 3), 0, width - 1)
    rows = np.clip(y0[:, None] + np.arange(-1, 3), 0, height - 1)
    near = depth_m[rows[:, :, None], columns[:, None, :]]
    valid = (near > 0).all((1, 2))
    inverse = 1.0 / np.maximum(near, 1e-3)
    value = (
        (1 - fy) * ((1 - fx) * inverse[:, 1, 1] + fx * inverse[:, 1, 2])
        + fy * ((1 - fx) * inverse[:, 2, 1] + fx * inverse[:, 2, 2])
    )
    interior = (x0 >= 1) & (y0 >= 1) & (x0 < width - 2) & (y0 < height - 2)
    bend = np.maximum(
        np.abs(np.diff(inverse, 2, axis=1)).max((1, 2)), np.abs(np.diff(inverse, 2, axis=2)).max((1, 2))
    )
    smooth = ~interior | (bend < EDGE_CURVATURE * value)
    return 1.0 / value, inside & valid, smooth


def unproject(k: np.ndarray, points: np.ndarray, depth_m: np.ndarray) -> np.ndarray:
    """n x 3 points in the camera frame, metres, of n x 2 pixels at depths n."""
    rays = (points - k[:2, 2]) / np.array([k[0, 0], k[1, 1]])
    return np.concatenate([rays, np.ones((len(points), 1))], 1) * depth_m[:, None]


def reproject(a: View, b: View, native_a: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixels of b for native pixels of a; whether the surfaces agree there; whether that could be told."""
    depth_a, valid_a, smooth_a = sample_depth(a.depth_m, native_a)
    known = valid_a & smooth_a
    t_b_a = np.linalg.inv(b.t_world_camera) @ a.t_world_camera
    p_b = unproject(a.k, native_a, depth_a) @ t_b_a[:3, :3].T + t_b_a[:3, 3]
    in_front = p_b[:, 2] > 0.05
    z = np.where(in_front, p_b[:, 2], 1.0)
    native_b = p_b[:, :2] / z[:, None] * np.array([b.k[0, 0], b.k[1, 1]]) + b.k[:2, 2]
    native_b = np.where(in_front[:, None], native_b, -1e6)
    inside = in_bounds(native_b, b.depth_m.shape)
    depth_b, valid_b, smooth_b = sample_depth(b.depth_m, np.where(inside[:, None], native_b, 0.0))
    known_b = valid_b & smooth_b
    tolerance = np.maximum(DEPTH_AGREEMENT_M, DEPTH_AGREEMENT_SHARE * z)
    agrees = known & known_b & inside & (np.abs(depth_b - z) < tolerance)
    return native_b, agrees, known & (known_b | ~inside)


def relative_pose_error(t_estimate: np.ndarray, t_truth: np.ndarray) -> tuple[float, float]:
    """Distance of the two origins in metres, and the angle between the two attitudes in degrees (4x4 poses)."""
    rotation = t_estimate[:3, :3].T @ t_truth[:3, :3]
    angle = np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))
    return float(np.linalg.norm(t_estimate[:3, 3] - t_truth[:3, 3])), float(angle)
