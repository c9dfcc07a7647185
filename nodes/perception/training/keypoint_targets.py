"""Which points of the two images of a pair are one: where the extractor's descriptors are trained."""

from dataclasses import dataclass

import cv2
import numpy as np

from .geometry import Warp, in_bounds

CELL = 8
POINTS_MAX = 400
# Root of the determinant of the Hessian, grey levels per square pixel, of the picture before noise was added.
BLOB_RESPONSE = 0.7
TEXTURE_RESPONSE = 0.05
BLOB_WEIGHT, TEXTURE_WEIGHT = 2.0, 1.0


@dataclass
class ExtractorTargets:
    """Matching points (n x 2 each) with their weights (n)."""

    points_a: np.ndarray
    points_b: np.ndarray
    weights: np.ndarray


def blob_response(image: np.ndarray) -> np.ndarray:
    """Root of the determinant of the Hessian at a deviation of 1.4 pixels, where it is positive; else 0."""
    smooth = cv2.GaussianBlur(image, (9, 9), 1.4)
    line, slope = np.array([[1, -2, 1]], np.float32), np.array([[-1, 0, 1]], np.float32)
    xx, yy = cv2.filter2D(smooth, -1, line), cv2.filter2D(smooth, -1, line.T)
    xy = cv2.filter2D(smooth, -1, slope.T @ slope / 4)
    return np.sqrt(np.maximum(xx * yy - xy * xy, 0))


def extractor_targets(clean_a: np.ndarray, warp: Warp, rng: np.random.Generator) -> ExtractorTargets:
    """Targets from the picture before noise, blur and light were added, and the exact warp."""
    response = blob_response(clean_a)
    return _matching_points(response, _local_maxima(response), warp, rng)


def _local_maxima(response: np.ndarray) -> np.ndarray:
    """Mask of blobs: strong enough, largest within 5x5, not at the very border."""
    mask = (response >= cv2.dilate(response, np.ones((5, 5), np.uint8))) & (response > BLOB_RESPONSE)
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


def _matching_points(response, blobs, warp: Warp, rng) -> ExtractorTargets:
    """Up to POINTS_MAX textured points, one per cell of image a, that image b sees too."""
    cells = _cells(response)
    best = cells.argmax(2)
    strength = cells.max(2).ravel()
    pixels = _cell_points(best)
    is_blob = blobs[pixels[:, 1].astype(int), pixels[:, 0].astype(int)]
    # Off the pixel grid of both images, so that descriptors are learned between pixels too.
    points = pixels + rng.uniform(-0.5, 0.5, pixels.shape)
    targets, visible, _ = warp.points(points)
    margin = in_bounds(points, warp.shape_a, 3) & in_bounds(targets, warp.shape_b, 3)
    chosen = np.flatnonzero(visible & margin & (is_blob | (strength > TEXTURE_RESPONSE)))
    if len(chosen) > POINTS_MAX:
        share = np.where(is_blob[chosen], 2.0, 1.0)
        chosen = rng.choice(chosen, POINTS_MAX, replace=False, p=share / share.sum())
    weights = np.where(is_blob[chosen], BLOB_WEIGHT, TEXTURE_WEIGHT)
    return ExtractorTargets(*(x.astype(np.float32) for x in (points[chosen], targets[chosen], weights)))
