"""What the extractor should say of a pair: which pixels are keypoints, and which points of the two images are one."""

from dataclasses import dataclass

import cv2
import numpy as np

from .geometry import Warp, in_bounds

CELL = 8
NO_KEYPOINT = 64
IGNORED = -100
POINTS_MAX = 400
# Smaller eigenvalue of the structure tensor, (grey levels per pixel)^2, of the picture before noise was added.
CORNER_RESPONSE = 2.0
TEXTURE_RESPONSE = 0.15
# A corner is repeated if the other image has one this close to where the exact warp puts it, pixels.
REPEAT_PX = 1.6
CORNER_WEIGHT, TEXTURE_WEIGHT = 2.0, 1.0


@dataclass
class ExtractorTargets:
    """Matching points (n x 2 each, with weights n) and each image's cell labels (height/8 x width/8).

    A label is the row-major pixel of the cell that is a keypoint, NO_KEYPOINT, or IGNORED.
    """

    points_a: np.ndarray
    points_b: np.ndarray
    weights: np.ndarray
    labels_a: np.ndarray
    labels_b: np.ndarray


def corner_response(image: np.ndarray) -> np.ndarray:
    """Shi-Tomasi: the smaller eigenvalue of the structure tensor, in (grey levels per pixel)^2, over a 5x5 window."""
    gx = cv2.Sobel(image, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 8)
    gy = cv2.Sobel(image, cv2.CV_32F, 0, 1, ksize=3, scale=1 / 8)
    xx, yy, xy = (cv2.GaussianBlur(g, (5, 5), 1.1) for g in (gx * gx, gy * gy, gx * gy))
    return (xx + yy) / 2 - np.sqrt(((xx - yy) / 2) ** 2 + xy * xy)


def extractor_targets(clean_a: np.ndarray, clean_b: np.ndarray, warp: Warp, rng: np.random.Generator) -> ExtractorTargets:
    """Targets from the pictures before noise, blur and light were added, and the exact warp between them."""
    responses = [corner_response(image) for image in (clean_a, clean_b)]
    corners = [_local_maxima(r) for r in responses]
    points_a, points_b, weights = _matching_points(responses[0], corners[0], warp, rng)
    return ExtractorTargets(
        points_a,
        points_b,
        weights,
        _labels(responses[0], corners[0], corners[1], warp),
        _labels(responses[1], corners[1], corners[0], warp.reversed()),
    )


def _local_maxima(response: np.ndarray) -> np.ndarray:
    """Mask of corners: strong enough, largest within 5x5, not at the very border."""
    mask = (response >= cv2.dilate(response, np.ones((5, 5), np.uint8))) & (response > CORNER_RESPONSE)
    mask[:4], mask[-4:], mask[:, :4], mask[:, -4:] = False, False, False, False
    return mask


def _cells(image: np.ndarray) -> np.ndarray:
    """Height x width to rows x columns x 64, row-major within a cell."""
    rows, columns = image.shape[0] // CELL, image.shape[1] // CELL
    cells = image[: rows * CELL, : columns * CELL].reshape(rows, CELL, columns, CELL)
    return cells.transpose(0, 2, 1, 3).reshape(rows, columns, CELL * CELL)


def _cell_points(index: np.ndarray) -> np.ndarray:
    """Pixel of the chosen position of every cell: rows x columns to (rows * columns) x 2."""
    row, column = np.mgrid[: index.shape[0], : index.shape[1]]
    x, y = column * CELL + index % CELL, row * CELL + index // CELL
    return np.stack([x.ravel(), y.ravel()], 1).astype(np.float64)


def _matching_points(response, corners, warp: Warp, rng) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Up to POINTS_MAX textured points, one per cell of image a, that image b sees too."""
    cells = _cells(response)
    best = cells.argmax(2)
    strength = cells.max(2).ravel()
    pixels = _cell_points(best)
    is_corner = corners[pixels[:, 1].astype(int), pixels[:, 0].astype(int)]
    # Off the pixel grid of both images, so that descriptors are learned between pixels too.
    points = pixels + rng.uniform(-0.5, 0.5, pixels.shape)
    targets, visible, _ = warp.points(points)
    margin = in_bounds(points, warp.shape_a, 3) & in_bounds(targets, warp.shape_b, 3)
    chosen = np.flatnonzero(visible & margin & (is_corner | (strength > TEXTURE_RESPONSE)))
    if len(chosen) > POINTS_MAX:
        share = np.where(is_corner[chosen], 2.0, 1.0)
        chosen = rng.choice(chosen, POINTS_MAX, replace=False, p=share / share.sum())
    weights = np.where(is_corner[chosen], CORNER_WEIGHT, TEXTURE_WEIGHT)
    return points[chosen].astype(np.float32), targets[chosen].astype(np.float32), weights.astype(np.float32)


def _labels(response: np.ndarray, corners: np.ndarray, corners_other: np.ndarray, warp: Warp) -> np.ndarray:
    """Cell labels of image a: the strongest corner that b repeats; none where corners are absent, lost or on depth edges."""
    y, x = np.nonzero(corners)
    points = np.stack([x, y], 1).astype(np.float64)
    targets, visible, known = warp.points(points)
    distance = cv2.distanceTransform((~corners_other).astype(np.uint8), cv2.DIST_L2, 3)
    inside = in_bounds(targets, warp.shape_b)
    landed = np.rint(np.where(inside[:, None], targets, 0)).astype(int)
    repeated = visible & (distance[landed[:, 1], landed[:, 0]] <= REPEAT_PX)
    refuted = (visible & ~repeated) | warp.on_depth_edge(points)

    strength = np.full(response.shape, -1.0, np.float32)
    strength[y[repeated & ~refuted], x[repeated & ~refuted]] = response[y, x][repeated & ~refuted]
    open_question = np.zeros(response.shape, np.float32)
    unsure = ~repeated & ~refuted
    open_question[y[unsure], x[unsure]] = 1
    kept = _cells(strength)
    labels = np.where(kept.max(2) > 0, kept.argmax(2), NO_KEYPOINT)
    undecided = (labels == NO_KEYPOINT) & (_cells(open_question).max(2) > 0)
    return np.where(undecided, IGNORED, labels).astype(np.int64)
