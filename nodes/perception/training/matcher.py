"""The matcher: which keypoints of two images show the same point, if any.

Self and cross attention over descriptors and positions (SuperGlue, Sarlin et al. 2020), with relative positions in self
attention. It ends with a double softmax and matchabilities (LightGlue, Lindenberger et al. 2023) where it is to be fast, and
with SuperGlue's optimal transport, in `transport`, where it is to be accurate. What makes it fit a CPU: 64 dimensions; self
attention to the strongest keypoints only; and one similarity, bounded so that its exponential needs no protection, which serves both directions of a cross layer and is at once an assignment. So every layer
can be the last: a fast matcher is the first layers of an accurate one.

A cross layer also says in plain numbers where a keypoint would go, how surely, and how alone it is: its neighbours then learn
from it how the scene moved. The similarity compares where a keypoint is expected with where one is, beside descriptors.
"""

from dataclasses import asdict, dataclass
from typing import NamedTuple

import torch
from torch import nn

# exp() of a similarity up to this, squared, still is a number in single precision.
TEMPERATURE_MAX = 40.0
# Numbers that a cross layer says in plain: own position, position of the partner, the way between, sureness, loneliness.
PLAIN = 8


@dataclass(frozen=True)
class MatcherConfig:
    """Size of a matcher."""

    descriptor: int = 64
    dimension: int = 64
    heads: int = 2
    layers: int = 6
    # The fast matcher ends after this layer.
    fast_layers: int = 3
    # Self attention looks at this many of the strongest keypoints: keypoints come strongest first.
    anchors: int = 256
    # Channels of the similarity that compare where a keypoint is expected with where one is.
    place: int = 16
    # Sinkhorn's iterations where the accurate matcher ends: by optimal transport.
    transport_iterations: int = 4

    def iterations_after(self, layer: int) -> int:
        """Iterations of the transport by which a matcher ends after this layer (from 1); 0 for a double softmax."""
        return self.transport_iterations if layer == self.layers > self.fast_layers else 0

    def as_dict(self) -> dict:
        """For checkpoints and the manifest."""
        return asdict(self)


class FeedForward(nn.Module):
    """x + MLP(x, message)."""

    def __init__(self, dimension: int, message: int):
        super().__init__()
        self.mlp = nn.Sequential(
            nn.Linear(dimension + message, 2 * dimension),
            nn.LayerNorm(2 * dimension),
            nn.ReLU(),
            nn.Linear(2 * dimension, dimension),
        )
        with torch.no_grad():
            self.mlp[-1].weight *= 0.3

    def forward(self, x: torch.Tensor, *message: torch.Tensor) -> torch.Tensor:
        return x + self.mlp(torch.cat([x, *message], -1))


