"""Trains the keypoint extractor: `python -m training.train_extractor --data PAIRS --run RUN`."""

import argparse

import torch

from .extractor import Extractor
from .extractor_loss import extractor_loss
from .trainer import Plan, add_options, dataset_from, train


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    add_options(parser, steps=5000, batch=8)
    train(plan_from(parser.parse_args()))


def plan_from(options: argparse.Namespace) -> Plan:
    """The plan that the options describe."""
    torch.manual_seed(options.seed)
    dataset, described = dataset_from(options, "extractor")
    model = Extractor().to(memory_format=torch.channels_last)
    facts = {"data": described, "homographies": options.homographies, "batch": options.batch, "rate": options.rate}
    return Plan("extractor", model, _step_losses, dataset, options.rate, options, facts)


def _step_losses(model, batch, _step, autocast):
    yield extractor_loss(model, batch, autocast)


if __name__ == "__main__":
    main()
