"""Quick checks of what everything else rests on: `python -m training.selftest` (about half a minute, no data needed)."""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import torch

from . import augment
from .extractor import Extractor
from .features import write as write_features
from .geometry import View, Warp, transform_points
from .matcher import Assignment, Matcher, log_probability, mutual_matches
from .matcher_loss import UNMATCHED, match_labels
from .switch import ExportedSwitch, SwitchMlp, global_descriptor
from .synthetic import write_set
from .train_extractor import add_extractor_options
from .train_extractor import plan_from as extractor_plan
from .train_matcher import add_matcher_options
from .train_matcher import plan_from as matcher_plan
from .trainer import Run
from .transport import log_plan, transport, transported_matches


def main() -> None:
    """Runs every check; the first that fails raises."""
    torch.manual_seed(0)
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        write_set(Path(folder) / "rooms", range(1, 4), n_views=6)
        for check in (
            check_warp_on_a_plane,
            check_warp_sees_occlusion,
            check_homography_round_trip,
            check_matches_are_the_best_of_the_assignment,
            check_transport_is_that_of_the_definition,
            check_transport_moves_all_masses,
            check_fast_matcher_is_the_first_layers,
            check_heat_map_finds_blobs,
            check_labels_are_mutual,
            check_global_descriptor_by_hand,
        ):
            check()
            print(f"ok  {check.__name__}")
        check_resume_gives_the_same_next_step(Path(folder))
        print("ok  check_resume_gives_the_same_next_step")


def _plane_view(x_m: float, slope: float, offset_m: float) -> View:
    """A camera at (x_m, 0, 0) looking along world z at the plane z = offset + slope * x."""
    k = np.array([[200.0, 0, 159.5], [0, 200.0, 119.5], [0, 0, 1]])
    ray_x = (np.arange(320) - 159.5) / 200
    depth = (offset_m + slope * x_m) / (1 - slope * ray_x)
    pose = np.eye(4)
    pose[0, 3] = x_m
    return View(k, pose, np.broadcast_to(depth, (240, 320)).astype(np.float32))


def check_warp_on_a_plane() -> None:
    """A point of a slanted plane lands where projecting the true point says, to a thousandth of a pixel."""
    a, b = _plane_view(0.0, 0.3, 3.0), _plane_view(0.4, 0.3, 3.0)
    warp = Warp(a, b, np.eye(3), np.eye(3), False, (240, 320), (240, 320))
    points = np.random.default_rng(0).uniform([60, 5], [310, 230], (500, 2))
    landed, visible, known = warp.points(points)
    z = 3.0 / (1 - 0.3 * (points[:, 0] - 159.5) / 200)
    x = ((points[:, 0] - 159.5) / 200 * z - 0.4) / z * 200 + 159.5
    inside = (x >= 0) & (x <= 319)
    assert known.all() and (visible == inside).all()
    assert np.abs(landed[inside, 0] - x[inside]).max() < 1e-3 and np.abs(landed[:, 1] - points[:, 1]).max() < 1e-3
    back, _, _ = warp.reversed().points(landed[visible])
    assert np.abs(back - points[visible]).max() < 1e-2


def check_warp_sees_occlusion() -> None:
    """A surface that something nearer hides is known to be invisible."""
    a, b = _plane_view(0.0, 0.0, 3.0), _plane_view(0.1, 0.0, 3.0)
    b.depth_m = b.depth_m.copy()
    b.depth_m[:, 100:200] = 1.0
    warp = Warp(a, b, np.eye(3), np.eye(3), False, (240, 320), (240, 320))
    points = np.array([[150.0, 120.0], [300.0, 120.0]])
    _, visible, known = warp.points(points)
    assert known.all() and list(visible) == [False, True]


def check_homography_round_trip() -> None:
    """One view warped twice: there and back again is the identity."""
    rng = np.random.default_rng(3)
    view = _plane_view(0.0, 0.1, 2.0)
    maps = augment.random_zoom((240, 320), rng), augment.random_homography((240, 320), rng)
    warp = Warp(view, view, *maps, True, (240, 320), (240, 320))
    native = rng.uniform([0, 0], [319, 239], (200, 2))
    landed, visible, _ = warp.points(transform_points(maps[0], native))
    assert visible.any() and np.abs(landed - transform_points(maps[1], native)).max() < 1e-6


def _random_keypoints(n: int, count: int) -> tuple[torch.Tensor, ...]:
    descriptors = torch.nn.functional.normalize(torch.randn(n, count, 64), dim=2)
    return torch.rand(n, count, 2) * 2 - 1, descriptors, torch.rand(n, count)


