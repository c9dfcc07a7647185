"""Training batches of the matcher: keypoints of two views, and which of them are one point."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch

from .data import PairSampler, PairSet
from .features import Features
from .geometry import Warp
from .matcher import normalised_points
from .matcher_loss import MATCH_PX, distances, match_labels

KEYPOINT_THRESHOLD = 0.002


@dataclass
class FeatureBatch:
    """Keypoints a and b as the matcher takes them (positions, descriptors, scores) and their labels (n x k)."""

    a: tuple[torch.Tensor, torch.Tensor, torch.Tensor]
    b: tuple[torch.Tensor, torch.Tensor, torch.Tensor]
    labels_a: torch.Tensor
    labels_b: torch.Tensor

    def to(self, device: torch.device) -> "FeatureBatch":
        """The same on a device."""
        move = lambda side: tuple(x.to(device) for x in side)  # noqa: E731
        return FeatureBatch(move(self.a), move(self.b), self.labels_a.to(device), self.labels_b.to(device))


@dataclass
class FeatureSet:
    """One pair set with its keypoints, and how often it is drawn from."""

    pairs: PairSet
    features: Features
    share: float


class FeaturePairs:
    """Batch i is a function of the seed and i.

    A batch holds `counts[...]` keypoints an image, fewer than were found: a random thinning, in which partners stay together,
    so that few keypoints pose the problem that many do.
    """

    def __init__(self, sets: list[FeatureSet], seed: int, batch: int, counts: list[int], same_view_share: float):
        self._sets = sets
        self._samplers = [PairSampler(s.pairs.pairs) for s in sets]
        self._index = [{id(view): i for i, view in enumerate(s.pairs.views)} for s in sets]
        self._shares = np.cumsum([s.share for s in sets]) / sum(s.share for s in sets)
        self._seed, self._batch, self._counts, self._same_view_share = seed, batch, counts, same_view_share

    def batches(self, first: int, steps: int) -> Iterator[FeatureBatch]:
        """Batches of steps `first`..`steps`."""
        for step in range(first, steps):
            yield self.batch(step)

    def batch(self, step: int) -> FeatureBatch:
        """The batch of a step."""
        rng = np.random.default_rng([self._seed, step])
        count = int(rng.choice(self._counts))
        rows = [self._pair(count, rng) for _ in range(self._batch)]
        columns = [torch.from_numpy(np.stack(column)) for column in zip(*rows)]
        return FeatureBatch(tuple(columns[:3]), tuple(columns[3:6]), columns[6], columns[7])

    def _pair(self, count: int, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
        which = min(int(np.searchsorted(self._shares, rng.random())), len(self._sets) - 1)
        chosen, index = self._sets[which], self._index[which]
        same = rng.random() < self._same_view_share
        if same:
            view = chosen.pairs.views[rng.integers(len(chosen.pairs.views))]
            views = (view, view)
        else:
            pair = chosen.pairs.pairs[self._samplers[which].draw(rng)]
            views = (pair.a, pair.b) if rng.random() < 0.5 else (pair.b, pair.a)
        # One version against itself would be too easy.
        versions = rng.permutation(chosen.features.versions)[:2] if same else rng.integers(chosen.features.versions, size=2)
        a, b = (chosen.features.of(index[id(v)], n, KEYPOINT_THRESHOLD, count) for v, n in zip(views, versions))
        geometry = [v.geometry() for v in views]
        shapes = [g.depth_m.shape for g in geometry]
        warp = Warp(*geometry, a[3], b[3], same, *shapes)
        kept_a, kept_b = _thinned(warp, a[0], b[0], count, rng)
        labels = match_labels(warp, a[0][kept_a].astype(np.float64), b[0][kept_b].astype(np.float64))
        return *_inputs(a, kept_a, shapes[0]), *_inputs(b, kept_b, shapes[1]), *labels


def _thinned(warp: Warp, points_a, points_b, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Indices of `count` keypoints of either image, in order: any of a; of b the partners of those, and any others."""
    kept_a = np.sort(rng.choice(len(points_a), count, replace=False))
    distance, _ = distances(warp, points_a[kept_a].astype(np.float64), points_b)
    partners = np.unique(distance.argmin(1)[distance.min(1) < MATCH_PX])
    others = np.setdiff1d(np.arange(len(points_b)), partners)
    return kept_a, np.sort(np.concatenate([partners, rng.choice(others, count - len(partners), replace=False)]))


def _inputs(found, kept: np.ndarray, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points = normalised_points(torch.from_numpy(found[0][kept]), shape[1], shape[0]).numpy()
    return points, found[1][kept].astype(np.float32), found[2][kept]
