"""The matcher: which keypoints of two images show the same point, if any.

SuperGlue's formulation (Sarlin et al. 2020): keypoints exchange messages by self and cross attention over descriptors and
positions, and a partial assignment is found by optimal transport with dustbins. What makes it fit a CPU: 64 dimensions;
self attention to the strongest keypoints only; attention by cosine with a bounded temperature, so that one exponential
serves both directions of a cross layer (LightGlue shares the similarity, here its exponential too); values that carry
positions, so that a cross layer says where a point went; and Sinkhorn by matrix-vector products at inference.
Before training it matches as a dual softmax over the descriptors does: every layer begins as the identity.
"""

from dataclasses import asdict, dataclass
from typing import NamedTuple

import torch
import torch.nn.functional as F
from torch import nn

# exp() of a cosine times this still sums in single precision, whatever the other terms.
TEMPERATURE_MAX = 30.0


@dataclass(frozen=True)
class MatcherConfig:
    """Size of a matcher."""

    dimension: int = 64
    heads: int = 2
    layers: int = 3
    # Self attention looks at this many of the strongest keypoints: keypoints come strongest first.
    anchors: int = 256
    sinkhorn_iterations: int = 5

    def as_dict(self) -> dict:
        """For checkpoints and the manifest."""
        return asdict(self)


class FeedForward(nn.Module):
    """x + MLP(x, message); begins as x."""

    def __init__(self, dimension: int):
        super().__init__()
        self.mlp = nn.Sequential(
            nn.Linear(2 * dimension, 2 * dimension),
            nn.LayerNorm(2 * dimension),
            nn.ReLU(),
            nn.Linear(2 * dimension, dimension),
        )
        nn.init.zeros_(self.mlp[-1].weight)
        nn.init.zeros_(self.mlp[-1].bias)

    def forward(self, x: torch.Tensor, message: torch.Tensor) -> torch.Tensor:
        return x + self.mlp(torch.cat([x, message], -1))


class Temperature(nn.Module):
    """A learned positive factor, at most TEMPERATURE_MAX."""

    def __init__(self, initial: float):
        super().__init__()
        self.logarithm = nn.Parameter(torch.tensor(initial).log())

    def forward(self) -> torch.Tensor:
        return self.logarithm.exp().clamp(max=TEMPERATURE_MAX)


class SelfAttention(nn.Module):
    """Every keypoint asks the strongest ones of its own image; relative positions enter by rotation of queries and keys."""

    def __init__(self, config: MatcherConfig):
        super().__init__()
        self.heads, self.anchors = config.heads, config.anchors
        self.query = nn.Linear(config.dimension, config.dimension)
        self.key_value = nn.Linear(config.dimension, 2 * config.dimension)
        self.temperature = Temperature(8.0)
        self.update = FeedForward(config.dimension)

    def forward(self, x: torch.Tensor, rotation: tuple[torch.Tensor, torch.Tensor]) -> torch.Tensor:
        anchors = x[:, : self.anchors]
        key, value = self.key_value(anchors).chunk(2, -1)
        near = tuple(part[:, :, : self.anchors] for part in rotation)
        query = self.temperature() * rotated(unit(self._split(self.query(x))), rotation)
        key = rotated(unit(self._split(key)), near)
        attention = torch.softmax(query @ key.transpose(-1, -2), -1)
        message = (attention @ self._split(value)).transpose(1, 2).flatten(2)
        return self.update(x, message)

    def _split(self, x: torch.Tensor) -> torch.Tensor:
        """n x k x (heads * d) to n x heads x k x d."""
        return x.unflatten(-1, (self.heads, -1)).transpose(1, 2)