def check_matches_are_the_best_of_the_assignment() -> None:
    """The matches, found without forming the probabilities, are the mutual maxima of the probabilities."""
    with torch.no_grad():
        assignment = Matcher()(*_random_keypoints(2, 30), *_random_keypoints(2, 41))[-1]
    matches, confidences = mutual_matches(assignment)
    probability = log_probability(assignment).exp()
    best, partner = probability.max(2)
    mutual = probability.argmax(1).gather(1, partner) == torch.arange(30)
    assert torch.equal(matches, torch.where(mutual, partner, -1)) and mutual.any()
    assert torch.allclose(confidences, best * mutual, rtol=1e-3, atol=1e-6) and float(probability.sum(2).max()) <= 1 + 1e-4


def _random_assignment(n: int, count_a: int, count_b: int) -> Assignment:
    with torch.no_grad():
        return Matcher()(*_random_keypoints(n, count_a), *_random_keypoints(n, count_b))[-1]


def check_transport_is_that_of_the_definition() -> None:
    """The plan by products with vectors is the one in logarithms, and the matches are its mutual maxima."""
    assignment = _random_assignment(2, 30, 41)
    plan, log = transport(assignment, 4), log_plan(Assignment(*(part.double() for part in assignment)), 4)
    between = log[:, :-1, :-1].exp().float()
    assert torch.allclose(plan.u * plan.weights * plan.v, between, rtol=1e-3, atol=1e-7)
    assert torch.allclose(plan.alone_a, log[:, :-1, -1].exp().float(), rtol=1e-3, atol=1e-7)
    assert torch.allclose(plan.alone_b, log[:, -1, :-1].exp().float(), rtol=1e-3, atol=1e-7)
    matches, confidences = transported_matches(assignment, 4)
    best, partner = between.max(2)
    mutual = between.argmax(1).gather(1, partner) == torch.arange(30)
    assert torch.equal(matches, torch.where(mutual, partner, -1)) and mutual.any()
    assert torch.allclose(confidences, best * mutual, rtol=1e-3, atol=1e-7)


def check_transport_moves_all_masses() -> None:
    """Rows and columns of a plan sum to their masses; the first normalisation leaves a keypoint what its matchability says."""
    assignment = _random_assignment(1, 30, 41)
    plan = transport(assignment, 200)
    between = plan.u * plan.weights * plan.v
    assert torch.allclose(between.sum(2) + plan.alone_a, torch.ones(1, 30), atol=1e-3)
    assert torch.allclose(between.sum(1) + plan.alone_b, torch.ones(1, 41), atol=1e-3)
    whole = log_plan(assignment, 200).exp()
    assert abs(float(whole[:, -1].sum()) - 41) < 0.05 and abs(float(whole[:, :, -1].sum()) - 30) < 0.05
    first = transport(assignment, 1).u[..., 0] * assignment.weights.sum(2)
    assert torch.allclose(first, torch.sigmoid(assignment.logit_x), rtol=1e-4)


def check_fast_matcher_is_the_first_layers() -> None:
    """Asked for fewer layers, the matcher gives what it gave after them."""
    matcher, keypoints = Matcher(), _random_keypoints(1, 20) + _random_keypoints(1, 25)
    with torch.no_grad():
        fast, whole = matcher(*keypoints, layers=2), matcher(*keypoints)
    assert len(fast) == 2 and torch.equal(fast[1].weights, whole[1].weights)


def check_heat_map_finds_blobs() -> None:
    """Spots are the strongest maxima, at their places; an edge is none."""
    y, x = np.mgrid[:64, :96]
    image = np.where(x > 70, 160.0, 80.0)
    for cx, cy in ((20.0, 20.0), (40.0, 44.0)):
        image += 60 * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / 8)
    with torch.no_grad():
        heat = Extractor().eval()(torch.from_numpy(image)[None, None].float())[0][0, 0]
    strongest = {tuple(divmod(int(i), 96)) for i in heat.flatten().topk(2).indices}
    assert strongest == {(20, 20), (44, 40)} and float(heat[10:54, 66:76].max()) < 0.1 * float(heat.max())


def check_labels_are_mutual() -> None:
    """Points and their exact images are each other's partners; points that leave the image are unmatched."""
    a, b = _plane_view(0.0, 0.0, 2.0), _plane_view(0.8, 0.0, 2.0)
    warp = Warp(a, b, np.eye(3), np.eye(3), False, (240, 320), (240, 320))
    points_a = np.array([[200.0, 50], [250, 100], [300, 150], [20, 120]])
    points_b = np.array([[220.0, 150], [120, 50], [170, 100]])
    labels_a, labels_b = match_labels(warp, points_a, points_b)
    assert list(labels_a) == [1, 2, 0, UNMATCHED] and list(labels_b) == [2, 0, 1]


