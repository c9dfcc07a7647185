"""Exports trained checkpoints to ONNX, checks them against PyTorch, times them, and writes the manifest.

`python -m training.export --extractor RUN/checkpoint.pt [--matcher RUN/checkpoint.pt] --accuracy FILE.json --out models`
The accurate matcher may come from a checkpoint of its own (`--accurate`), of which the first layers are the fast one's.
"""

import argparse
import hashlib
import json
import subprocess
import time
from pathlib import Path

import numpy as np
import onnxruntime
import torch

from .exported import ExportedMatcher, ExportedR2d2
from .extractor import ExportedExtractor
from .train_extractor import load_extractor
from .train_matcher import load_matcher

OPSET = 18
LICENCE = "Apache-2.0 OR MIT"
IMAGE_INPUTS, IMAGE_OUTPUTS = ["image"], ["heat_map", "descriptors", "reliability"]
WIDE_OUTPUTS = ["descriptors", "reliability", "repeatability"]
MATCH_INPUTS = ["keypoints0", "descriptors0", "scores0", "keypoints1", "descriptors1", "scores1"]
MATCH_OUTPUTS = ["matches0", "confidences0"]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--extractor", type=Path, required=True)
    parser.add_argument("--matcher", type=Path)
    parser.add_argument("--accurate", type=Path, help="checkpoint of the accurate matcher, if not that of --matcher")
    parser.add_argument("--confidence", type=float, default=0.2, help="least confidence of a match, chosen on validation")
    parser.add_argument("--confidence-accurate", type=float, help="the same of the accurate matcher, if another")
    parser.add_argument("--accuracy", type=Path, action="append", default=[], help="JSON that training.evaluate wrote")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent.parent / "models")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    accuracy = {path.stem: json.loads(path.read_text()) for path in options.accuracy}
    entries = [export_extractor(options.extractor, options.out, accuracy)]
    entries.append(export_wide(options.extractor, options.out, accuracy))
    if options.matcher:
        entries.append(export_matcher("homing-matcher", options, accuracy, entries[0]))
        options.matcher = options.accurate or options.matcher
        options.confidence = options.confidence if options.confidence_accurate is None else options.confidence_accurate
        entries.append(export_matcher("homing-matcher-accurate", options, accuracy, entries[0]))
    manifest = {"format": 1, "grey": "0.299 R + 0.587 G + 0.114 B, 0 to 255", "models": entries}
    (options.out / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")
    print(f"{sum(e['bytes'] for e in entries) / 1e6:.2f} MB in {options.out}")


def export_extractor(checkpoint: Path, out: Path, accuracy: dict) -> dict:
    """Writes homing_extractor.onnx; returns its manifest entry."""
    extractor, facts = load_extractor(checkpoint, torch.device("cpu"))
    model = ExportedExtractor(extractor).eval().to(memory_format=torch.contiguous_format)
    path = out / "homing_extractor.onnx"
    axes = {"image": {2: "height", 3: "width"}, "heat_map": {2: "height", 3: "width"}}
    axes |= {name: {2: "height_8", 3: "width_8"} for name in ("descriptors", "reliability")}
    _write(model, (_image(480, 640),), path, IMAGE_INPUTS, IMAGE_OUTPUTS, axes)
    for height, width in ((480, 640), (256, 320)):
        _check(model, path, (_image(height, width),), IMAGE_INPUTS, tolerance=2e-3)
    milliseconds = _time(path, (_image(480, 640),), IMAGE_INPUTS, "640x480")
    contract = {
        "inputs": {"image": "1 x 1 x H x W float32 grey, 0 to 255; H and W multiples of 32"},
        "outputs": {
            "heat_map": "1 x 1 x H x W strength of a keypoint",
            "descriptors": "1 x 64 x H/8 x W/8, unit length over the channels; sample at ((x + 0.5) / 8 - 0.5), renormalise",
            "reliability": "1 x 1 x H/8 x W/8 probability; score of a keypoint = heat_map x bilinear reliability",
        },
    }
    contract["selection"] = (
        "local maxima of the score over 5x5, at least 4 px from the border, above 0.002, strongest first; "
        "each moved to the scores' centre of gravity over 3x3"
    )
    return _entry("homing-extractor", "extractor", path, facts, accuracy, contract, milliseconds)


def export_wide(checkpoint: Path, out: Path, accuracy: dict) -> dict:
    """Writes homing_r2d2.onnx, the same keypoints with 128-d descriptors under contract "r2d2"; returns its manifest entry."""
    extractor, facts = load_extractor(checkpoint, torch.device("cpu"))
    model = ExportedR2d2(extractor).eval().to(memory_format=torch.contiguous_format)
    path = out / "homing_r2d2.onnx"
    axes = {"image": {2: "height", 3: "width"}, "descriptors": {2: "height_8", 3: "width_8"}}
    axes |= {name: {2: "height", 3: "width"} for name in ("reliability", "repeatability")}
    _write(model, (_colours(480, 640),), path, IMAGE_INPUTS, WIDE_OUTPUTS, axes)
    for height, width in ((480, 640), (256, 320)):
        _check(model, path, (_colours(height, width),), IMAGE_INPUTS, tolerance=2e-3)
    milliseconds = _time(path, (_colours(480, 640),), IMAGE_INPUTS, "640x480")
    contract = {
        "contract": "r2d2",
        "inputs": {"image": "1 x 3 x H x W float32, (RGB / 255 - ImageNet's mean) / ImageNet's deviation; multiples of 32"},
        "outputs": {
            "descriptors": "1 x 128 x H/8 x W/8, unit length over the channels; sample at ((x + 0.5) / 8 - 0.5), renormalise",
            "reliability": "1 x 1 x H x W, 0.7 to 1",
            "repeatability": "1 x 1 x H x W, 0 to 1, 0 except at local maxima over 5x5; keypoints from 0.7",
        },
    }
    return _entry("homing-r2d2", "extractor", path, facts, accuracy, contract, milliseconds)


def export_matcher(name: str, options: argparse.Namespace, accuracy: dict, extractor_entry: dict) -> dict:
    """Writes the first layers of the matcher, or all, by its name; returns its manifest entry, which names its extractor."""
    matcher, facts = load_matcher(options.matcher, torch.device("cpu"))
    layers = matcher.config.layers if name.endswith("accurate") else matcher.config.fast_layers
    model = ExportedMatcher(matcher, layers).eval()
    path = options.out / f"{name.replace('-', '_')}.onnx"
    axes = {name: {0: f"count{name[-1]}"} for name in MATCH_INPUTS}
    axes |= {name: {0: "count0"} for name in MATCH_OUTPUTS}
    _write(model, _keypoints(512, 500), path, MATCH_INPUTS, MATCH_OUTPUTS, axes)
    for counts in ((1024, 1024), (300, 700), (3, 1)):
        _check(model, path, _keypoints(*counts), MATCH_INPUTS, tolerance=2e-3)
    milliseconds = _time(path, _keypoints(1024, 1024), MATCH_INPUTS, "1024x1024")
    contract = {
        "inputs": {
            "keypointsI": "N x 2 float32, (pixel - (W/2, H/2)) / (max(W, H)/2); strongest keypoint first",
            "descriptorsI": "N x 64 float32 of the extractor, unit length",
            "scoresI": "N float32, heat_map x reliability",
        },
        "outputs": {
            "matches0": "N0 int64: index into keypoints1, -1 if the two are not each other's best",
            "confidences0": "N0 float32, probability of the match",
        },
        "at_least": "1 keypoint in either image",
    }
    iterations = matcher.config.iterations_after(layers)
    contract["assignment"] = f"optimal transport, {iterations} iterations" if iterations else "double softmax, matchabilities"
    contract["confidence_min"], contract["layers"] = options.confidence, layers
    entry = _entry(name, "matcher", path, facts, accuracy, contract, milliseconds)
    return entry | {"extractor": extractor_entry["name"], "extractor_sha256": extractor_entry["sha256"]}


def _image(height: int, width: int) -> torch.Tensor:
    """A picture with structure at several scales."""
    rng = np.random.default_rng(1)
    total = np.zeros((height, width), np.float32)
    for step in (4, 16, 64):
        coarse = rng.uniform(0, 85, (-(-height // step), -(-width // step))).astype(np.float32)
        total += np.kron(coarse, np.ones((step, step), np.float32))[:height, :width]
    return torch.from_numpy(total)[None, None]


def _colours(height: int, width: int) -> torch.Tensor:
    """The same in three channels, normalised as contract "r2d2" asks."""
    return (_image(height, width).repeat(1, 3, 1, 1) / 255 - 0.45) / 0.225


def _keypoints(count_a: int, count_b: int) -> tuple[torch.Tensor, ...]:
    generator = torch.Generator().manual_seed(2)

    def image(count: int) -> tuple[torch.Tensor, ...]:
        points = torch.rand(count, 2, generator=generator) * 2 - 1
        descriptors = torch.nn.functional.normalize(torch.randn(count, 64, generator=generator), dim=1)
        return points, descriptors, torch.rand(count, generator=generator).sort(descending=True).values

    return image(count_a) + image(count_b)


def _write(model, example, path: Path, inputs: list[str], outputs: list[str], axes: dict) -> None:
    with torch.no_grad():
        torch.onnx.export(
            model, example, str(path), input_names=inputs, output_names=outputs, dynamic_axes=axes,
            opset_version=OPSET, dynamo=False, do_constant_folding=True,
        )


def _session(path: Path, threads: int) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def _check(model, path: Path, inputs, names: list[str], tolerance: float) -> None:
    """Stops unless onnxruntime and PyTorch agree. Indices may differ where two partners are equally good."""
    with torch.no_grad():
        expected = [e.numpy() for e in model(*inputs)]
    actual = _session(path, 1).run(None, {n: i.numpy() for n, i in zip(names, inputs)})
    for want, got in zip(expected, actual):
        if want.dtype == np.int64:
            share = float((want != got).mean())
            if share > 0.01:
                raise RuntimeError(f"{path.name}: {share:.1%} of the matches differ from PyTorch's")
            continue
        error = float(np.abs(want - got).max())
        if not error <= tolerance and (np.abs(want - got) > tolerance).mean() > 0.001:
            raise RuntimeError(f"{path.name}: differs from PyTorch by {error}, more than {tolerance}")
    print(f"{path.name}: agrees with PyTorch at {[tuple(i.shape) for i in inputs][:1]}")


def _time(path: Path, inputs, names: list[str], size: str) -> dict:
    """Least and median milliseconds on one and two threads: far apart where the machine was busy with other work."""
    feed = {n: i.numpy() for n, i in zip(names, inputs)}
    found = {}
    for threads in (1, 2):
        session = _session(path, threads)
        for _ in range(3):
            session.run(None, feed)
        times = []
        for _ in range(31):
            begin = time.perf_counter()
            session.run(None, feed)
            times.append(1e3 * (time.perf_counter() - begin))
        least, median = round(min(times), 1), round(float(np.median(times)), 1)
        found[f"{size}_threads_{threads}"] = {"least": least, "median": median}
    print(f"{path.name}: milliseconds {found}")
    return found


# Of the methods that `training.evaluate` measures, the one that stands for a model.
OWN_METHOD = {
    "homing-extractor": "mutual",
    "homing-r2d2": "wide",
    "homing-matcher": "fast",
    "homing-matcher-accurate": "accurate",
}


def _entry(name: str, kind: str, path: Path, facts: dict, accuracy: dict, contract: dict, milliseconds: dict) -> dict:
    data = path.read_bytes()
    return {
        "name": name,
        "kind": kind,
        "file": path.name,
        "sha256": hashlib.sha256(data).hexdigest(),
        "bytes": len(data),
        "opset": OPSET,
        "licence": LICENCE,
        **contract,
        "training": {
            "commit": _commit(),
            "seed": facts["seed"],
            "steps": facts["step"],
            "pairs": facts["pairs"],
            "minutes": round(facts["seconds"] / 60, 1),
            **facts["facts"],
        },
        "milliseconds_cpu": milliseconds,
        "accuracy": {pairs: {OWN_METHOD[name]: found.get(OWN_METHOD[name])} for pairs, found in accuracy.items()},
    }


def _commit() -> str:
    """The commit of the training code, marked if it was changed since."""
    folder = Path(__file__).parent
    head = subprocess.run(["git", "rev-parse", "HEAD"], cwd=folder, capture_output=True, text=True, check=True).stdout.strip()
    changed = subprocess.run(["git", "status", "--porcelain", "."], cwd=folder, capture_output=True, text=True, check=True).stdout
    return head + ("+changed" if changed.strip() else "")


if __name__ == "__main__":
    main()
