"""Reads exported pair sets and turns them into training samples, each a function of (seed, index) alone."""

import functools
import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch

from . import augment
from .geometry import View, Warp
from .keypoint_targets import ExtractorTargets, extractor_targets

FORMAT = 1
# Pairs are drawn first by overlap, then uniformly: lower bound of each class and its share.
OVERLAP_CLASSES = ((0.10, 0.15), (0.20, 0.25), (0.35, 0.25), (0.55, 0.20), (0.75, 0.15))
# Within a class, every 30 degrees of yaw difference or metre of distance makes a pair this much likelier.
DIFFICULTY_GAIN = 0.5
# Decoded files that each process keeps: at 320x240 about 4 GB, and decoding would otherwise cost a third of the time.
FILES_CACHED = 24_000


@dataclass(frozen=True)
class ViewFile:
    """One view of one scene: its files, and its entry of views.json."""

    folder: Path
    entry: dict

    def rgb(self) -> np.ndarray:
        """Height x width x 3, 8 bit."""
        return _decoded(self.folder / self.entry["rgb"])[:, :, ::-1]

    def geometry(self) -> View:
        """Intrinsics, pose and depth."""
        e = self.entry
        depth = _decoded(self.folder / e["depth"])
        k = np.array([[e["fx"], 0, e["cx"]], [0, e["fy"], e["cy"]], [0, 0, 1.0]])
        pose = np.array(e["t_world_camera"], float).reshape(4, 4)
        return View(k, pose, depth.astype(np.float32) * np.float32(1e-3))


@functools.lru_cache(maxsize=FILES_CACHED)
def _decoded(path: Path) -> np.ndarray:
    """An image file as it is: BGR 8 bit, or grey 16 bit."""
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise FileNotFoundError(f"{path} is missing or no image: export the pairs again")
    image.setflags(write=False)
    return image


@dataclass(frozen=True)
class Pair:
    """Two views of one scene that see common surface, and how hard they are to match."""

    a: ViewFile
    b: ViewFile
    overlap: float
    yaw_deg: float
    distance_m: float


class PairSet:
    """All scenes below one or more exported folders, in order of their seeds."""

    def __init__(self, roots: list[Path]):
        self.views: list[ViewFile] = []
        self.pairs: list[Pair] = []
        self.scenes: list[str] = []
        for root in roots:
            for folder in _scene_folders(root):
                self._add_scene(folder)
        if not self.pairs:
            raise ValueError(f"no pairs in {', '.join(map(str, roots))}: export some with `homing export-pairs`")

    def _add_scene(self, folder: Path) -> None:
        scene = json.loads((folder / "views.json").read_text())
        if scene["format"] != FORMAT:
            raise ValueError(f"{folder} has format {scene['format']}, this reads format {FORMAT}: export it again")
        views = [ViewFile(folder, entry) for entry in scene["views"]]
        self.scenes.append(folder.name)
        self.views += views
        self.pairs += [
            Pair(views[p["a"]], views[p["b"]], p["overlap"], p["yaw_deg"], p["distance_m"]) for p in scene["pairs"]
        ]

    def describe(self) -> dict:
        """What a manifest says of the set."""
        return {"scenes": len(self.scenes), "views": len(self.views), "pairs": len(self.pairs)}


def _scene_folders(root: Path) -> list[Path]:
    return sorted((f.parent for f in root.glob("*/views.json")), key=lambda f: int(f.name))


class PairSampler:
    """Draws pairs by overlap class and difficulty."""

    def __init__(self, pairs: list[Pair]):
        bounds = np.array([low for low, _ in OVERLAP_CLASSES])
        classes = np.clip(np.searchsorted(bounds, [p.overlap for p in pairs], side="right") - 1, 0, None)
        hardness = np.array([1 + DIFFICULTY_GAIN * (abs(p.yaw_deg) / 30 + p.distance_m) for p in pairs])
        weights = np.zeros(len(pairs))
        for index, (_, share) in enumerate(OVERLAP_CLASSES):
            members = classes == index
            if members.any():
                weights[members] = share * hardness[members] / hardness[members].sum()
        self._cumulative = np.cumsum(weights / weights.sum())

    def draw(self, rng: np.random.Generator) -> int:
        """Index of a pair."""
        return min(int(np.searchsorted(self._cumulative, rng.random(), side="right")), len(self._cumulative) - 1)


