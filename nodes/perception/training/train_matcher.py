"""Trains the matcher on the keypoints of a frozen extractor, which `training.features` found.

`python -m training.train_matcher --data PAIRS --features KEYPOINTS --run RUN`, as many --features as --data, in that order.
With `--start CHECKPOINT` the layers behind the fast matcher's are trained further, by the plan of the optimal transport.
"""

import argparse
from pathlib import Path

import torch

from .feature_pairs import FeaturePairs, FeatureSet
from .features import Features
from .matcher import Matcher, MatcherConfig
from .matcher_loss import matcher_loss
from .trainer import Plan, add_options, pair_sets, train


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    add_matcher_options(parser)
    train(plan_from(parser.parse_args()))


def add_matcher_options(parser: argparse.ArgumentParser) -> None:
    """All options."""
    add_options(parser, steps=8000, batch=8)
    parser.add_argument("--features", type=Path, action="append", required=True, help="keypoints of the pair set of --data")
    parser.add_argument("--layers", type=int, default=MatcherConfig.layers)
    parser.add_argument("--start", type=Path, help="checkpoint to go on from, whose fast matcher stays exactly as it is")
    parser.add_argument("--keypoints", type=int, nargs="+", default=(192, 256, 384), help="keypoints an image, one is drawn")
    parser.add_argument("--same-view", type=float, default=0.05, help="share of pairs that are two versions of one view")


def plan_from(options: argparse.Namespace) -> Plan:
    """The plan that the options describe."""
    torch.manual_seed(options.seed)
    sets, described = pair_sets(options)
    if len(options.features) != len(sets):
        raise ValueError(f"{len(sets)} --data but {len(options.features)} --features: name one for each")
    read = [FeatureSet(s, Features(folder, s), share) for (s, share), folder in zip(sets, options.features)]
    pairs = FeaturePairs(read, options.seed, options.batch, list(options.keypoints), options.same_view)
    matcher = Matcher(MatcherConfig(layers=options.layers))
    facts = {
        "data": described,
        "versions": [s.features.versions for s in read],
        "same_view": options.same_view,
        "keypoints": list(options.keypoints),
        "batch": options.batch,
        "rate": options.rate,
        "config": matcher.config.as_dict(),
        "extractor_checkpoint_sha256": read[0].features.about["extractor_sha256"],
    }

    iterations = matcher.config.transport_iterations if options.start else 0
    if options.start:
        facts["start"] = _start(matcher, options.start)

    def loss(model: Matcher, batch, autocast):
        with autocast():
            assignments = model(*batch.a, *batch.b)
        return matcher_loss(assignments, batch.labels_a, batch.labels_b, model.config.fast_layers, iterations)

    def batches(first: int):
        return pairs.batches(first, options.steps)

    return Plan("matcher", matcher, loss, batches, options.rate, options, facts)


def _start(matcher: Matcher, path: Path) -> dict:
    """Takes a trained matcher's weights and freezes those of the fast matcher; says where they came from."""
    trained, facts = load_matcher(path, torch.device("cpu"))
    matcher.load_state_dict(trained.state_dict())
    matcher.freeze_fast_layers()
    return {"seed": facts["seed"], "steps": facts["step"], "pairs": facts["pairs"], "minutes": round(facts["seconds"] / 60, 1)}


def load_matcher(path: Path, device: torch.device) -> tuple[Matcher, dict]:
    """A trained matcher, frozen, and the checkpoint's facts."""
    state = torch.load(path, map_location=device, weights_only=True)
    matcher = Matcher(MatcherConfig(**state["facts"]["config"]))
    matcher.load_state_dict(state["model"])
    facts = {name: value for name, value in state.items() if name not in ("model", "optimizer")}
    facts["facts"] = state["facts"] | {"config": matcher.config.as_dict()}
    return matcher.to(device).eval().requires_grad_(False), facts


if __name__ == "__main__":
    main()
