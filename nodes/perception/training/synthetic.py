"""Box rooms with many textures, in the format of exported pair sets: variety that furnished flats lack, and test data.

`python -m training.synthetic FOLDER --scenes 500`. A room is a few dozen textured rectangles: walls, boxes, posters. Each is
drawn analytically (inverse depth is affine in the pixel), so depth and pose are exact. Interrupted runs go on.
"""

import argparse
import json
import os
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from .geometry import View, reproject
from .textures import random_texture

WIDTH, HEIGHT = 320, 240
NEAR_M = 0.1
OVERLAP_MIN = 0.1


@dataclass
class Rectangle:
    """Corner, two orthonormal edge directions with their lengths in metres, a mip chain and how many texels make a metre."""

    corner: np.ndarray
    u: np.ndarray
    v: np.ndarray
    length_u: float
    length_v: float
    mips: list[np.ndarray]
    texels_per_m: float


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--views", type=int, default=8)
    parser.add_argument("--first-seed", type=int, default=500_000)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    write_set(options.folder, range(options.first_seed, options.first_seed + options.scenes), options.views)


def write_set(folder: Path, seeds: range, n_views: int) -> None:
    """Writes a scene per seed; one whose views.json exists is done."""
    for seed in tqdm(seeds, desc="rooms", unit="room", mininterval=5):
        target = folder / str(seed)
        if not (target / "views.json").exists():
            write_scene(target, seed, n_views)
    summary = {"format": 1, "scenes": list(seeds), "size": [WIDTH, HEIGHT], "n_views": n_views}
    _write_json(folder / "set.json", summary)