class SelfAttention(nn.Module):
    """Every keypoint asks the strongest ones of its own image; relative positions enter by rotation of queries and keys."""

    def __init__(self, config: MatcherConfig):
        super().__init__()
        self.heads, self.anchors = config.heads, config.anchors
        self.scale = (config.dimension // config.heads) ** -0.5
        self.query = nn.Linear(config.dimension, config.dimension)
        self.key_value = nn.Linear(config.dimension, 2 * config.dimension)
        self.update = FeedForward(config.dimension, config.dimension)

    def forward(self, x: torch.Tensor, rotation: tuple[torch.Tensor, torch.Tensor]) -> torch.Tensor:
        key, value = self.key_value(x[:, : self.anchors]).chunk(2, -1)
        near = tuple(part[:, :, : self.anchors] for part in rotation)
        query = rotated(self._split(self.query(x)) * self.scale, rotation)
        attention = torch.softmax(query @ rotated(self._split(key), near).transpose(-1, -2), -1)
        return self.update(x, (attention @ self._split(value)).transpose(1, 2).flatten(2))

    def _split(self, x: torch.Tensor) -> torch.Tensor:
        """n x k x (heads * d) to n x heads x k x d."""
        return x.unflatten(-1, (self.heads, -1)).transpose(1, 2)


class Assignment(NamedTuple):
    """The similarity n x ka x kb in its factors, its exponential, and the logits that a keypoint has a partner at all.

    The probability of a match is the product of two softmaxes, over rows and over columns, and of both matchabilities.
    """

    x: torch.Tensor
    y: torch.Tensor
    weights: torch.Tensor
    logit_x: torch.Tensor
    logit_y: torch.Tensor

    def log_sums(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Logarithms of the softmaxes' denominators: n x ka over rows, n x kb over columns."""
        # A product with ones: ONNX Runtime takes a sixth of the whole matcher's time to sum columns.
        ones = torch.ones_like(self.weights[:, :, :1])
        columns = (ones.transpose(1, 2) @ self.weights)[:, 0]
        return torch.log(self.weights.sum(2)), torch.log(columns)


class Assign(nn.Module):
    """Compares all keypoints of two images."""

    def __init__(self, config: MatcherConfig):
        super().__init__()
        self.place = config.place
        self.project = nn.Linear(config.dimension, config.dimension, bias=False)
        self.expected_actual = nn.Linear(config.dimension, 2 * config.place)
        self.matchable = nn.Linear(config.dimension, 1)
        # Ten times its logarithm's rate: the temperature has far to go.
        self.logarithm = nn.Parameter(torch.tensor(20.0).log() / 10)
        nn.init.orthogonal_(self.project.weight)
        with torch.no_grad():
            self.expected_actual.weight *= 0.3

    def forward(self, x: torch.Tensor, y: torch.Tensor) -> Assignment:
        temperature = (10 * self.logarithm).exp().clamp(max=TEMPERATURE_MAX)
        factor_x = temperature * self._factor(x, swapped=False)
        factor_y = self._factor(y, swapped=True)
        weights = torch.exp((factor_x @ factor_y.transpose(-1, -2)).float())
        return Assignment(factor_x, factor_y, weights, self.matchable(x)[..., 0].float(), self.matchable(y)[..., 0].float())

    def _factor(self, x: torch.Tensor, swapped: bool) -> torch.Tensor:
        expected, actual = self.expected_actual(x).chunk(2, -1)
        place = (actual, expected) if swapped else (expected, actual)
        return unit(torch.cat([self.project(x), *place], -1).float())


class CrossAttention(nn.Module):
    """Both images ask each other with the weights of an assignment."""

    def __init__(self, config: MatcherConfig):
        super().__init__()
        self.value = nn.Linear(config.dimension, config.dimension)
        self.update = FeedForward(config.dimension, config.dimension + PLAIN)

    def forward(self, x, y, points_x, points_y, assignment: Assignment) -> tuple[torch.Tensor, torch.Tensor]:
        weights = assignment.weights
        back = weights.transpose(1, 2)
        summed_x = weights @ self._values(y, points_y, weights)
        summed_y = back @ self._values(x, points_x, weights)
        squares = weights * weights
        sure_x = squares @ (1 / summed_y[..., -1:])
        sure_y = squares.transpose(1, 2) @ (1 / summed_x[..., -1:])
        return self._updated(x, points_x, summed_x, sure_x), self._updated(y, points_y, summed_y, sure_y)

    def _values(self, x: torch.Tensor, points: torch.Tensor, weights: torch.Tensor) -> torch.Tensor:
        """Values, positions, and a column of ones, so that one product gives the weighted sums and the sum of weights."""
        return torch.cat([self.value(x).to(weights.dtype), points, torch.ones_like(points[..., :1])], -1)

    def _updated(self, x: torch.Tensor, points: torch.Tensor, summed: torch.Tensor, sure: torch.Tensor) -> torch.Tensor:
        mean = summed[..., :-1] / summed[..., -1:]
        message, partner = mean[..., :-2], mean[..., -2:]
        sure, alone = sure / summed[..., -1:], 0.1 * torch.log(summed[..., -1:])
        return self.update(x, message, points, partner, partner - points, sure, alone)


def unit(x: torch.Tensor) -> torch.Tensor:
    """Unit length along the last axis."""
    return x * torch.rsqrt((x * x).sum(-1, keepdim=True) + 1e-8)


def rotated(x: torch.Tensor, rotation: tuple[torch.Tensor, torch.Tensor]) -> torch.Tensor:
    """Rotary position encoding (Su et al. 2021): turns pairs of channels by angles linear in the position."""
    cos, sin = rotation
    first, second = x.chunk(2, -1)
    return torch.cat([first * cos - second * sin, second * cos + first * sin], -1)


class Matcher(nn.Module):
    """Keypoints of two images to an assignment after every layer."""

    def __init__(self, config: MatcherConfig = MatcherConfig()):
        super().__init__()
        self.config = config
        self.widen = nn.Identity() if config.dimension == config.descriptor else nn.Linear(config.descriptor, config.dimension)
        self.position = nn.Sequential(nn.Linear(3, 32), nn.ReLU(), nn.Linear(32, config.dimension))
        # From the whole picture to a tenth of it: every head looks far and near.
        reach = torch.logspace(0, 1.2, config.dimension // (2 * config.heads)).repeat(config.heads)
        self.frequencies = nn.Parameter(torch.randn(2, config.dimension // 2) * reach)
        self.self_layers = nn.ModuleList(SelfAttention(config) for _ in range(config.layers))
        self.assign_layers = nn.ModuleList(Assign(config) for _ in range(config.layers))
        self.cross_layers = nn.ModuleList(CrossAttention(config) for _ in range(config.layers - 1))

    def forward(self, points_a, descriptors_a, scores_a, points_b, descriptors_b, scores_b, layers: int | None = None):
        """Positions n x k x 2 (normalised), descriptors n x k x 64, keypoint scores n x k, of either image.

        Returns the assignments after each of the first `layers` layers (all of them if not given).
        """
        x = self._embedded(points_a, descriptors_a, scores_a)
        y = self._embedded(points_b, descriptors_b, scores_b)
        rotation_x, rotation_y = self._rotation(points_a), self._rotation(points_b)
        assignments = []
        for layer in range(layers or self.config.layers):
            if layer:
                x, y = self.cross_layers[layer - 1](x, y, points_a, points_b, assignments[-1])
            x, y = self.self_layers[layer](x, rotation_x), self.self_layers[layer](y, rotation_y)
            assignments.append(self.assign_layers[layer](x, y))
        return assignments

    def freeze_fast_layers(self) -> None:
        """Leaves only what comes behind the fast matcher's last assignment to be trained."""
        fast = self.config.fast_layers
        self.requires_grad_(False)
        for behind in (self.cross_layers[fast - 1 :], self.self_layers[fast:], self.assign_layers[fast:]):
            behind.requires_grad_(True)

    def _embedded(self, points: torch.Tensor, descriptors: torch.Tensor, scores: torch.Tensor) -> torch.Tensor:
        # Components of about one, as the layers expect.
        descriptors = self.widen(descriptors * self.config.descriptor**0.5)
        return descriptors + self.position(torch.cat([points, torch.log(scores + 1e-3)[..., None] / 3], -1))

    def _rotation(self, points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        angles = (points @ self.frequencies).unflatten(-1, (self.config.heads, -1)).transpose(1, 2)
        return angles.cos(), angles.sin()


def log_matchable(logits: torch.Tensor) -> torch.Tensor:
    """Logarithm of the probability that a keypoint has a partner."""
    return nn.functional.logsigmoid(logits)


def log_probability(assignment: Assignment) -> torch.Tensor:
    """Log probability of every pair, n x ka x kb (LightGlue eq. 8). The definition; `mutual_matches` never forms it."""
    rows, columns = assignment.log_sums()
    own = log_matchable(assignment.logit_x) - rows
    other = log_matchable(assignment.logit_y) - columns
    return 2 * torch.log(assignment.weights) + own[:, :, None] + other[:, None]


def mutual_matches(assignment: Assignment) -> tuple[torch.Tensor, torch.Tensor]:
    """Each keypoint's partner (n x ka, -1 without) if each is the other's best, and the probability of the match.

    The best of a column is sought along rows of the transposed product: runtimes search the last axis many times faster.
    """
    x, y = assignment.x, assignment.y
    rows, columns = assignment.log_sums()
    own = log_matchable(assignment.logit_x) - rows
    other = log_matchable(assignment.logit_y) - columns
    best, partner = (2 * (x @ y.transpose(1, 2)) + other[:, None]).max(2)
    partner_back = (2 * (y @ x.transpose(1, 2)) + own[:, None]).argmax(2)
    mutual = partner_back.gather(1, partner) == torch.arange(x.shape[1], device=x.device)
    return torch.where(mutual, partner, -1), torch.where(mutual, torch.exp(best + own), torch.zeros_like(best))


def normalised_points(points: torch.Tensor, width: int, height: int) -> torch.Tensor:
    """Pixels to positions about the image's middle, in halves of its longer side."""
    middle = points.new_tensor([width / 2, height / 2])
    return (points - middle) / (max(width, height) / 2)
