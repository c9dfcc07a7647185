"""Measures extractor and matcher on posed pairs, beside SIFT: `python -m training.evaluate --pairs PAIRS ...`.

A pair counts as solved if the pose of view b in view a, from matches lifted by a's depth and a RANSAC PnP, is near the truth.
"""

import argparse
import json
from pathlib import Path

import cv2
import numpy as np
import torch
from tqdm import tqdm

from . import augment
from .backends import LearnedFeatures, LearnedMatcher, Sift, dual_softmax_matches, ratio_matches, sift_matches
from .data import PairSampler, PairSet
from .geometry import Warp, relative_pose_error
from .posed_pair import PosedPair
from .rgbd_folder import rgbd_pairs

# Reprojection error of an inlier: 3 px at 640 columns, and so 1.5 px at 320.
INLIER_SHARE_OF_WIDTH = 3 / 640
RANSAC_ITERATIONS, RANSAC_CONFIDENCE = 2000, 0.9999
MATCH_CORRECT_PX_AT_640 = 5.0
MODERATE = "overlap>=0.3_yaw<=60deg"
# The descriptors that a method compares.
FEATURES = {"mutual": "narrow", "wide": "wide", "fast": "narrow", "accurate": "narrow"}
TOLERANCES = {"0.25m_10deg": (0.25, 10.0), "0.1m_5deg": (0.10, 5.0), "0.1m_2deg": (0.10, 2.0)}


def main() -> None:
    """Command line."""
    options = _options()
    cv2.setNumThreads(1)
    torch.set_num_threads(options.threads)
    if options.curve:
        from .curve import write_curve

        write_curve(options)
        return
    pairs = rgbd_pairs(options.rgbd, options.gap) if options.rgbd else list(validation_pairs(options))
    table = measure_all(options.methods.split(","), pairs, options)
    print(as_text(table))
    if options.out:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(json.dumps(table, indent=1) + "\n")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=Path, help="exported pair set of validation (or test) flats")
    parser.add_argument("--rgbd", type=Path, help="instead: a folder of posed RGB-D frames, for the last measurement only")
    parser.add_argument("--gap", type=int, default=10, help="frames between the two of a pair, with --rgbd")
    parser.add_argument("--extractor", type=Path, help="checkpoint (.pt) or exported model (.onnx)")
    parser.add_argument("--matcher", type=Path, help="checkpoint (.pt) or exported model (.onnx), for fast and accurate")
    parser.add_argument("--methods", default="sift,mutual,fast,accurate", help="of sift, mutual, wide, fast, accurate")
    parser.add_argument("--limit", type=int, default=400, help="pairs measured")
    parser.add_argument("--keypoints", type=int, default=1024)
    parser.add_argument("--confidence", type=float, default=0.2, help="least confidence of a match by the matcher")
    parser.add_argument("--confidence-accurate", type=float, help="the same of the accurate matcher, if another")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--curve", type=Path, nargs="*", help="training runs whose snapshots are measured and plotted")
    parser.add_argument("--points", type=int, default=8, help="snapshots of each run that --curve measures")
    parser.add_argument("--out", type=Path, help="JSON to write; with --curve also .csv and .png of that name")
    options = parser.parse_args()
    if (options.pairs is None) == (options.rgbd is None):
        parser.error("give either --pairs or --rgbd")
    return options


def validation_pairs(options: argparse.Namespace):
    """A fixed draw of pairs, each with sensor noise on picture and depth that depends on the seed alone."""
    pairs = PairSet([options.pairs]).pairs
    sampler = PairSampler(pairs)
    for index in range(options.limit):
        rng = np.random.default_rng([options.seed, index])
        pair = pairs[sampler.draw(rng)]
        images = [augment.photometric(augment.luma(v.rgb()), rng) for v in (pair.a, pair.b)]
        views = (pair.a.geometry(), pair.b.geometry())
        depth = augment.depth_sensor(views[0].depth_m, rng)
        yield PosedPair(images, views, depth, pair.overlap, abs(pair.yaw_deg))


def measure_all(methods: list[str], pairs: list[PosedPair], options: argparse.Namespace) -> dict:
    """Per method: the share of pairs solved and the quality of the matches, over all pairs and over the moderate ones."""
    match = {method: _matches_by(method, options) for method in methods}
    needed = {kind for method in methods if (kind := FEATURES.get(method))}
    learned = {kind: LearnedFeatures(options.extractor, options.keypoints, kind) for kind in needed}
    results = {method: [] for method in methods}
    for pair in tqdm(pairs, desc="pairs", unit="pair", mininterval=5):
        features = {kind: [found(image) for image in pair.images] for kind, found in learned.items()}
        for method in methods:
            results[method].append(measure(pair, *match[method](pair, features)))
    return {method: _summary(rows, pairs) for method, rows in results.items()}