def write_scene(folder: Path, seed: int, n_views: int) -> None:
    """Renders one room's views and lists the pairs that overlap."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    size = rng.uniform([3, 3, 2.3], [6.5, 6.5, 3.2])
    rectangles = _room(size, rng)
    views, entries = [], []
    poses = [_camera_pose(size, target, rng) for target in _targets(size, n_views, rng)]
    for index, pose in enumerate(poses):
        focal = WIDTH / 2 / np.tan(np.radians(rng.uniform(55, 110)) / 2)
        k = np.array([[focal, 0, (WIDTH - 1) / 2], [0, focal, (HEIGHT - 1) / 2], [0, 0, 1]])
        rgb, depth_m = render(rectangles, k, pose)
        names = {"rgb": f"{index:03}.png", "depth": f"{index:03}.depth.png"}
        cv2.imwrite(str(folder / names["rgb"]), rgb, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        millimetres = np.rint(depth_m * 1000).astype(np.uint16)
        cv2.imwrite(str(folder / names["depth"]), millimetres, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        camera = {"width": WIDTH, "height": HEIGHT, "fx": focal, "fy": focal, "cx": k[0, 2], "cy": k[1, 2]}
        entries.append(names | camera | {"t_world_camera": pose.tolist(), "variant": 0})
        views.append(View(k, pose, depth_m))
    _write_json(folder / "views.json", {"format": 1, "seed": seed, "views": entries, "pairs": _pairs(views)})


def _write_json(path: Path, value: dict) -> None:
    temporary = path.with_suffix(".tmp")
    temporary.write_text(json.dumps(value))
    os.replace(temporary, path)


def _room(size: np.ndarray, rng: np.random.Generator) -> list[Rectangle]:
    textures = [_mips(random_texture(rng)) for _ in range(14)]
    rectangles = _box(np.zeros(3), size, 0.0, textures, rng, plain_share=0.35)
    for _ in range(rng.integers(8, 20)):
        extent = rng.uniform(0.15, 1.1, 3)
        base = np.array([*rng.uniform([0, 0], size[:2]), 0 if rng.random() < 0.7 else rng.uniform(0, 1.6)])
        rectangles += _box(base, extent, rng.uniform(0, np.pi), textures, rng, plain_share=0.2)
    for _ in range(rng.integers(6, 20)):
        rectangles.append(_poster(size, textures, rng))
    return rectangles


def _box(base, extent, yaw, textures, rng, plain_share) -> list[Rectangle]:
    """The six faces of a box that stands at `base`, turned about the vertical."""
    c, s = np.cos(yaw), np.sin(yaw)
    axes = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    faces = []
    for normal in range(3):
        i, j = [axis for axis in range(3) if axis != normal]
        for side in (0, 1):
            corner = base + side * extent[normal] * axes[normal]
            faces.append(_rectangle(corner, axes[i], axes[j], extent[i], extent[j], textures, rng, plain_share))
    return faces


def _poster(size, textures, rng) -> Rectangle:
    """A picture on one of the four walls, a centimetre in front of it."""
    wall, side = rng.integers(2), rng.integers(2)
    along = np.eye(3)[1 - wall]
    w, h = rng.uniform(0.3, 1.2, 2)
    corner = along * rng.uniform(0, max(0.1, size[1 - wall] - w)) + np.array([0, 0, rng.uniform(0.3, size[2] - h)])
    corner = corner + np.eye(3)[wall] * (size[wall] - 0.01 if side else 0.01)
    return _rectangle(corner, along, np.eye(3)[2], w, h, textures, rng, plain_share=0.0)


def _rectangle(corner, u, v, length_u, length_v, textures, rng, plain_share) -> Rectangle:
    shade = rng.uniform(0.5, 1.1)
    if rng.random() < plain_share:
        mips = [np.full((4, 4, 3), np.clip(shade * rng.uniform(60, 230, 3), 0, 255), np.uint8)]
    else:
        mips = [cv2.convertScaleAbs(m, alpha=shade) for m in textures[rng.integers(len(textures))]]
    return Rectangle(corner, u, v, length_u, length_v, mips, float(np.exp(rng.uniform(np.log(120), np.log(500)))))


def _mips(texture: np.ndarray) -> list[np.ndarray]:
    chain = [texture]
    while chain[-1].shape[0] > 8:
        chain.append(cv2.resize(chain[-1], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA))
    return chain


def _targets(size: np.ndarray, n_views: int, rng: np.random.Generator) -> list[np.ndarray]:
    """A few points of interest, each looked at by several views."""
    interests = [rng.uniform([0, 0, 0.2], [size[0], size[1], size[2] - 0.5]) for _ in range(max(1, n_views // 4))]
    return [interests[i % len(interests)] for i in range(n_views)]


def _camera_pose(size: np.ndarray, target: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A camera inside the room that looks roughly at `target`, 4x4."""
    for _ in range(100):
        position = rng.uniform([0.4, 0.4, 0.4], [size[0] - 0.4, size[1] - 0.4, 1.7])
        if np.linalg.norm(target - position) > 1.2:
            break
    forward = target + rng.normal(0, 0.3, 3) - position
    forward[2] *= 0.5
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    roll = rng.normal(0, np.radians(6))
    pose = np.eye(4)
    pose[:3, 0] = np.cos(roll) * right + np.sin(roll) * down
    pose[:3, 1] = np.cos(roll) * down - np.sin(roll) * right
    pose[:3, 2], pose[:3, 3] = forward, position
    return pose


