"""Trains the keypoint extractor: `python -m training.train_extractor --data PAIRS --run RUN`."""

import argparse
from pathlib import Path

import torch

from .data import PairDataset, loader
from .extractor import Extractor
from .extractor_loss import extractor_loss
from .trainer import Plan, add_options, pair_sets, train


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    add_extractor_options(parser)
    train(plan_from(parser.parse_args()))


def add_extractor_options(parser: argparse.ArgumentParser) -> None:
    """All options."""
    add_options(parser, steps=5000, batch=4)
    parser.add_argument("--homographies", type=float, default=0.15, help="share of pairs that are one view warped")
    parser.add_argument("--workers", type=int, default=1, help="processes that prepare pairs")


def plan_from(options: argparse.Namespace) -> Plan:
    """The plan that the options describe."""
    torch.manual_seed(options.seed)
    sets, described = pair_sets(options)
    dataset = PairDataset(sets, options.seed, options.steps * options.batch, options.homographies)
    model = Extractor().to(memory_format=torch.channels_last)
    facts = {"data": described, "homographies": options.homographies, "batch": options.batch, "rate": options.rate}

    def batches(first: int):
        return iter(loader(dataset, first, options.steps, options.batch, options.workers))

    return Plan("extractor", model, extractor_loss, batches, options.rate, options, facts)


def load_extractor(path: Path, device: torch.device) -> tuple[Extractor, dict]:
    """A trained extractor, frozen, and the checkpoint's facts."""
    state = torch.load(path, map_location=device, weights_only=True)
    extractor = Extractor()
    extractor.load_state_dict(state["model"])
    extractor = extractor.to(device).eval().requires_grad_(False).to(memory_format=torch.channels_last)
    return extractor, {name: value for name, value in state.items() if name not in ("model", "optimizer")}


if __name__ == "__main__":
    main()
