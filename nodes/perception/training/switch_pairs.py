"""Pairs of views for the learned switch: which are adjacent in an expert's way, which are not, and their descriptors."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from tqdm import tqdm

from .augment import luma
from .backends import LearnedFeatures
from .data import PairSet
from .matcher import normalised_points
from .switch import GLOBAL_DIMENSION, global_descriptor

ADJACENT_M, ADJACENT_DEG = 1.0, 45.0
# A goal is in view by the measure of `homing bench perception`: so much shared, and nearer than SLING's d_th.
IN_VIEW_OVERLAP, LISTED_OVERLAP, D_TH_M = 0.3, 0.1, 4.0
COUNT_MAX = 1024


@dataclass(frozen=True)
class Pairs:
    """Pairs by class: indices of two views each, n x 2."""

    positive: np.ndarray
    near_negative: np.ndarray
    far_negative: np.ndarray


def descriptors_of(pair_set: PairSet, extractor: Path, file: Path, widths: tuple[int, ...]) -> np.ndarray:
    """Global descriptors, views x widths x 384, of every view brought to some widths in pixels; kept in `file`."""
    shape = (len(pair_set.views), len(widths), GLOBAL_DIMENSION)
    if file.exists():
        kept = np.load(file)
        if kept.shape != shape:
            raise ValueError(f"{file} holds {kept.shape}, not {shape}: name another --run")
        return kept
    features, made = LearnedFeatures(extractor, COUNT_MAX), np.zeros(shape, np.float32)
    for i, view in enumerate(tqdm(pair_set.views, desc=file.stem, unit="view", mininterval=5)):
        grey = luma(view.rgb())
        for k, width in enumerate(widths):
            size = (width, round(grey.shape[0] * width / grey.shape[1]))
            image = grey if grey.shape[1] == width else cv2.resize(grey, size, interpolation=cv2.INTER_CUBIC)
            points, found, scores = features(image)
            if len(points):
                made[i, k] = global_descriptor(normalised_points(points, *size), found, scores).numpy()
    file.parent.mkdir(parents=True, exist_ok=True)
    np.save(file, made)
    return made


def training_pairs(pair_set: PairSet) -> Pairs:
    """Positives are at most 1 m and 45 degrees apart and share surface, as neighbours in an expert's way do.

    The others of one flat are near negatives. Far negatives pair every view with one of the next flat, whatever it shows.
    """
    flats, index = _views_by_flat(pair_set), _index(pair_set)
    close = [p for p in pair_set.pairs if p.distance_m <= ADJACENT_M and abs(p.yaw_deg) <= ADJACENT_DEG]
    adjacent = {(index[id(p.a)], index[id(p.b)]) for p in close}
    near = [(a, b) for flat in flats for i, a in enumerate(flat) for b in flat[i + 1 :] if (a, b) not in adjacent]
    return Pairs(np.array(sorted(adjacent)), np.array(near), _far(flats))


def in_view_pairs(pair_set: PairSet, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Pairs by the measure of `homing bench perception`, n x 2, and whether the goal is in view: half of them.

    In view: sharing 0.3 and nearer than 4 m. Not: half of one flat sharing less than a tenth, half of two flats.
    """
    index = _index(pair_set)
    seen = [p for p in pair_set.pairs if p.overlap >= IN_VIEW_OVERLAP and p.distance_m < D_TH_M]
    view = [(index[id(p.a)], index[id(p.b)]) for p in seen]
    view += [(b, a) for a, b in view]
    listed = {(index[id(p.a)], index[id(p.b)]) for p in pair_set.pairs if p.overlap >= LISTED_OVERLAP}
    flats = _views_by_flat(pair_set)
    unseen = [(a, b) for flat in flats for a in flat for b in flat if a != b and (min(a, b), max(a, b)) not in listed]
    unseen = np.array(unseen)[rng.permutation(len(unseen))[: len(view) // 2]]
    far = _far(flats)
    far = far[rng.integers(len(far), size=len(view) - len(unseen))]
    return np.concatenate([np.array(view), unseen, far]), np.arange(2 * len(view)) < len(view)


def _views_by_flat(pair_set: PairSet) -> list[list[int]]:
    flats: dict[Path, list[int]] = {}
    for i, view in enumerate(pair_set.views):
        flats.setdefault(view.folder, []).append(i)
    return list(flats.values())


def _index(pair_set: PairSet) -> dict[int, int]:
    return {id(view): i for i, view in enumerate(pair_set.views)}


def _far(flats: list[list[int]]) -> np.ndarray:
    following = flats[1:] + flats[:1]
    return np.array([(a, b) for flat, other in zip(flats, following) for a, b in zip(flat, other)])
