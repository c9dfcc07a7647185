"""The learning curve: accuracy on validation flats of the snapshots that training runs left."""

import argparse
import csv
import json
from pathlib import Path

import numpy as np
import torch

from .evaluate import MODERATE, as_text, is_moderate, measure_all, validation_pairs

PLOTTED = ("0.25m_10deg", "0.1m_2deg", "matching_accuracy")


def write_curve(options: argparse.Namespace) -> None:
    """Measures snapshots of every run in `options.curve`; writes OUT.json, OUT.csv and OUT.png."""
    pairs = [pair for pair in validation_pairs(options) if is_moderate(pair)]
    sift = measure_all(["sift"], pairs, options)["sift"][MODERATE]
    rows = [{"run": "SIFT", "step": 0, "pairs_seen": 0, "minutes": 0.0} | sift]
    for run in options.curve:
        for path in _spread(sorted((run / "snapshots").glob("*.pt")), options.points):
            rows += _rows(path, pairs, options)
            print(as_text({f"{rows[-1]['run']} {rows[-1]['step']}": {MODERATE: rows[-1]}}), flush=True)
    out = options.out or Path("curve.json")
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(rows, indent=1) + "\n")
    with out.with_suffix(".csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    _plot(rows, out.with_suffix(".png"))


def _rows(path: Path, pairs, options: argparse.Namespace) -> list[dict]:
    """One row for each way in which a snapshot is used."""
    state = torch.load(path, map_location="cpu", weights_only=True)
    chosen = argparse.Namespace(**vars(options))
    if state["name"] == "extractor":
        chosen.extractor, methods = path, ["mutual", "wide"]
    else:
        chosen.matcher, methods = path, ["fast", "accurate"]
    facts = {"step": state["step"], "pairs_seen": state["pairs"], "minutes": round(state["seconds"] / 60, 1)}
    measured = measure_all(methods, pairs, chosen)
    return [{"run": f"{state['name']}, {method}"} | facts | measured[method][MODERATE] for method in methods]


def _spread(paths: list[Path], count: int) -> list[Path]:
    """At most `count` of them, evenly spread, the last included."""
    if len(paths) <= count:
        return paths
    return [paths[i] for i in np.unique(np.linspace(0, len(paths) - 1, count).round().astype(int))]


def _plot(rows: list[dict], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(PLOTTED), figsize=(4 * len(PLOTTED), 3.2))
    for axis, quantity in zip(axes, PLOTTED):
        axis.axhline(rows[0][quantity], color="grey", linestyle=":", label="SIFT, ratio test")
        for run in dict.fromkeys(row["run"] for row in rows[1:]):
            points = [row for row in rows if row["run"] == run]
            axis.plot([p["pairs_seen"] for p in points], [p[quantity] for p in points], marker="o", markersize=3, label=run)
        axis.set_xlabel("training pairs seen")
        axis.set_title(quantity)
        axis.set_ylim(0, 1)
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
