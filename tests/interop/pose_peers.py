"""The pose estimator beside its peers, on one set of problems, in one run: A B A B, one thread.

    cargo build -p homing-perception --example pose_peers
    python -m venv peers && peers/bin/pip install poselib opencv-python-headless numpy
    peers/bin/python tests/interop/pose_peers.py [--problems 200] [--rounds 5] [--json figures.json]

Problems: 300 points seen by a 640x480 camera of 525 px, 1 to 5 m away, pixel noise of 0.7 px (one standard deviation),
outliers anywhere in the image; the camera is turned by up to 40 degrees about the vertical and tilted by up to 10.
Printed per share of outliers: milliseconds (the median problem, each at its best of all rounds), share within 0.1 m and
5 degrees, median position error of all, and the ratio of each to PoseLib with its own defaults.

Peers are called as their users call them, from Python, on contiguous arrays; ours times itself from pixels to pose and
covariance. `gravity` knows which way is up in both cameras, exactly; nothing else does.
"""

import argparse
import json
import os
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import cv2
import numpy as np
import poselib

ROOT = Path(__file__).resolve().parents[2]
WIDTH, HEIGHT, FOCAL_PX, NOISE_PX = 640, 480, 525.0, 0.7
CENTRE = np.array([0.5 * WIDTH, 0.5 * HEIGHT])
SHARES = (0.3, 0.6, 0.8, 0.9)
POINTS = 300
REFERENCE = "poselib"


def turn(axis, angle):
    """Rotation matrix about an axis."""
    return cv2.Rodrigues(np.asarray(axis, float) / np.linalg.norm(axis) * angle)[0]


def problem(rng, outlier_share):
    """Points in the robot's camera, pixels in the goal's, and the truth (R, t) that maps the first to the second."""
    pixels = rng.uniform((0, 0), (WIDTH, HEIGHT), (POINTS, 2))
    depth = rng.uniform(1.0, 5.0, (POINTS, 1))
    seen = np.hstack([(pixels - CENTRE) / FOCAL_PX, np.ones((POINTS, 1))]) * depth
    tilts = np.radians(rng.uniform(-10, 10, 2))
    yaw = np.radians(rng.uniform(-40, 40))
    level_camera, level_goal = turn([1, 0, 0], tilts[0]), turn([1, 0, 0], tilts[1])
    rotation = level_goal.T @ turn([0, 1, 0], yaw) @ level_camera
    position = rng.uniform(-1.0, 1.0, 3)
    points = seen @ rotation + position
    noisy = pixels + rng.normal(0.0, NOISE_PX, pixels.shape)
    outliers = rng.permutation(POINTS)[: round(outlier_share * POINTS)]
    noisy[outliers] = rng.uniform((0, 0), (WIDTH, HEIGHT), (len(outliers), 2))
    up = np.array([0.0, -1.0, 0.0])
    return {
        "points": np.ascontiguousarray(points),
        "pixels": np.ascontiguousarray(noisy),
        "rotation": rotation,
        "position": position,
        "up_camera": level_camera.T @ up,
        "up_goal": level_goal.T @ up,
    }


def write(problems, path):
    """The file that the example reads: see `Problem::read_all` there."""
    with open(path, "wb") as file:
        file.write(struct.pack("<IId", len(problems), POINTS, FOCAL_PX))
        for p in problems:
            rows = np.hstack([p["points"], p["pixels"] - CENTRE])
            file.write(np.concatenate([p["up_camera"], p["up_goal"], rows.ravel()]).astype("<f8").tobytes())


CAMERA = {"model": "PINHOLE", "width": WIDTH, "height": HEIGHT, "params": [FOCAL_PX, FOCAL_PX, *CENTRE]}
MATRIX = np.array([[FOCAL_PX, 0, CENTRE[0]], [0, FOCAL_PX, CENTRE[1]], [0, 0, 1]])


def by_poselib(options):
    def solve(p):
        pose, _ = poselib.estimate_absolute_pose(p["pixels"], p["points"], CAMERA, options, {})
        return pose.R, pose.t

    return solve


def by_opencv(flags, iterations, refined):
    def solve(p):
        found, turned, t, inliers = cv2.solvePnPRansac(
            p["points"], p["pixels"], MATRIX, None, iterationsCount=iterations, confidence=0.9999, flags=flags
        )
        if not found or inliers is None:
            return None
        if refined and len(inliers) >= 4:
            kept = inliers.ravel()
            turned, t = cv2.solvePnPRefineLM(p["points"][kept], p["pixels"][kept], MATRIX, None, turned, t)
        return cv2.Rodrigues(turned)[0], t.ravel()

    return solve


