"""Trains the matcher on a frozen extractor: `python -m training.train_matcher --extractor CHECKPOINT --data PAIRS --run RUN`."""

import argparse
from pathlib import Path

import numpy as np
import torch

from .extractor import Extractor
from .matcher import Matcher, MatcherConfig
from .matcher_loss import extract, matcher_loss
from .trainer import Plan, add_options, dataset_from, device_from, train


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    add_options(parser, steps=4000, batch=8)
    parser.add_argument("--extractor", type=Path, required=True, help="checkpoint or snapshot of the trained extractor")
    parser.add_argument("--layers", type=int, default=MatcherConfig.layers)
    parser.add_argument("--keypoints", type=int, nargs=2, default=(192, 384), help="least and most keypoints an image")
    parser.add_argument("--rounds", type=int, default=2, help="times that a batch's features are used")
    train(plan_from(parser.parse_args()))


def plan_from(options: argparse.Namespace) -> Plan:
    """The plan that the options describe."""
    torch.manual_seed(options.seed)
    dataset, described = dataset_from(options, "matcher")
    extractor, extractor_facts = load_extractor(options.extractor, device_from(options.device))
    matcher = Matcher(MatcherConfig(layers=options.layers))
    facts = {
        "data": described,
        "homographies": options.homographies,
        "batch": options.batch,
        "rate": options.rate,
        "rounds": options.rounds,
        "config": matcher.config.as_dict(),
        "extractor_step": extractor_facts["step"],
    }

    def step_losses(model, batch, step, autocast):
        rng = np.random.default_rng([options.seed, step, 1])
        low, high = options.keypoints
        with autocast():
            features = extract(extractor, torch.cat([batch.images_a, batch.images_b]), high)
        # Features cost more than the matcher does: each batch serves several updates, by halves, with other keypoint counts.
        half = max(1, options.batch // 2)
        for _ in range(options.rounds):
            for begin in range(0, options.batch, half):
                pairs = slice(begin, min(begin + half, options.batch))
                yield matcher_loss(model, features, batch, pairs, int(rng.integers(low, high + 1)), autocast)

    return Plan("matcher", matcher, step_losses, dataset, options.rate, options, facts)


def load_extractor(path: Path, device: torch.device) -> tuple[Extractor, dict]:
    """A trained extractor, frozen, and the checkpoint's facts."""
    state = torch.load(path, map_location=device, weights_only=True)
    extractor = Extractor()
    extractor.load_state_dict(state["model"])
    extractor = extractor.to(device).eval().requires_grad_(False).to(memory_format=torch.channels_last)
    return extractor, {name: value for name, value in state.items() if name not in ("model", "optimizer")}


def load_matcher(path: Path, device: torch.device) -> tuple[Matcher, dict]:
    """A trained matcher, frozen, and the checkpoint's facts."""
    state = torch.load(path, map_location=device, weights_only=True)
    matcher = Matcher(MatcherConfig(**state["facts"]["config"]))
    matcher.load_state_dict(state["model"])
    facts = {name: value for name, value in state.items() if name not in ("model", "optimizer")}
    return matcher.to(device).eval().requires_grad_(False), facts


if __name__ == "__main__":
    main()
