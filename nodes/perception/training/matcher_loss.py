"""Which keypoints truly match, from depth and pose, and how surprised the matcher is by it."""

from dataclasses import dataclass

import numpy as np
import torch

from .extractor import Extractor, heat_map, keypoint_score, sample_descriptors, select_keypoints
from .geometry import Warp
from .matcher import Matcher, Transport, normalised_points, transport

# Partners lie within MATCH_PX of the exact warp; a keypoint with none within LONELY_PX is unmatched; between, undecided.
MATCH_PX, LONELY_PX = 2.5, 5.0
UNMATCHED, UNDECIDED = -1, -2
NMS_RADIUS = 2
CONFIDENCE_MIN = 0.2
# A probability of e^-28 counts as this: no single hopeless keypoint may rule a step.
LEAST_MASS = 1e-12


@dataclass
class KeypointSet:
    """Keypoints of a batch of images, strongest first: pixels n x k x 2, descriptors n x k x 64, scores n x k."""

    points: torch.Tensor
    descriptors: torch.Tensor
    scores: torch.Tensor

    def inputs(self, width: int, height: int) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """As the matcher takes them."""
        return normalised_points(self.points, width, height), self.descriptors, self.scores

    def part(self, side: slice, pairs: slice, count: int) -> "KeypointSet":
        """The strongest `count` keypoints of some of the images: of one side of the pairs, some pairs."""
        return KeypointSet(*(x[side][pairs, :count] for x in (self.points, self.descriptors, self.scores)))


@torch.no_grad()
def extract(extractor: Extractor, images: torch.Tensor, count: int, threshold: float = 0.0) -> KeypointSet:
    """The `count` best keypoints of each image (n x 1 x h x w)."""
    logits, descriptors, reliability = extractor(images)
    score = keypoint_score(heat_map(logits), torch.sigmoid(reliability.float()))
    points, scores = select_keypoints(score, count, NMS_RADIUS, threshold)
    return KeypointSet(points, sample_descriptors(descriptors, points), scores)


def matcher_loss(matcher: Matcher, features: KeypointSet, batch, pairs: slice, count: int, autocast):
    """Loss of some pairs of a batch with the `count` best keypoints an image, and its parts and accuracies for the log.

    `features` holds all images a of the batch, then all images b.
    """
    n = len(batch.samples)
    height, width = batch.images_a.shape[2:]
    a, b = features.part(slice(None, n), pairs, count), features.part(slice(n, None), pairs, count)
    with autocast():
        scores = matcher(*a.inputs(width, height), *b.inputs(width, height))
    plan = transport(*scores, matcher.config.sinkhorn_iterations)
    labels = [
        match_labels(s.warp, pa.double().cpu().numpy(), pb.double().cpu().numpy())
        for s, pa, pb in zip(batch.samples[pairs], a.points, b.points)
    ]
    labels_a = torch.from_numpy(np.stack([l[0] for l in labels])).to(plan.u.device)
    labels_b = torch.from_numpy(np.stack([l[1] for l in labels])).to(plan.u.device)
    return _negative_log_likelihood(plan, labels_a, labels_b)


def _negative_log_likelihood(plan: Transport, labels_a: torch.Tensor, labels_b: torch.Tensor):
    """SuperGlue eq. 10, with matched and lonely keypoints weighing the same."""
    matched, alone_a, alone_b = labels_a >= 0, labels_a == UNMATCHED, labels_b == UNMATCHED
    mass = plan.u * plan.kernel * plan.v
    log_true = torch.log(mass.gather(2, labels_a.clamp(min=0)[..., None])[..., 0].clamp(min=LEAST_MASS))
    positive = -(log_true * matched).sum() / matched.sum().clamp(min=1)
    negative_a = -(torch.log(plan.alone_a.clamp(min=LEAST_MASS)) * alone_a).sum() / alone_a.sum().clamp(min=1)
    negative_b = -(torch.log(plan.alone_b.clamp(min=LEAST_MASS)) * alone_b).sum() / alone_b.sum().clamp(min=1)
    loss = positive + 0.5 * (negative_a + negative_b)
    recall, precision = _accuracy(mass.detach(), labels_a)
    parts = {"matched": positive, "alone": 0.5 * (negative_a + negative_b), "recall": recall, "precision": precision}
    parts["pairs"] = matched.sum() / len(labels_a)
    return loss, {name: float(value.detach()) for name, value in parts.items()}


def _accuracy(mass: torch.Tensor, labels: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Share of true matches found, and share of judged finds that are true: mutual ones above the runtime's threshold."""
    best, partner = mass.max(2)
    found = (best >= mass.amax(1).gather(1, partner)) & (best > CONFIDENCE_MIN)
    right = found & (labels >= 0) & (partner == labels)
    wrong = found & (labels != UNDECIDED) & (partner != labels)
    return right.sum() / (labels >= 0).sum().clamp(min=1), right.sum() / (right.sum() + wrong.sum()).clamp(min=1)


def match_labels(warp: Warp, points_a: np.ndarray, points_b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Partner of every keypoint of a in b, and of b in a: an index, UNMATCHED or UNDECIDED."""
    distance_ab, lost_a = _distances(warp, points_a, points_b)
    distance_ba, lost_b = _distances(warp.reversed(), points_b, points_a)
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


def _distances(warp: Warp, points_a: np.ndarray, points_b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance in b of every warped point of a to every point of b (infinite where unseen), and which fates are known."""
    targets, visible, known = warp.points(points_a)
    # Whatever lies farther out is as good as infinitely far, and single precision is enough for the rest.
    targets = np.clip(targets, -1e4, 1e4).astype(np.float32)
    points_b = points_b.astype(np.float32)
    distance = np.hypot(targets[:, :1] - points_b[None, :, 0], targets[:, 1:] - points_b[None, :, 1])
    distance[~visible] = np.inf
    return distance, known
