"""Perception beside its peers, on the same images and model files, in one run, taking turns: A B A B.

    cargo build --workspace --examples
    python3 -m venv target/peers && target/peers/bin/pip install -r tests/interop/peers.txt
    target/peers/bin/python tests/interop/perception_peers.py [DIR] [--profile NAME=FEATURES]... [--json figures.json]

DIR is a recording in 7-Scenes layout; by default the one in HOMING_DATA, or ../shared/data. A profile's FEATURES are
arguments of the examples, by default `fast` and `accurate` are both our shipped models:
    --profile "fast=--extractor homing --matcher homing" --profile "accurate=--extractor sift --matcher mutual-nearest"

1. A single-frame estimate, from a decoded image and its depth to the pose, the photo's features at hand, against OpenCV
   from Python: SIFT with 1000 keypoints, brute force with a ratio test, solvePnPRansac. Both on the same threads and cores.
   Printed: milliseconds (median, and the median of each pair's best round), the ratio of the two, and the share of pairs
   within 0.25 m and 10 degrees.
2. ONNX Runtime through our `ort` session against Python's `onnxruntime`, the very same library: the extractor's and the
   matcher's network alone, on the same inputs.
"""

import argparse
import json
import os
import shlex
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOCAL_PX, CENTRE_PX = 585.0, (320.0, 240.0)
KEYPOINTS, RATIO = 1000, 0.8
OURS = "--extractor homing --matcher homing"


def options():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    data = Path(os.environ.get("HOMING_DATA", ROOT / "../shared/data"))
    parser.add_argument("recording", type=Path, nargs="?", default=data / "rgbd/7scenes_redkitchen")
    parser.add_argument("--profile", action="append", help="NAME=FEATURES, see above")
    parser.add_argument("--goals", type=dict_of_goals, default={"fast": 0.6, "accurate": 1.0})
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--gap", type=int, default=50, help="frames between the two of a pair")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--example", type=Path, default=ROOT / "target/debug/examples/perception_peers")
    parser.add_argument("--models", type=Path, default=ROOT / "nodes/perception/models")
    parser.add_argument("--json", type=Path)
    found = parser.parse_args()
    found.profile = dict(p.split("=", 1) for p in found.profile or [f"fast={OURS}"])
    if not found.example.is_file():
        sys.exit(f"{found.example} is not there: cargo build --workspace --examples")
    if not found.recording.is_dir():
        sys.exit(f"{found.recording} is not there: give a recording in 7-Scenes layout")
    return found


def dict_of_goals(text):
    """NAME=RATIO, separated by commas."""
    return {name: float(ratio) for name, ratio in (pair.split("=") for pair in text.split(","))}


OPTIONS = options() if __name__ == "__main__" else None
if OPTIONS:
    # Before the libraries count the cores; the example inherits it.
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: OPTIONS.threads])
    os.environ["OMP_NUM_THREADS"] = str(OPTIONS.threads)

import cv2  # noqa: E402
import numpy as np  # noqa: E402
import onnxruntime  # noqa: E402