def _matches_by(method: str, options: argparse.Namespace):
    """A function from a pair and its features of either kind to matching pixels."""
    if method == "sift":
        sift = Sift(options.keypoints)
        return lambda pair, _: sift_matches(*(sift(image) for image in pair.images))
    if method == "mutual":
        return lambda _, features: dual_softmax_matches(*features["narrow"])
    if method == "wide":
        return lambda _, features: ratio_matches(*features["wide"])
    own = options.confidence_accurate if method == "accurate" else None
    matcher = LearnedMatcher(options.matcher, options.confidence if own is None else own, fast=method == "fast")
    return lambda pair, features: matcher(*features["narrow"], pair.images[0].shape, pair.images[1].shape)


def measure(pair: PosedPair, points_a: np.ndarray, points_b: np.ndarray) -> dict:
    """Pose error and match quality of one pair, given matching pixels (n x 2 each)."""
    pose, inliers = solve_pose(pair, points_a, points_b)
    t_a_b = np.linalg.inv(pair.views[0].t_world_camera) @ pair.views[1].t_world_camera
    error_m, error_deg = relative_pose_error(pose, t_a_b) if pose is not None else (np.inf, np.inf)
    right, judged = correct_matches(pair, points_a, points_b)
    return {"m": error_m, "deg": error_deg, "inliers": inliers, "matches": len(points_a), "right": right, "judged": judged}


def solve_pose(pair: PosedPair, points_a: np.ndarray, points_b: np.ndarray) -> tuple[np.ndarray | None, int]:
    """Pose of camera b in camera a (4x4) by P3P RANSAC and refinement on the inliers, and their number."""
    view_a, view_b = pair.views
    pixel = np.rint(points_a).astype(int)
    depth = pair.sensor_depth_m[pixel[:, 1], pixel[:, 0]] if len(pixel) else np.zeros(0)
    known = depth > 0
    if known.sum() < 4:
        return None, 0
    rays = (points_a[known] - view_a.k[:2, 2]) / [view_a.k[0, 0], view_a.k[1, 1]]
    objects = np.concatenate([rays, np.ones((len(rays), 1))], 1) * depth[known, None]
    images = np.ascontiguousarray(points_b[known], np.float64)
    cv2.setRNGSeed(0)
    found, rotation, translation, inliers = cv2.solvePnPRansac(
        objects, images, view_b.k, None, iterationsCount=RANSAC_ITERATIONS, confidence=RANSAC_CONFIDENCE,
        reprojectionError=INLIER_SHARE_OF_WIDTH * pair.images[1].shape[1], flags=cv2.SOLVEPNP_AP3P,
    )
    if not found or inliers is None or len(inliers) < 4:
        return None, 0
    chosen = inliers[:, 0]
    rotation, translation = cv2.solvePnPRefineLM(objects[chosen], images[chosen], view_b.k, None, rotation, translation)
    t_b_a = np.eye(4)
    t_b_a[:3, :3], t_b_a[:3, 3] = cv2.Rodrigues(rotation)[0], translation[:, 0]
    return np.linalg.inv(t_b_a), len(chosen)


def correct_matches(pair: PosedPair, points_a: np.ndarray, points_b: np.ndarray) -> tuple[int, int]:
    """How many matches are right by depth and pose, and of how many that can be told."""
    recorded = np.isnan(pair.overlap)
    if recorded or not len(points_a):
        return 0, 0  # A recording's depth is too coarse, and not registered to the picture: it cannot judge pixels.
    shapes = [image.shape for image in pair.images]
    warp = Warp(*pair.views, np.eye(3), np.eye(3), False, *shapes)
    targets, visible, known = warp.points(points_a.astype(np.float64))
    error = np.linalg.norm(targets - points_b, axis=1)
    right = visible & (error < MATCH_CORRECT_PX_AT_640 * shapes[1][1] / 640)
    return int(right.sum()), int(known.sum())


def _summary(rows: list[dict], pairs: list[PosedPair]) -> dict:
    return {"all": _shares(rows), MODERATE: _shares([row for row, pair in zip(rows, pairs) if is_moderate(pair)])}


def is_moderate(pair: PosedPair) -> bool:
    """Whether the pair is one of those that a navigator meets near its goal."""
    return pair.overlap >= 0.3 and pair.yaw_deg <= 60


def _shares(rows: list[dict]) -> dict:
    summary = {"pairs": len(rows)}
    if not rows:
        return summary
    for name, (metres, degrees) in TOLERANCES.items():
        summary[name] = round(sum(r["m"] <= metres and r["deg"] <= degrees for r in rows) / len(rows), 4)
    judged = [r for r in rows if r["judged"]]
    if judged:
        summary["matching_accuracy"] = round(float(np.mean([r["right"] / r["judged"] for r in judged])), 4)
    summary["matches"] = float(np.median([r["matches"] for r in rows]))
    summary["inliers"] = float(np.median([r["inliers"] for r in rows]))
    return summary


def as_text(table: dict) -> str:
    """A table for people."""
    lines = []
    for method, groups in table.items():
        for group, row in groups.items():
            lines.append(f"{method:8} {group:24} " + "  ".join(f"{name} {value}" for name, value in row.items()))
    return "\n".join(lines)


if __name__ == "__main__":
    main()
