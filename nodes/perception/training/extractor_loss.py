"""What makes an extractor good: descriptors that tell true matches from all others, and knowing where they will not."""

from dataclasses import dataclass

import torch
import torch.nn.functional as F

from .extractor import Extractor, sample_descriptors
from .keypoint_targets import POINTS_MAX, ExtractorTargets

COSINE_SCALE = 20.0
# Points this close to the true match show nearly the same patch: they are no counter-examples.
AMBIGUOUS_PX = 10.0
RELIABILITY_WEIGHT, WIDE_WEIGHT = 0.5, 0.5


@dataclass
class _Points:
    a: torch.Tensor
    b: torch.Tensor
    weights: torch.Tensor


def extractor_loss(model: Extractor, batch, autocast) -> tuple[torch.Tensor, dict[str, float]]:
    """Loss of a batch, and its parts and accuracies for the log. `autocast` makes the context of the forward pass."""
    targets = [s.targets for s in batch.samples]
    count = len(targets)
    with autocast():
        descriptors, wide, reliability = model.both(torch.cat([batch.images_a, batch.images_b]))
    points = _padded(targets, batch.images_a.device)
    excluded = _excluded(points)
    descriptor, probability, accuracy = _descriptor_loss(descriptors[:count], descriptors[count:], points, excluded)
    descriptor_wide, _, accuracy_wide = _descriptor_loss(wide[:count], wide[count:], points, excluded)
    trust = 0.5 * (
        _reliability_loss(reliability[:count], points.a, probability, points.weights)
        + _reliability_loss(reliability[count:], points.b, probability, points.weights)
    )
    loss = descriptor + WIDE_WEIGHT * descriptor_wide + RELIABILITY_WEIGHT * trust
    parts = {"descriptor": descriptor, "wide": descriptor_wide, "reliability": trust}
    parts |= {"top1": accuracy, "top1_wide": accuracy_wide}
    return loss, {name: float(value.detach()) for name, value in parts.items()}


def _padded(targets: list[ExtractorTargets], device) -> _Points:
    """Points of all samples padded to POINTS_MAX with weight 0."""
    count = len(targets)
    a, b = torch.zeros(count, POINTS_MAX, 2), torch.zeros(count, POINTS_MAX, 2)
    weights = torch.zeros(count, POINTS_MAX)
    for i, t in enumerate(targets):
        n = len(t.weights)
        a[i, :n], b[i, :n] = torch.from_numpy(t.points_a), torch.from_numpy(t.points_b)
        weights[i, :n] = torch.from_numpy(t.weights)
    return _Points(a.to(device), b.to(device), weights.to(device))


def _excluded(points: _Points) -> torch.Tensor:
    """Which pairs of points say nothing of descriptors: the padding, and neighbours of the true match."""
    present = points.weights > 0
    diagonal = torch.eye(POINTS_MAX, dtype=torch.bool, device=points.a.device)
    near_a = torch.cdist(points.a, points.a) < AMBIGUOUS_PX
    near_b = torch.cdist(points.b, points.b) < AMBIGUOUS_PX
    outside = ~(present[:, :, None] & present[:, None, :])
    return ((near_a | near_b) & ~diagonal) | outside


def _descriptor_loss(a: torch.Tensor, b: torch.Tensor, points: _Points, excluded: torch.Tensor):
    """Negative log of the dual softmax at the true matches; also each point's match probability and the top-1 share."""
    da, db = sample_descriptors(a, points.a), sample_descriptors(b, points.b)
    similarity = (COSINE_SCALE * da @ db.transpose(1, 2)).masked_fill(excluded, -1e4)
    present = points.weights > 0
    log_rows, log_columns = F.log_softmax(similarity, 2), F.log_softmax(similarity, 1)
    log_match = (log_rows + log_columns).diagonal(dim1=1, dim2=2)
    total = points.weights.sum().clamp(min=1)
    loss = -(log_match * points.weights).sum() / total
    top = (similarity.argmax(2) == torch.arange(POINTS_MAX, device=da.device)) & present
    return loss, torch.exp(0.5 * log_match).detach(), top.sum() / present.sum().clamp(min=1)


def _reliability_loss(logits: torch.Tensor, points: torch.Tensor, probability: torch.Tensor, weights: torch.Tensor):
    """Cross entropy between the predicted reliability and how surely the point was matched."""
    rows, columns = logits.shape[2:]
    grid = (points + 0.5) / points.new_tensor([columns * 8, rows * 8]) * 2 - 1
    sampled = F.grid_sample(
        logits.float(), grid[:, None], mode="bilinear", padding_mode="border", align_corners=False
    )[:, 0, 0]
    entropy = F.binary_cross_entropy_with_logits(sampled, probability, reduction="none")
    return (entropy * weights).sum() / weights.sum().clamp(min=1)
