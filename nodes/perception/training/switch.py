"""The learned switch: an MLP on global descriptors of the robot's image and the goal photo (NRNS; SLING's baseline)."""

import torch
from torch import nn

from .extractor import DIMENSION

# Bounds between the left, middle and right third of an image, in normalised x: a landscape picture reaches from -1 to 1.
THIRDS = (-2.0, -1 / 3, 1 / 3, 2.0)
GLOBAL_DIMENSION = 6 * DIMENSION
THRESHOLD = 0.55


def global_descriptor(points: torch.Tensor, descriptors: torch.Tensor, scores: torch.Tensor) -> torch.Tensor:
    """One vector (384) of an image's keypoints: normalised points n x 2, descriptors n x 64, scores n.

    Mean, standard deviation and maximum of the descriptors, then their means in the left, middle and right third. Means and
    deviations are weighted by score.
    """
    weights = scores / (scores.sum() + 1e-9)
    mean = weights @ descriptors
    deviation = torch.sqrt(weights @ (descriptors - mean).square() + 1e-8)
    parts = [mean, deviation, descriptors.amax(0)]
    for low, high in zip(THIRDS, THIRDS[1:]):
        inside = weights * ((points[:, 0] >= low) & (points[:, 0] < high)).to(weights.dtype)
        parts.append(inside @ descriptors / (inside.sum() + 1e-6))
    return torch.cat(parts)


class SwitchMlp(nn.Module):
    """Global descriptors of two images, n x 384 each, to the logit (n) of their being taken within a step's reach."""

    def __init__(self, hidden: int = 256, dropout: float = 0.5):
        super().__init__()
        self.register_buffer("mean", torch.zeros(GLOBAL_DIMENSION))
        self.register_buffer("deviation", torch.ones(GLOBAL_DIMENSION))
        self.layers = nn.Sequential(
            nn.Dropout(0.2), nn.Linear(2 * GLOBAL_DIMENSION, hidden), nn.ReLU(), nn.Dropout(dropout), nn.Linear(hidden, 1)
        )

    def standardise_by(self, descriptors: torch.Tensor) -> None:
        """Takes mean and deviation of each of the 384 numbers from a set of images (n x 384)."""
        self.mean.copy_(descriptors.mean(0))
        self.deviation.copy_(descriptors.std(0).clamp(min=1e-3))

    def forward(self, query: torch.Tensor, goal: torch.Tensor) -> torch.Tensor:
        both = [(x - self.mean) / self.deviation for x in (query, goal)]
        return self.layers(torch.cat(both, 1))[:, 0]


class ExportedSwitch(nn.Module):
    """What is exported: two images' keypoints, as the matcher takes them, to one probability (1)."""

    def __init__(self, mlp: SwitchMlp):
        super().__init__()
        self.mlp = mlp

    def forward(self, keypoints0, descriptors0, scores0, keypoints1, descriptors1, scores1):
        query = global_descriptor(keypoints0, descriptors0, scores0)
        goal = global_descriptor(keypoints1, descriptors1, scores1)
        return torch.sigmoid(self.mlp(query[None], goal[None]))