def render(rectangles: list[Rectangle], k: np.ndarray, t_world_camera: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """RGB (8 bit) and depth (metres) of the rectangles; nearest wins."""
    color = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    inverse_depth = np.zeros((HEIGHT, WIDTH), np.float32)
    for rectangle in rectangles:
        window = _window(rectangle, k, t_world_camera)
        if window is not None:
            _draw(rectangle, k, t_world_camera, window, color, inverse_depth)
    depth = np.where(inverse_depth > 0, 1 / np.maximum(inverse_depth, 1e-6), 0)
    return color, depth.astype(np.float32)


def _window(r: Rectangle, k: np.ndarray, pose: np.ndarray) -> tuple[int, int, int, int] | None:
    """Columns and rows that the rectangle can cover, or None if it is out of view."""
    steps = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * [r.length_u, r.length_v]
    p = (r.corner + steps[:, :1] * r.u + steps[:, 1:] * r.v - pose[:3, 3]) @ pose[:3, :3]
    if (p[:, 2] < NEAR_M).all():
        return None
    if (p[:, 2] < NEAR_M).any():
        return 0, WIDTH, 0, HEIGHT
    pixels = p[:, :2] / p[:, 2:] * k[0, 0] + k[:2, 2]
    low = np.clip(np.floor(pixels.min(0)), 0, [WIDTH, HEIGHT]).astype(int)
    high = np.clip(np.ceil(pixels.max(0)) + 1, 0, [WIDTH, HEIGHT]).astype(int)
    return None if (low >= high).any() else (low[0], high[0], low[1], high[1])


def _draw(r: Rectangle, k, pose, window, color, inverse_depth) -> None:
    """Fills the pixels where the rectangle is nearest."""
    left, right, top, bottom = window
    x = ((np.arange(left, right) - k[0, 2]) / k[0, 0]).astype(np.float32)[None]
    y = ((np.arange(top, bottom) - k[1, 2]) / k[1, 1]).astype(np.float32)[:, None]

    def along(direction: np.ndarray) -> np.ndarray:
        """Component of every pixel's ray (of unit depth) along a world direction."""
        in_camera = pose[:3, :3].T @ direction
        return (np.float32(in_camera[0]) * x + np.float32(in_camera[1]) * y) + np.float32(in_camera[2])

    normal = np.cross(r.u, r.v)
    offset = normal @ (r.corner - pose[:3, 3])
    if abs(offset) < 1e-6:
        return
    inverse = along(normal) / np.float32(offset)
    seen = inverse_depth[top:bottom, left:right]
    front = (inverse > seen) & (inverse < 1 / NEAR_M)
    z = 1 / np.where(front, inverse, 1)
    start = pose[:3, 3] - r.corner
    s, t = np.float32(start @ r.u) + z * along(r.u), np.float32(start @ r.v) + z * along(r.v)
    hit = front & (s >= 0) & (s <= r.length_u) & (t >= 0) & (t <= r.length_v)
    if not hit.any():
        return
    # One mip level a rectangle, by its typical distance: enough for data that is blurred and made noisy later.
    footprint = float(np.median(z[hit])) / k[0, 0] * r.texels_per_m
    level = int(np.clip(np.round(np.log2(max(footprint, 1))), 0, len(r.mips) - 1))
    scale = np.float32(r.texels_per_m / 2**level)
    texels = cv2.remap(r.mips[level], s * scale, t * scale, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    color[top:bottom, left:right][hit] = texels[hit]
    seen[hit] = inverse[hit]


def _pairs(views: list[View]) -> list[dict]:
    """Pairs of views that see common surface."""
    x, y = np.meshgrid(np.arange(4, WIDTH, 10), np.arange(4, HEIGHT, 10))
    grid = np.stack([x.ravel(), y.ravel()], 1).astype(float)
    pairs = []
    for i, a in enumerate(views):
        for j in range(i + 1, len(views)):
            b = views[j]
            overlap = min(_share(a, b, grid), _share(b, a, grid))
            if overlap >= OVERLAP_MIN:
                turn = a.t_world_camera[:3, :3].T @ b.t_world_camera[:3, :3]
                yaw = np.degrees(np.arctan2(turn[0, 2], turn[2, 2]))
                distance = np.linalg.norm(a.t_world_camera[:3, 3] - b.t_world_camera[:3, 3])
                pairs.append({"a": i, "b": j, "overlap": overlap, "yaw_deg": float(yaw), "distance_m": float(distance)})
    return pairs


def _share(a: View, b: View, grid: np.ndarray) -> float:
    _, agrees, known = reproject(a, b, grid)
    return float(agrees.sum() / max(1, known.sum()))


if __name__ == "__main__":
    main()
