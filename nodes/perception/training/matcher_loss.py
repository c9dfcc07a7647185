"""Which keypoints truly match, from depth and pose, and how surprised the matcher is by it, after every layer."""

import numpy as np
import torch
import torch.nn.functional as F

from .geometry import Warp
from .matcher import Assignment, log_matchable, mutual_matches
from .transport import transport, transported_matches

# Partners lie within MATCH_PX of the exact warp; a keypoint with none within LONELY_PX is unmatched; between, undecided.
MATCH_PX, LONELY_PX = 2.5, 5.0
UNMATCHED, UNDECIDED = -1, -2
# Matches above this count as found, in the log.
CONFIDENCE_MIN = 0.2


def matcher_loss(
    assignments: list[Assignment], labels_a: torch.Tensor, labels_b: torch.Tensor, fast_layers: int, iterations: int = 0
):
    """Loss over all layers, those at which a matcher ends counting double; and parts for the log.

    With `iterations` the last layer is judged by its transport's plan, as all others are by their double softmax.
    """
    losses, parts = [], {}
    for layer, assignment in enumerate(assignments, 1):
        own = iterations if layer == len(assignments) else 0
        positive, negative = _surprise(assignment, labels_a, labels_b, own)
        ends = layer in (fast_layers, len(assignments))
        losses.append((2.0 if ends else 1.0) * (positive + negative))
        if ends:
            name = "" if layer == len(assignments) else "_fast"
            recall, precision = _accuracy(assignment, labels_a, own)
            parts |= {f"matched{name}": positive, f"alone{name}": negative}
            parts |= {f"recall{name}": recall, f"precision{name}": precision}
    parts["true"] = (labels_a >= 0).sum() / len(labels_a)
    return sum(losses) / (len(losses) + 2), {name: float(value.detach()) for name, value in parts.items()}


def _surprise(assignment, labels_a, labels_b, iterations: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Negative log likelihoods, of the true matches and of being alone: of the plan if there are iterations."""
    log_match, log_alone_a, log_alone_b = (_of_plan if iterations else _of_softmaxes)(assignment, labels_a, iterations)
    matched, alone_a, alone_b = labels_a >= 0, labels_a == UNMATCHED, labels_b == UNMATCHED
    positive = -(log_match * matched).sum() / matched.sum().clamp(min=1)
    negative_a = -(log_alone_a * alone_a).sum() / alone_a.sum().clamp(min=1)
    negative_b = -(log_alone_b * alone_b).sum() / alone_b.sum().clamp(min=1)
    return positive, 0.5 * (negative_a + negative_b)


def _of_softmaxes(assignment: Assignment, labels_a: torch.Tensor, _: int) -> tuple[torch.Tensor, ...]:
    """Log likelihoods of every keypoint of a with its partner, and of either image's keypoints alone (LightGlue eq. 11)."""
    rows, columns = assignment.log_sums()
    partner = labels_a.clamp(min=0)
    own, other = log_matchable(assignment.logit_x), log_matchable(assignment.logit_y)
    log_match = 2 * _similarity(assignment, partner) - rows - columns.gather(1, partner) + own + other.gather(1, partner)
    return log_match, -F.softplus(assignment.logit_x), -F.softplus(assignment.logit_y)


def _of_plan(assignment: Assignment, labels_a: torch.Tensor, iterations: int) -> tuple[torch.Tensor, ...]:
    """The same by the transport's plan (SuperGlue eq. 11)."""
    plan = transport(assignment, iterations)
    partner = labels_a.clamp(min=0)
    scale_a, scale_b = torch.log(plan.u[..., 0]), torch.log(plan.v[:, 0])
    log_match = _similarity(assignment, partner) + scale_a + scale_b.gather(1, partner)
    return log_match, torch.log(plan.alone_a + 1e-12), torch.log(plan.alone_b + 1e-12)


def _similarity(assignment: Assignment, partner: torch.Tensor) -> torch.Tensor:
    """Similarity of every keypoint of a with one of b."""
    return (assignment.x * assignment.y.gather(1, partner[..., None].expand_as(assignment.x))).sum(2)


@torch.no_grad()
def _accuracy(assignment: Assignment, labels: torch.Tensor, iterations: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Share of true matches found, and share of judged finds that are true."""
    partner, confidence = transported_matches(assignment, iterations) if iterations else mutual_matches(assignment)
    found = (partner >= 0) & (confidence > CONFIDENCE_MIN)
    right = found & (labels >= 0) & (partner == labels)
    wrong = found & (labels != UNDECIDED) & (partner != labels)
    return right.sum() / (labels >= 0).sum().clamp(min=1), right.sum() / (right.sum() + wrong.sum()).clamp(min=1)


def match_labels(warp: Warp, points_a: np.ndarray, points_b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Partner of every keypoint of a in b, and of b in a: an index, UNMATCHED or UNDECIDED."""
    distance_ab, lost_a = distances(warp, points_a, points_b)
    distance_ba, lost_b = distances(warp.reversed(), points_b, points_a)
    error = np.maximum(distance_ab, distance_ba.T)
    best_b, best_a = error.argmin(1), error.argmin(0)
    index = np.arange(len(points_a))
    mutual = (best_a[best_b] == index) & (error[index, best_b] < MATCH_PX)
    near_b = np.minimum(distance_ab.min(0), distance_ba.min(1))
    near_a = np.minimum(distance_ab.min(1), distance_ba.min(0))
    labels_a = np.where(lost_a & (near_a > LONELY_PX), UNMATCHED, UNDECIDED)
    labels_b = np.where(lost_b & (near_b > LONELY_PX), UNMATCHED, UNDECIDED)
    labels_a[mutual] = best_b[mutual]
    labels_b[best_b[mutual]] = index[mutual]
    return labels_a.astype(np.int64), labels_b.astype(np.int64)


def distances(warp: Warp, points_a: np.ndarray, points_b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance in b of every warped point of a to every point of b (infinite where unseen), and which fates are known."""
    targets, visible, known = warp.points(points_a)
    # Whatever lies farther out is as good as infinitely far, and single precision is enough for the rest.
    targets = np.clip(targets, -1e4, 1e4).astype(np.float32)
    points_b = points_b.astype(np.float32)
    distance = np.sqrt((targets[:, :1] - points_b[None, :, 0]) ** 2 + (targets[:, 1:] - points_b[None, :, 1]) ** 2)
    distance[~visible] = np.inf
    return distance, known
