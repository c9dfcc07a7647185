"""Quick checks of what everything else rests on: `python -m training.selftest` (about half a minute, no data needed)."""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import torch

from . import augment
from .extractor import Extractor, heat_map
from .geometry import View, Warp, transform_points
from .matcher import ExportedMatcher, Matcher, log_assignment, transport
from .matcher_loss import UNMATCHED, match_labels
from .synthetic import write_set
from .train_extractor import plan_from as extractor_plan
from .train_matcher import plan_from as matcher_plan
from .trainer import Run, add_options, loader


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
            check_sinkhorn,
            check_untrained_matcher_is_nearest_neighbour,
            check_untrained_heat_map_prefers_corners,
            check_labels_are_mutual,
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


def check_sinkhorn() -> None:
    """Columns of the plan sum to their masses exactly, rows nearly; the fast form equals the one in log space."""
    similarity, bin_a, bin_b = torch.randn(2, 30, 41) * 3, torch.randn(2, 30), torch.randn(2, 41)
    plan = log_assignment(similarity, bin_a, bin_b, iterations=100).exp()
    assert torch.allclose(plan[:, :, :-1].sum(1), torch.ones(2, 41), atol=1e-4)
    assert torch.allclose(plan[:, :-1].sum(2), torch.ones(2, 30), atol=1e-2)
    few = log_assignment(similarity, bin_a, bin_b, iterations=5).exp()
    fast = transport(similarity, bin_a, bin_b, 5)
    assert torch.allclose(fast.u * fast.kernel * fast.v, few[:, :-1, :-1], atol=1e-4)
    assert torch.allclose(fast.alone_a, few[:, :-1, -1], atol=1e-4)
    assert torch.allclose(fast.alone_b, few[:, -1, :-1], atol=1e-4)


def check_untrained_matcher_is_nearest_neighbour() -> None:
    """Before training, a permuted set of descriptors is matched to itself."""
    descriptors = torch.nn.functional.normalize(torch.randn(50, 64), dim=1)
    order, points, scores = torch.randperm(50), torch.rand(50, 2), torch.rand(50)
    with torch.no_grad():
        matches, confidences = ExportedMatcher(Matcher())(
            points, descriptors, scores, points[order], descriptors[order], scores[order]
        )
    assert (order[matches] == torch.arange(50)).all() and float(confidences.min()) > 0.5


def check_untrained_heat_map_prefers_corners() -> None:
    """Before training, a bright square's corners are hotter than its edges and inside."""
    image = torch.full((1, 1, 64, 96), 40.0)
    image[:, :, 20:44, 30:66] = 200.0
    with torch.no_grad():
        heat = heat_map(Extractor().eval()(image)[0])[0, 0]
    corner = float(heat[18:23, 28:33].max())
    assert corner > 3 * float(heat[18:23, 44:52].max()) and corner > 3 * float(heat[28:36, 44:52].max())


def check_labels_are_mutual() -> None:
    """Points and their exact images are each other's partners; points that leave the image are unmatched."""
    a, b = _plane_view(0.0, 0.0, 2.0), _plane_view(0.8, 0.0, 2.0)
    warp = Warp(a, b, np.eye(3), np.eye(3), False, (240, 320), (240, 320))
    points_a = np.array([[200.0, 50], [250, 100], [300, 150], [20, 120]])
    points_b = np.array([[220.0, 150], [120, 50], [170, 100]])
    labels_a, labels_b = match_labels(warp, points_a, points_b)
    assert list(labels_a) == [1, 2, 0, UNMATCHED] and list(labels_b) == [2, 0, 1]


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
    options = _options(folder, "matcher")
    options.extractor, options.layers = whole._checkpoint_path(), 2
    options.keypoints, options.rounds = (64, 96), 2
    assert np.isfinite(_advanced(matcher_plan(options), 2).last["loss"])


def _options(folder: Path, run: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_options(parser, steps=4, batch=2)
    return parser.parse_args(
        ["--data", str(folder / "rooms"), "--run", str(folder / run), "--device", "cpu", "--precision", "fp32"]
        + ["--threads", "1", "--workers", "0"]
    )


def _advanced(plan, steps: int) -> Run:
    run = Run(plan)
    batches = iter(loader(plan.dataset, run.step, plan.options.steps, plan.options.batch, 0))
    for _ in range(steps):
        run.last = run.advance(next(batches))
    return run


if __name__ == "__main__":
    main()