def check_global_descriptor_by_hand() -> None:
    """Two keypoints, left and right, the second three times as strong."""
    descriptors = torch.zeros(2, 64)
    descriptors[0, 0], descriptors[1, 0], descriptors[1, 5] = 1.0, 0.6, 0.8
    points, scores = torch.tensor([[-0.9, 0.0], [0.9, 0.0]]), torch.tensor([1.0, 3.0])
    mean, deviation, most, left, middle, right = global_descriptor(points, descriptors, scores).view(6, 64)
    assert torch.allclose(mean[[0, 5, 9]], torch.tensor([0.7, 0.6, 0.0])) and torch.equal(most[[0, 5]], torch.tensor([1.0, 0.8]))
    # Weights 1/4 and 3/4: the variance of 1 and 0.6 is 0.03, of 0 and 0.8 it is 0.12.
    assert torch.allclose(deviation[[0, 5]].square(), torch.tensor([0.03, 0.12]), atol=1e-6)
    assert torch.allclose(left, descriptors[0], atol=1e-5) and torch.allclose(right, descriptors[1], atol=1e-5)
    assert float(middle.abs().max()) == 0.0
    images = [points, descriptors, scores] * 2
    assert ExportedSwitch(SwitchMlp().eval())(*images).shape == (1,)


def check_resume_gives_the_same_next_step(folder: Path) -> None:
    """Three steps at once, and two steps, a checkpoint and one more: the same loss and the same weights."""
    whole = _advanced(extractor_plan(_options(folder, "whole")), 3)
    broken = _advanced(extractor_plan(_options(folder, "broken")), 2)
    broken.folder.mkdir(exist_ok=True)
    broken._save(broken._checkpoint_path())
    resumed = _advanced(extractor_plan(_options(folder, "broken")), 1)
    assert resumed.step == whole.step == 3 and resumed.last == whole.last
    for one, other in zip(whole.model.state_dict().values(), resumed.model.state_dict().values()):
        assert torch.equal(one, other)
    whole.folder.mkdir(exist_ok=True)
    whole._save(whole._checkpoint_path())
    _check_matcher_trains(folder, whole._checkpoint_path())


def _check_matcher_trains(folder: Path, extractor: Path) -> None:
    """Keypoints are found; the matcher makes two steps on them, and its layers behind the fast one's two more by transport."""
    arguments = argparse.Namespace(
        extractor=extractor, data=folder / "rooms", out=folder / "features", versions=2, seed=0, part="0/1"
    )
    write_features(arguments)
    common = ("--features", str(folder / "features"), "--keypoints", "64")
    softmax = _advanced(matcher_plan(_options(folder, "matcher", *common)), 2)
    assert np.isfinite(softmax.last["loss"])
    softmax.folder.mkdir(exist_ok=True)
    softmax._save(softmax._checkpoint_path())
    start = ("--start", str(softmax._checkpoint_path()))
    plan = _advanced(matcher_plan(_options(folder, "transport", *common, *start)), 2)
    assert np.isfinite(plan.last["loss"]) and not plan.last["dropped"]
    _check_fast_layers_stayed(softmax.model, plan.model)


def _check_fast_layers_stayed(before: Matcher, after: Matcher) -> None:
    """The fast matcher says the same after the rest was trained further; the whole one does not."""
    keypoints = _random_keypoints(1, 20) + _random_keypoints(1, 25)
    with torch.no_grad():
        old, new = before.eval()(*keypoints), after.eval()(*keypoints)
    fast = before.config.fast_layers
    assert torch.equal(old[fast - 1].weights, new[fast - 1].weights) and not torch.equal(old[-1].weights, new[-1].weights)


def _options(folder: Path, run: str, *more: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    (add_matcher_options if more else add_extractor_options)(parser)
    return parser.parse_args(
        ["--data", str(folder / "rooms"), "--run", str(folder / run), "--device", "cpu", "--precision", "fp32"]
        + ["--threads", "1", "--steps", "4", "--batch", "2", *(more or ("--workers", "0"))]
    )


def _advanced(plan, steps: int) -> Run:
    run = Run(plan)
    batches = plan.batches(run.step)
    for _ in range(steps):
        run.last = run.advance(next(batches))
    return run


if __name__ == "__main__":
    main()