class CrossAttention(nn.Module):
    """Both images ask each other; one similarity and one exponential serve both directions."""

    def __init__(self, config: MatcherConfig):
        super().__init__()
        self.query_key = nn.Linear(config.dimension, config.dimension, bias=False)
        self.value = nn.Linear(config.dimension, config.dimension)
        self.temperature = Temperature(15.0)
        self.update = FeedForward(config.dimension)
        nn.init.eye_(self.query_key.weight)

    def forward(self, x: torch.Tensor, y: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        kx, ky = unit(self.query_key(x)), unit(self.query_key(y))
        weights = torch.exp((self.temperature() * kx @ ky.transpose(-1, -2)).float())
        vx, vy = with_ones(self.value(x)), with_ones(self.value(y))
        return self.update(x, averaged(weights @ vy)), self.update(y, averaged(weights.transpose(-1, -2) @ vx))


def unit(x: torch.Tensor) -> torch.Tensor:
    """Unit length along the last axis."""
    return x * torch.rsqrt((x * x).sum(-1, keepdim=True) + 1e-8)


def with_ones(values: torch.Tensor) -> torch.Tensor:
    """A column of ones, so that one product gives both the weighted sum and the sum of weights."""
    return torch.cat([values, torch.ones_like(values[..., :1])], -1)


def averaged(summed: torch.Tensor) -> torch.Tensor:
    """Weighted sums divided by their sums of weights, which stand in the last column."""
    return summed[..., :-1] / summed[..., -1:]


def rotated(x: torch.Tensor, rotation: tuple[torch.Tensor, torch.Tensor]) -> torch.Tensor:
    """Rotary position encoding (Su et al. 2021): turns pairs of channels by angles linear in the position."""
    cos, sin = rotation
    first, second = x.chunk(2, -1)
    return torch.cat([first * cos - second * sin, second * cos + first * sin], -1)


class Matcher(nn.Module):
    """Keypoints of two images to log scores of every pair and of staying unmatched."""

    def __init__(self, config: MatcherConfig = MatcherConfig()):
        super().__init__()
        self.config = config
        dimension = config.dimension
        self.position = nn.Sequential(nn.Linear(3, 32), nn.ReLU(), nn.Linear(32, dimension))
        nn.init.zeros_(self.position[-1].weight)
        nn.init.zeros_(self.position[-1].bias)
        self.frequencies = nn.Parameter(torch.randn(2, dimension // 2) * 3.0)
        self.self_layers = nn.ModuleList(SelfAttention(config) for _ in range(config.layers))
        self.cross_layers = nn.ModuleList(CrossAttention(config) for _ in range(config.layers))
        self.project = nn.Linear(dimension, dimension, bias=False)
        nn.init.eye_(self.project.weight)
        self.temperature = Temperature(20.0)
        self.dustbin = nn.Linear(dimension, 1)
        nn.init.zeros_(self.dustbin.weight)
        nn.init.constant_(self.dustbin.bias, 10.0)

    def forward(self, points_a, descriptors_a, scores_a, points_b, descriptors_b, scores_b):
        """Positions n x k x 2 (normalised), descriptors n x k x 64, keypoint scores n x k, of either image.

        Returns scores n x ka x kb, dustbin scores n x ka and n x kb.
        """
        x, y, bin_a, bin_b = self.embed(points_a, descriptors_a, scores_a, points_b, descriptors_b, scores_b)
        return (x @ y.transpose(-1, -2)).float(), bin_a, bin_b

    def embed(self, points_a, descriptors_a, scores_a, points_b, descriptors_b, scores_b):
        """The same, with the scores as factors: n x ka x 64 and n x kb x 64, whose products they are."""
        x = self._embedded(points_a, descriptors_a, scores_a)
        y = self._embedded(points_b, descriptors_b, scores_b)
        rotation_x, rotation_y = self._rotation(points_a), self._rotation(points_b)
        for own, other in zip(self.self_layers, self.cross_layers):
            x, y = own(x, rotation_x), own(y, rotation_y)
            x, y = other(x, y)
        bins = self.dustbin(x)[..., 0].float(), self.dustbin(y)[..., 0].float()
        return self.temperature() * unit(self.project(x)), unit(self.project(y)), *bins

    def _embedded(self, points: torch.Tensor, descriptors: torch.Tensor, scores: torch.Tensor) -> torch.Tensor:
        return descriptors + self.position(torch.cat([points, scores[..., None]], -1))

    def _rotation(self, points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        angles = (points @ self.frequencies).unflatten(-1, (self.config.heads, -1)).transpose(1, 2)
        return angles.cos(), angles.sin()


def log_assignment(similarity: torch.Tensor, bin_a: torch.Tensor, bin_b: torch.Tensor, iterations: int) -> torch.Tensor:
    """Sinkhorn in log space: n x ka x kb scores and dustbins to n x (ka + 1) x (kb + 1) log assignment.

    Every keypoint has mass 1, either dustbin as much as the other image has keypoints (SuperGlue eq. 9, 10). This is the
    definition; `transport` computes the same many times faster.
    """
    ka, kb = similarity.shape[1:]
    corner = 0.5 * (bin_a.mean(1) + bin_b.mean(1))
    top = torch.cat([similarity, bin_a[..., None]], 2)
    scores = torch.cat([top, torch.cat([bin_b, corner[:, None]], 1)[:, None]], 1)
    log_mass_a, log_mass_b = scores.new_zeros(ka + 1), scores.new_zeros(kb + 1)
    log_mass_a[-1], log_mass_b[-1] = torch.log(torch.tensor(float(kb))), torch.log(torch.tensor(float(ka)))
    v = torch.zeros_like(scores[:, 0])
    for _ in range(iterations):
        u = log_mass_a - torch.logsumexp(scores + v[:, None], 2)
        v = log_mass_b - torch.logsumexp(scores + u[:, :, None], 1)
    return scores + u[:, :, None] + v[:, None]


class Transport(NamedTuple):
    """A plan u * kernel * v in its factors (n x ka x 1, n x ka x kb, n x 1 x kb), and the masses left in either dustbin."""

    u: torch.Tensor
    kernel: torch.Tensor
    v: torch.Tensor
    alone_a: torch.Tensor
    alone_b: torch.Tensor


def transport(similarity: torch.Tensor, bin_a: torch.Tensor, bin_b: torch.Tensor, iterations: int) -> Transport:
    """The plan of `log_assignment` by products with vectors instead of logarithms of sums.

    Scores are bounded by TEMPERATURE_MAX, so their exponentials need no other protection than this common offset.
    """
    ka, kb = bin_a.shape[1], bin_b.shape[1]
    corner = torch.exp(0.5 * (bin_a.mean(1, keepdim=True) + bin_b.mean(1, keepdim=True)) - TEMPERATURE_MAX)[..., None]
    kernel = torch.exp(similarity - TEMPERATURE_MAX)
    to_bin, from_bin = torch.exp(bin_a - TEMPERATURE_MAX)[:, :, None], torch.exp(bin_b - TEMPERATURE_MAX)[:, None]
    v, v_bin = torch.ones_like(from_bin), torch.ones_like(corner)
    for _ in range(iterations):
        u = 1 / (kernel @ v.transpose(1, 2) + to_bin * v_bin)
        u_bin = kb / ((from_bin * v).sum(2, keepdim=True) + corner * v_bin)
        v = 1 / (u.transpose(1, 2) @ kernel + from_bin * u_bin)
        v_bin = ka / ((to_bin * u).sum(1, keepdim=True) + corner * u_bin)
    return Transport(u, kernel, v, (u * to_bin * v_bin)[..., 0], (u_bin * from_bin * v)[:, 0])


def mutual_matches(x: torch.Tensor, y: torch.Tensor, bin_a: torch.Tensor, bin_b: torch.Tensor, iterations: int):
    """Each keypoint's partner (n x ka, -1 without) if each is the other's best, and the mass between them.

    `x`, `y` are the factors of the scores. The best of a column is sought along rows of the transposed product: runtimes
    search the last axis many times faster than the one before.
    """
    u, kernel, v, _, _ = transport(x @ y.transpose(1, 2), bin_a, bin_b, iterations)
    best, partner = (kernel * v).max(2)
    partner_back = (y @ x.transpose(1, 2) + torch.log(u).transpose(1, 2)).argmax(2)
    mutual = partner_back.gather(1, partner) == torch.arange(x.shape[1], device=x.device)
    return torch.where(mutual, partner, -1), torch.where(mutual, best * u[..., 0], torch.zeros_like(best))


class ExportedMatcher(nn.Module):
    """What is exported: two images' keypoints, without a batch axis, to matches (k of image a, -1 without) and confidences."""

    def __init__(self, matcher: Matcher):
        super().__init__()
        self.matcher = matcher

    def forward(self, keypoints0, descriptors0, scores0, keypoints1, descriptors1, scores1):
        inputs = (keypoints0, descriptors0, scores0, keypoints1, descriptors1, scores1)
        factors = self.matcher.embed(*(x[None] for x in inputs))
        matches, confidences = mutual_matches(*factors, self.matcher.config.sinkhorn_iterations)
        return matches[0], confidences[0]


def normalised_points(points: torch.Tensor, width: int, height: int) -> torch.Tensor:
    """Pixels to positions about the image's middle, in halves of its longer side."""
    middle = points.new_tensor([width / 2, height / 2])
    return (points - middle) / (max(width, height) / 2)
