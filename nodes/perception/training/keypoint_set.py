"""Keypoints of images as the extractor finds them: what the matcher is trained and measured on."""

from dataclasses import dataclass

import torch

from .extractor import Extractor, keypoint_score, sample_descriptors, select_keypoints

NMS_RADIUS = 2


@dataclass
class KeypointSet:
    """Keypoints of a batch of images, strongest first: pixels n x k x 2, descriptors n x k x 64, scores n x k."""

    points: torch.Tensor
    descriptors: torch.Tensor
    scores: torch.Tensor


@torch.no_grad()
def extract(extractor: Extractor, images: torch.Tensor, count: int, threshold: float = 0.0) -> KeypointSet:
    """The `count` best keypoints of each image (n x 1 x h x w)."""
    heat, descriptors, reliability = extractor(images)
    score = keypoint_score(heat, torch.sigmoid(reliability.float()))
    points, scores = select_keypoints(score, count, NMS_RADIUS, threshold)
    return KeypointSet(points, sample_descriptors(descriptors, points), scores)
