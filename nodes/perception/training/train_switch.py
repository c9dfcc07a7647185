"""Trains the learned switch on global descriptors of exported views.

`python -m training.train_switch --data PAIRS --validation PAIRS --run RUN`. The extractor's keypoints are found once, pooled to
one vector a view and kept in RUN; the MLP then takes a minute. The same seed gives the same weights.
"""

import argparse
import hashlib
import json
import time
from pathlib import Path

import cv2
import numpy as np
import torch
from torch.nn.functional import binary_cross_entropy_with_logits

from .data import PairSet
from .switch import THRESHOLD, SwitchMlp
from .switch_pairs import Pairs, descriptors_of, in_view_pairs, training_pairs

# Views are pooled at their own width and at the robot's.
WIDTHS = (320, 640)
MODELS = Path(__file__).parent.parent / "models"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, nargs="+", required=True, help="exported pair sets of training flats")
    parser.add_argument("--validation", type=Path, required=True, help="exported pair set of validation flats")
    parser.add_argument("--run", type=Path, required=True, help="folder of descriptors and checkpoint")
    parser.add_argument("--extractor", type=Path, default=MODELS / "homing_extractor.onnx")
    parser.add_argument("--epochs", type=int, default=60)
    parser.add_argument("--batch", type=int, default=256, help="pairs a step")
    parser.add_argument("--rate", type=float, default=3e-4)
    parser.add_argument("--decay", type=float, default=1e-2, help="weight decay")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    torch.set_num_threads(options.threads)
    train(options)


def train(options: argparse.Namespace) -> dict:
    """Trains to the end, measures, writes checkpoint.pt; returns the measures."""
    torch.manual_seed(options.seed)
    rng, begin = np.random.default_rng(options.seed), time.monotonic()
    sets = [PairSet([folder]) for folder in options.data]
    found = [_descriptors(s, folder, options) for s, folder in zip(sets, options.data)]
    offsets = np.cumsum([0] + [len(s.views) for s in sets])
    pairs = _joined([training_pairs(s) for s in sets], offsets)
    views = torch.from_numpy(np.concatenate(found))
    mlp = SwitchMlp()
    mlp.standardise_by(views.flatten(0, 1))
    optimizer = torch.optim.AdamW(mlp.parameters(), options.rate, weight_decay=options.decay)
    steps = options.epochs * (4 * len(pairs.positive) // options.batch)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, options.rate, max(steps, 2))
    for epoch in range(options.epochs):
        loss = _epoch(mlp, views, pairs, optimizer, schedule, options.batch, rng)
        if epoch % 10 == 9 or epoch + 1 == options.epochs:
            print(f"epoch {epoch + 1}: loss {loss:.4f}")
    accuracy = measure(mlp.eval(), options)
    print(json.dumps(accuracy, indent=1))
    facts = {
        "data": {folder.name: s.describe() for folder, s in zip(options.data, sets)},
        "positives": len(pairs.positive),
        "batch": options.batch,
        "rate": options.rate,
        "extractor_sha256": hashlib.sha256(options.extractor.read_bytes()).hexdigest(),
    }
    state = {
        "model": mlp.state_dict(), "facts": facts, "accuracy": accuracy, "seed": options.seed, "step": steps,
        "pairs": steps * options.batch, "seconds": time.monotonic() - begin,
    }
    torch.save(state, options.run / "checkpoint.pt")
    return accuracy


def _descriptors(pair_set: PairSet, folder: Path, options: argparse.Namespace) -> np.ndarray:
    return descriptors_of(pair_set, options.extractor, options.run / f"{folder.name}.npy", WIDTHS)


def _joined(parts: list[Pairs], offsets: np.ndarray) -> Pairs:
    fields = ("positive", "near_negative", "far_negative")
    return Pairs(*(np.concatenate([getattr(p, f) + o for p, o in zip(parts, offsets)]) for f in fields))


def _epoch(mlp, views, pairs: Pairs, optimizer, schedule, batch: int, rng: np.random.Generator) -> float:
    """Every positive in both orders and as many negatives, half of them of one flat; returns the mean loss."""
    n = len(pairs.positive)
    near, far = (p[rng.integers(len(p), size=n)] for p in (pairs.near_negative, pairs.far_negative))
    chosen = np.concatenate([pairs.positive, pairs.positive[:, ::-1], near, far])
    labels = torch.from_numpy((np.arange(4 * n) < 2 * n).astype(np.float32))
    swapped = rng.random(4 * n) < 0.5
    chosen[swapped] = chosen[swapped, ::-1]
    versions = rng.integers(views.shape[1], size=chosen.shape)
    order, losses = rng.permutation(4 * n), []
    mlp.train()
    for begin in range(0, 4 * n - batch + 1, batch):
        at = order[begin : begin + batch]
        query, goal = (views[chosen[at, k], versions[at, k]] for k in (0, 1))
        loss = binary_cross_entropy_with_logits(mlp(query, goal), labels[at])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        losses.append(float(loss.detach()))
    return float(np.mean(losses))


def measure(mlp: SwitchMlp, options: argparse.Namespace) -> dict:
    """Shares of validation pairs on which the switch decides rightly, at its threshold, for views at the robot's width."""
    pair_set, rng = PairSet([options.validation]), np.random.default_rng(7)
    views = torch.from_numpy(_descriptors(pair_set, options.validation, options)[:, WIDTHS.index(640)])
    own = training_pairs(pair_set)
    positive = np.concatenate([own.positive, own.positive[:, ::-1]])
    near, far = (p[rng.permutation(len(p))[: len(own.positive)]] for p in (own.near_negative, own.far_negative))
    adjacent = np.concatenate([positive, near, far]), np.arange(len(positive) + len(near) + len(far)) < len(positive)
    return {"adjacent": _shares(mlp, views, *adjacent), "goal_in_view": _shares(mlp, views, *in_view_pairs(pair_set, rng))}


def _shares(mlp: SwitchMlp, views: torch.Tensor, pairs: np.ndarray, labels: np.ndarray) -> dict:
    with torch.no_grad():
        says = torch.sigmoid(mlp(views[pairs[:, 0]], views[pairs[:, 1]])).numpy() > THRESHOLD
    right = says == labels
    shares = {"right": right.mean(), "of_positives": right[labels].mean(), "of_negatives": right[~labels].mean()}
    return {"pairs": len(pairs)} | {name: round(float(share), 3) for name, share in shares.items()}


def load_switch(path: Path) -> tuple[SwitchMlp, dict]:
    """A trained switch, frozen, and the checkpoint's facts."""
    state = torch.load(path, weights_only=True)
    mlp = SwitchMlp()
    mlp.load_state_dict(state["model"])
    return mlp.eval().requires_grad_(False), {name: value for name, value in state.items() if name != "model"}


if __name__ == "__main__":
    main()