def by_magsac(p):
    parameters = cv2.UsacParams()
    parameters.score = cv2.SCORE_METHOD_MAGSAC
    parameters.sampler = cv2.SAMPLING_UNIFORM
    parameters.loMethod = cv2.LOCAL_OPTIM_SIGMA
    parameters.maxIterations, parameters.confidence, parameters.threshold = 10_000, 0.9999, 4.0
    found, _, turned, t, _ = cv2.solvePnPRansac(p["points"], p["pixels"], MATRIX.copy(), None, params=parameters)
    return (cv2.Rodrigues(turned)[0], t.ravel()) if found else None


PEERS = {
    "poselib": by_poselib({}),
    "poselib, 100 at least, 4 px": by_poselib({"min_iterations": 100, "max_reproj_error": 4.0}),
    "OpenCV EPnP, 1000": by_opencv(cv2.SOLVEPNP_EPNP, 1000, True),
    "OpenCV P3P, 1000": by_opencv(cv2.SOLVEPNP_P3P, 1000, True),
    "OpenCV MAGSAC": by_magsac,
}
OURS = {"ours": "lo_ransac", "ours, gravity": "gravity"}


def run_peer(solve, problems):
    """Seconds and pose per problem."""
    results = []
    for p in problems:
        start = time.perf_counter()
        try:
            pose = solve(p)
        except cv2.error:
            pose = None
        results.append((time.perf_counter() - start, pose))
    return results


def run_ours(solver, path):
    """Seconds and pose per problem, as the example measured them."""
    command = [str(path[0]), str(path[1]), "--solver", solver]
    results = []
    for line in subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines():
        numbers = [float(x) for x in line.split(",")]
        pose = (np.reshape(numbers[2:11], (3, 3)), np.array(numbers[11:])) if numbers[1] else None
        results.append((numbers[0] * 1e-6, pose))
    return results


def errors(pose, truth):
    """Metres and degrees."""
    if pose is None:
        return np.inf, np.inf
    rotation, t = pose
    turned = rotation @ truth["rotation"].T
    angle = np.degrees(np.arccos(np.clip(0.5 * (np.trace(turned) - 1.0), -1.0, 1.0)))
    return np.linalg.norm(-rotation.T @ t - truth["position"]), angle


def measure(problems, peers, example, rounds):
    """Figures per estimator."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "problems.bin"
        write(problems, file)
        seconds, poses = {}, {}
        for _ in range(rounds):
            for name, solve in peers.items():
                results = run_peer(solve, problems)
                seconds.setdefault(name, []).append([r[0] for r in results])
                poses[name] = [r[1] for r in results]
            for name, solver in OURS.items():
                results = run_ours(solver, (example, file))
                seconds.setdefault(name, []).append([r[0] for r in results])
                poses[name] = [r[1] for r in results]
    figures = {}
    for name in seconds:
        off = np.array([errors(pose, truth) for pose, truth in zip(poses[name], problems)])
        figures[name] = {
            "ms": float(np.median(np.min(seconds[name], axis=0)) * 1e3),
            "success": float(np.mean((off[:, 0] < 0.1) & (off[:, 1] < 5.0))),
            "error_cm": float(np.median(off[:, 0]) * 100.0),
        }
    return figures


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--example", type=Path, default=ROOT / "target/debug/examples/pose_peers")
    parser.add_argument("--peers", help="names, separated by commas, that a peer must begin with; PoseLib always runs")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    if not arguments.example.is_file():
        sys.exit(f"{arguments.example} is not there: cargo build -p homing-perception --example pose_peers")
    cv2.setNumThreads(1)
    print(f"poselib {poselib.__version__}, OpenCV {cv2.__version__}, load {os.getloadavg()[0]:.1f}")
    wanted = tuple(arguments.peers.split(",")) if arguments.peers else ("",)
    peers = {name: solve for name, solve in PEERS.items() if name == REFERENCE or name.startswith(wanted)}
    table = {}
    for share in SHARES:
        rng = np.random.default_rng([arguments.seed, round(100 * share)])
        problems = [problem(rng, share) for _ in range(arguments.problems)]
        figures = table[share] = measure(problems, peers, arguments.example, arguments.rounds)
        reference = figures[REFERENCE]
        print(f"\n{share:.0%} outliers{'ms':>22}{'ratio':>8}{'success':>9}{'error cm':>10}{'ratio':>7}")
        for name, f in figures.items():
            print(
                f"  {name:<27}{f['ms']:8.3f}{f['ms'] / reference['ms']:8.2f}{f['success']:9.1%}"
                f"{f['error_cm']:10.3f}{f['error_cm'] / reference['error_cm']:7.2f}"
            )
    if arguments.json:
        arguments.json.write_text(json.dumps({f"{share:.2f}": figures for share, figures in table.items()}, indent=1))


if __name__ == "__main__":
    main()