class Ours:
    """The example, answering line by line."""

    def __init__(self, found, features, network=()):
        # The library that Python uses is the one that ours loads.
        library = next(Path(onnxruntime.__file__).parent.glob("capi/libonnxruntime.so.*"))
        command = [found.example, found.recording, *shlex.split(features), "--models", found.models]
        command += ["--threads", found.threads, "--library", library, *network]
        environment = {**os.environ, "RUST_LOG": "warn"}
        self.process = subprocess.Popen(
            [str(word) for word in command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )
        self.answer()

    def answer(self):
        line = self.process.stdout.readline()
        if not line:
            sys.exit("the example ended; what it said stands above")
        return line.split()

    def ask(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self.answer()

    def close(self):
        self.process.stdin.close()
        self.process.wait()


class Peer:
    """What a Python user writes with OpenCV: SIFT, brute force, ratio test, depth, solvePnPRansac."""

    def __init__(self):
        self.sift, self.matcher = cv2.SIFT_create(KEYPOINTS), cv2.BFMatcher(cv2.NORM_L2)
        self.camera = np.array([[FOCAL_PX, 0, CENTRE_PX[0]], [0, FOCAL_PX, CENTRE_PX[1]], [0, 0, 1]])

    def extract(self, image):
        keypoints, descriptors = self.sift.detectAndCompute(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), None)
        return np.array([k.pt for k in keypoints], np.float64).reshape(-1, 2), descriptors

    def estimate(self, image, depth_m, goal):
        """Pose of the photo's camera in the robot's: rotation and position, or nothing."""
        pixels, descriptors = self.extract(image)
        goal_pixels, goal_descriptors = goal
        if descriptors is None or goal_descriptors is None or len(goal_descriptors) < 2:
            return None
        both = self.matcher.knnMatch(descriptors, goal_descriptors, 2)
        kept = np.array([(a.queryIdx, a.trainIdx) for a, b in both if a.distance < RATIO * b.distance]).reshape(-1, 2)
        seen = pixels[kept[:, 0].astype(int)]
        column, row = np.rint(seen).astype(int).T if len(seen) else (np.zeros(0, int),) * 2
        z = depth_m[row, column]
        valid = z > 0
        if valid.sum() < 6:
            return None
        points = np.column_stack([(seen - CENTRE_PX) / FOCAL_PX * z[:, None], z])[valid]
        rays = goal_pixels[kept[valid, 1].astype(int)]
        found, turned, t, _ = cv2.solvePnPRansac(points, rays, self.camera, None)
        if not found:
            return None
        rotation = cv2.Rodrigues(turned)[0]
        return rotation.T, (-rotation.T @ t).ravel()


class Recording:
    """Frames of a folder in 7-Scenes layout, decoded once."""

    def __init__(self, folder):
        self.folder = folder
        self.numbers = sorted(int(p.name[6:12]) for p in folder.glob("frame-*.pose.txt"))
        self.frames = {}

    def pairs(self, gap, n):
        """Starts spread over the recording."""
        all_pairs = [(q, q + gap) for q in self.numbers if q + gap in set(self.numbers)]
        return [all_pairs[i] for i in np.linspace(0, len(all_pairs) - 1, min(n, len(all_pairs))).astype(int)]

    def frame(self, number):
        if number not in self.frames:
            stem = self.folder / f"frame-{number:06}"
            colour = next(self.folder.glob(f"{stem.name}.color.*"))
            depth = cv2.imread(f"{stem}.depth.png", cv2.IMREAD_UNCHANGED).astype(np.float64)
            depth[depth == 65535] = 0
            self.frames[number] = (cv2.imread(str(colour)), depth * 1e-3)
        return self.frames[number]

    def pose(self, number):
        pose = np.loadtxt(self.folder / f"frame-{number:06}.pose.txt")
        u, _, v = np.linalg.svd(pose[:3, :3])
        pose[:3, :3] = u @ v
        return pose

    def truth(self, query, goal):
        return np.linalg.inv(self.pose(query)) @ self.pose(goal)


def off(found, truth):
    """Metres and degrees."""
    if found is None:
        return np.inf, np.inf
    rotation, position = found
    cosine = 0.5 * (np.trace(rotation.T @ truth[:3, :3]) - 1.0)
    return np.linalg.norm(position - truth[:3, 3]), np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def estimates(found, recording, features):
    """Milliseconds per round and pair of ours and of the peer, and how far each pose is off."""
    ours, peer = Ours(found, features), Peer()
    pairs = recording.pairs(found.gap, found.pairs)
    goals = {goal: peer.extract(recording.frame(goal)[0]) for _, goal in pairs}
    ms, errors, stages = {"ours": [], "peer": []}, {"ours": [], "peer": []}, []
    for turn in range(found.rounds + 1):
        rows = {"ours": [], "peer": []}
        for query, goal in pairs:
            answer = ours.ask(f"pair {query} {goal}")
            image, depth_m = recording.frame(query)
            start = time.perf_counter()
            pose = peer.estimate(image, depth_m, goals[goal])
            rows["peer"].append((time.perf_counter() - start) * 1e3)
            rows["ours"].append(float(answer[0]))
            if turn == 0:
                far = [np.inf if x == "-" else float(x) for x in answer[4:]]
                errors["ours"].append(far)
                errors["peer"].append(off(pose, recording.truth(query, goal)))
            else:
                stages.append([float(x) for x in answer[1:4]])
        # The first round warms up.
        if turn > 0:
            for name, row in rows.items():
                ms[name].append(row)
    ours.close()
    result = {name: figures(ms[name], errors[name]) for name in ms}
    result["ours"]["stages_ms"] = dict(zip(("extract", "match", "pose"), np.median(stages, axis=0).round(2).tolist()))
    for key in ("median_ms", "best_ms"):
        result[f"ratio_{key}"] = result["ours"][key] / result["peer"][key]
    return result


def figures(ms, errors):
    errors = np.array(errors)
    return {
        "median_ms": float(np.median(ms)),
        "best_ms": float(np.median(np.min(ms, axis=0))),
        "within_25cm_10deg": float(np.mean((errors[:, 0] <= 0.25) & (errors[:, 1] <= 10.0))),
    }


# The contract's order of inputs, and what is put in: sides, and the range of the values.
NETWORKS = {
    "extractor": [("image", (1, 1, 480, 640), (0, 255))],
    "matcher": [
        ("keypoints0", (1024, 2), (-1, 1)),
        ("keypoints1", (1024, 2), (-1, 1)),
        ("descriptors0", (1024, 64), (-0.2, 0.2)),
        ("descriptors1", (1024, 64), (-0.2, 0.2)),
        ("scores0", (1024,), (0, 1)),
        ("scores1", (1024,), (0, 1)),
    ],
}


def network(found, role, rounds=30):
    """Milliseconds of the network alone through `ort` and through Python, by turns."""
    models = json.loads((found.models / "manifest.json").read_text())["models"]
    file = found.models / next(m["file"] for m in models if m["kind"] == role)
    rng = np.random.default_rng(1)
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = found.threads
    session = onnxruntime.InferenceSession(str(file), settings, providers=["CPUExecutionProvider"])
    inputs = {}
    for (name, shape, (low, high)), port in zip(NETWORKS[role], ports(session, NETWORKS[role])):
        sides = shape if len(port.shape) == len(shape) else (1, *shape)
        inputs[port.name] = rng.uniform(low, high, sides).astype("<f4")
    with tempfile.NamedTemporaryFile() as put:
        for value in inputs.values():
            put.write(struct.pack(f"<{1 + value.ndim}I", value.ndim, *value.shape) + value.tobytes())
        put.flush()
        ours = Ours(found, OURS, ("--network", role, put.name))
        ms = {"ours": [], "peer": []}
        for turn in range(rounds + 3):
            answer = [float(x) for x in ours.ask("network")]
            start = time.perf_counter()
            outputs = session.run(None, inputs)
            took = (time.perf_counter() - start) * 1e3
            total = sum(float(o.astype(np.float64).sum()) for o in outputs)
            assert np.isclose(total, answer[1], rtol=1e-4), f"{role}: {total} here, {answer[1]} there: not the same work"
            if turn >= 3:
                ms["ours"].append(answer[0])
                ms["peer"].append(took)
        ours.close()
    result = {name: {"median_ms": float(np.median(v)), "best_ms": float(np.min(v))} for name, v in ms.items()}
    for key in ("median_ms", "best_ms"):
        result[f"ratio_{key}"] = result["ours"][key] / result["peer"][key]
    return result


def ports(session, wanted):
    """The model's inputs in the contract's order."""
    by_name = {port.name: port for port in session.get_inputs()}
    if len(wanted) == 1:
        return list(by_name.values())
    return [by_name[name] for name, _, _ in wanted]


def row(name, result, goal):
    verdict = "" if goal is None else f"   goal {goal:.2f}: {'met' if result['ratio_best_ms'] <= goal else 'MISSED'}"
    columns = [result[who][key] for key in ("median_ms", "best_ms") for who in ("ours", "peer")]
    ratios = [result["ratio_median_ms"], result["ratio_best_ms"]]
    print(
        f"  {name:22}{columns[0]:9.2f}{columns[1]:9.2f}{ratios[0]:8.3f}   {columns[2]:9.2f}{columns[3]:9.2f}"
        f"{ratios[1]:8.3f}{verdict}"
    )


def main():
    found = OPTIONS
    cv2.setNumThreads(found.threads)
    print(f"OpenCV {cv2.__version__}, onnxruntime {onnxruntime.__version__}, {found.threads} threads, "
          f"load {os.getloadavg()[0]:.1f} at the start")
    recording = Recording(found.recording)
    table = {"load": os.getloadavg()[0], "threads": found.threads, "estimate": {}, "network": {}}
    head = f"{'median':>14}{'peer':>9}{'ratio':>8}   {'best':>9}{'peer':>9}{'ratio':>8}"
    print(f"\nms a single-frame estimate, {found.pairs} pairs {found.gap} frames apart\n{'':18}{head}")
    for name, features in found.profile.items():
        result = table["estimate"][name] = estimates(found, recording, features)
        row(name, result, found.goals.get(name))
        shares = [result[who]["within_25cm_10deg"] for who in ("ours", "peer")]
        print(f"    {features}: {result['ours']['stages_ms']} ms; within 0.25 m and 10 deg: ours {shares[0]:.2f}, "
              f"peer {shares[1]:.2f}")
    print(f"\nms the network alone, `ort` and Python's onnxruntime\n{'':18}{head}")
    for role in NETWORKS:
        table["network"][role] = network(found, role)
        row(role, table["network"][role], 1.03)
    print(f"\nload {os.getloadavg()[0]:.1f} at the end; a ratio is worth something on a machine that does nothing else")
    if found.json:
        found.json.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
