"""Keypoints of all views of a pair set, found once, so that a step of the matcher costs the matcher alone.

`python -m training.features --extractor CHECKPOINT --data PAIRS --out FOLDER` writes, for every view, the keypoints of some
versions of it: zoomed, rolled, lit, blurred and noisy, each a function of the seed, the view and the version. Interrupted, it
goes on where it stopped; `--part 0/2` and `--part 1/2` share the work between two processes.
"""

import argparse
import hashlib
import json
from pathlib import Path

import cv2
import numpy as np
import torch
from numpy.lib.format import open_memmap
from tqdm import tqdm

from . import augment
from .data import PairSet, warped
from .extractor import DIMENSION
from .keypoint_set import extract
from .train_extractor import load_extractor

COUNT_MAX = 1024
ZOOMED_SHARE = 0.6
IMAGES_A_STEP = 8


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--extractor", type=Path, required=True, help="checkpoint of the trained extractor")
    parser.add_argument("--data", type=Path, required=True, help="exported pair set")
    parser.add_argument("--out", type=Path, required=True, help="folder for the keypoints")
    parser.add_argument("--versions", type=int, default=2, help="of each view, at least 2")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--part", default="0/1", help="which part of the views, of how many")
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    torch.set_num_threads(options.threads)
    write(options)


def write(options: argparse.Namespace) -> None:
    """Writes what is missing of the folder."""
    views = PairSet([options.data]).views
    extractor, _ = load_extractor(options.extractor, torch.device("cpu"))
    digest = hashlib.sha256(options.extractor.read_bytes()).hexdigest()
    about = {"views": len(views), "versions": options.versions, "seed": options.seed, "extractor_sha256": digest}
    arrays = _open(options.out, about)
    part, parts = map(int, options.part.split("/"))
    jobs = [(i, v) for i in range(part, len(views), parts) for v in range(options.versions)]
    jobs = [job for job in jobs if not arrays["done"][job]]
    for begin in tqdm(range(0, len(jobs), IMAGES_A_STEP), desc=options.out.name, unit="step", mininterval=5):
        chosen = jobs[begin : begin + IMAGES_A_STEP]
        made = [version_of(views[i], np.random.default_rng([options.seed, i, v])) for i, v in chosen]
        images = torch.from_numpy(np.stack([image for image, _ in made])[:, None])
        found = extract(extractor, images, COUNT_MAX)
        for k, job in enumerate(chosen):
            arrays["points"][job] = found.points[k].numpy()
            arrays["descriptors"][job] = found.descriptors[k].numpy()
            arrays["scores"][job] = found.scores[k].numpy()
            arrays["maps"][job] = made[k][1]
            arrays["done"][job] = True


def version_of(view, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """One version of a view (height x width, float32 grey), and the 3x3 map from native pixels to its pixels."""
    rgb = view.rgb()
    h = augment.random_zoom(rgb.shape[:2], rng) if rng.random() < ZOOMED_SHARE else np.eye(3)
    return augment.photometric(warped(augment.random_grey(rgb, rng), h), rng), h


def _open(folder: Path, about: dict) -> dict[str, np.ndarray]:
    """The arrays of a folder, made if it is new."""
    folder.mkdir(parents=True, exist_ok=True)
    note = folder / "about.json"
    if note.exists():
        if json.loads(note.read_text()) != about:
            raise ValueError(f"{folder} holds other keypoints, {note.read_text()}: name another --out")
        return {name: np.load(folder / f"{name}.npy", mmap_mode="r+") for name in _shapes(about)}
    arrays = {}
    for name, (shape, kind) in _shapes(about).items():
        arrays[name] = open_memmap(folder / f"{name}.npy", "w+", kind, shape)
    note.write_text(json.dumps(about))
    return arrays


def _shapes(about: dict) -> dict[str, tuple[tuple[int, ...], type]]:
    place = (about["views"], about["versions"])
    return {
        "points": (place + (COUNT_MAX, 2), np.float32),
        "descriptors": (place + (COUNT_MAX, DIMENSION), np.float16),
        "scores": (place + (COUNT_MAX,), np.float32),
        "maps": (place + (3, 3), np.float64),
        "done": (place, np.bool_),
    }


class Features:
    """The keypoints of one pair set, read."""

    def __init__(self, folder: Path, pair_set: PairSet):
        self.about = json.loads((folder / "about.json").read_text())
        self._arrays = {name: np.load(folder / f"{name}.npy", mmap_mode="r") for name in _shapes(self.about)}
        if self.about["views"] != len(pair_set.views) or not self._arrays["done"].all():
            raise ValueError(f"{folder} does not hold keypoints of all views: run training.features to its end")
        self.versions = self.about["versions"]

    def of(self, view: int, version: int, threshold: float, least: int):
        """Points, descriptors and scores of a version of a view, strongest first, and its map from native pixels.

        Those above a threshold, but the `least` strongest at least.
        """
        scores = self._arrays["scores"][view, version]
        kept = max(least, int((scores > threshold).sum()))
        arrays = (self._arrays[name][view, version, :kept] for name in ("points", "descriptors", "scores"))
        return *arrays, self._arrays["maps"][view, version]


if __name__ == "__main__":
    main()