@dataclass
class Sample:
    """Two training images (height x width, float32 grey 0 to 255) and which points of them are one."""

    image_a: np.ndarray
    image_b: np.ndarray
    targets: ExtractorTargets


class PairDataset(torch.utils.data.Dataset):
    """An endless sequence: sample i is a function of `seed` and i, so that a resumed run goes on with the same samples."""

    def __init__(self, sets: list[tuple[PairSet, float]], seed: int, length: int, homography_share: float):
        self._sets = [(pair_set, PairSampler(pair_set.pairs)) for pair_set, _ in sets]
        self._set_shares = np.cumsum([share for _, share in sets]) / sum(share for _, share in sets)
        self._seed, self._length, self._homography_share = seed, length, homography_share

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, index: int) -> Sample:
        rng = np.random.default_rng([self._seed, index])
        pair_set, sampler = self._sets[min(int(np.searchsorted(self._set_shares, rng.random())), len(self._sets) - 1)]
        if rng.random() < self._homography_share:
            view = pair_set.views[rng.integers(len(pair_set.views))]
            views, same = (view, view), True
        else:
            pair = pair_set.pairs[sampler.draw(rng)]
            views, same = (pair.a, pair.b) if rng.random() < 0.5 else (pair.b, pair.a), False
        return self._sample(views, same, rng)

    def _sample(self, views: tuple[ViewFile, ViewFile], same: bool, rng: np.random.Generator) -> Sample:
        rgbs = [v.rgb() for v in views]
        geometry = [v.geometry() for v in views]
        shapes = [rgb.shape[:2] for rgb in rgbs]
        if same:
            maps = [augment.random_zoom(shapes[0], rng), augment.random_homography(shapes[1], rng)]
        else:
            maps = [augment.random_zoom(s, rng) if rng.random() < 0.6 else np.eye(3) for s in shapes]
        warp = Warp(*geometry, *maps, same, *shapes)
        clean = [warped(augment.random_grey(rgb, rng), h) for rgb, h in zip(rgbs, maps)]
        seen = [augment.photometric(image, rng) for image in clean]
        return Sample(*seen, extractor_targets(clean[0], warp, rng))


def warped(image: np.ndarray, h: np.ndarray) -> np.ndarray:
    """The picture carried by a homography, of the same size."""
    if np.array_equal(h, np.eye(3)):
        return image
    height, width = image.shape
    return cv2.warpPerspective(image, h, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)


@dataclass
class Batch:
    """Samples of one step; images are n x 1 x height x width."""

    images_a: torch.Tensor
    images_b: torch.Tensor
    samples: list[Sample]


    def to(self, device: torch.device) -> "Batch":
        """The same with its images on a device."""
        return Batch(self.images_a.to(device), self.images_b.to(device), self.samples)


def collate(samples: list[Sample]) -> Batch:
    """Stacks the images, keeps the rest as it is."""
    images_a = torch.from_numpy(np.stack([s.image_a for s in samples])[:, None])
    images_b = torch.from_numpy(np.stack([s.image_b for s in samples])[:, None])
    for s in samples:
        s.image_a = s.image_b = None
    return Batch(images_a, images_b, samples)


class _Steps(torch.utils.data.Sampler):
    """Batches of consecutive indices, from the first step that is still to do."""

    def __init__(self, first_step: int, steps: int, batch: int):
        self._first, self._steps, self._batch = first_step, steps, batch

    def __iter__(self):
        for step in range(self._first, self._steps):
            yield list(range(step * self._batch, (step + 1) * self._batch))

    def __len__(self) -> int:
        return self._steps - self._first


def loader(dataset: PairDataset, first_step: int, steps: int, batch: int, workers: int) -> torch.utils.data.DataLoader:
    """Yields batches of steps `first_step`..`steps`, made by `workers` processes (0: in this one)."""
    return torch.utils.data.DataLoader(
        dataset,
        batch_sampler=_Steps(first_step, steps, batch),
        collate_fn=collate,
        num_workers=workers,
        prefetch_factor=4 if workers else None,
        worker_init_fn=_quiet_worker,
    )


def _quiet_worker(_: int) -> None:
    cv2.setNumThreads(1)
    torch.set_num_threads(1)
