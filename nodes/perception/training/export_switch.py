"""Exports the learned switch to ONNX, checks and times it as `training.export` does, and enters it in the manifest.

`python -m training.export_switch --switch RUN/checkpoint.pt`; the manifest must list the extractor it was trained on.
"""

import argparse
import json
from pathlib import Path

from .export import MATCH_INPUTS, _check, _entry, _keypoints, _time, _write
from .switch import THRESHOLD, ExportedSwitch
from .train_switch import MODELS, load_switch

NAME = "homing-switch"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--switch", type=Path, required=True, help="checkpoint of the trained switch")
    parser.add_argument("--out", type=Path, default=MODELS)
    options = parser.parse_args()
    manifest = json.loads((options.out / "manifest.json").read_text())
    entry = export_switch(options.switch, options.out, manifest["models"])
    manifest["models"] = [m for m in manifest["models"] if m["name"] != NAME] + [entry]
    (options.out / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")
    print(f"{entry['bytes'] / 1e6:.2f} MB in {options.out}")


def export_switch(checkpoint: Path, out: Path, models: list[dict]) -> dict:
    """Writes homing_switch.onnx; returns its manifest entry."""
    mlp, facts = load_switch(checkpoint)
    trained_on = facts["facts"]["extractor_sha256"]
    extractor = next((m for m in models if m["sha256"] == trained_on), None)
    if extractor is None:
        raise ValueError(f"no model of {out} has sha256 {trained_on}: the switch was trained on another extractor")
    model, path = ExportedSwitch(mlp).eval(), out / "homing_switch.onnx"
    axes = {name: {0: f"count{name[-1]}"} for name in MATCH_INPUTS}
    _write(model, _keypoints(512, 500), path, MATCH_INPUTS, ["probability"], axes)
    for counts in ((1024, 1024), (300, 700), (3, 1)):
        _check(model, path, _keypoints(*counts), MATCH_INPUTS, tolerance=1e-4)
    milliseconds = _time(path, _keypoints(1024, 1024), MATCH_INPUTS, "1024x1024")
    contract = {
        "contract": NAME,
        "inputs": next(m["inputs"] for m in models if m["name"] == "homing-matcher"),
        "outputs": {"probability": "1 float32: image 0 was taken at most 1 m and 45 deg from image 1"},
        "at_least": "1 keypoint in either image",
        "threshold": THRESHOLD,
    }
    entry = _entry(NAME, "switch", path, facts, {}, contract, milliseconds)
    entry["accuracy"] = {"validation": facts["accuracy"]}
    return entry | {"extractor": extractor["name"], "extractor_sha256": trained_on}


if __name__ == "__main__":
    main()
