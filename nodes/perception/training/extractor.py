"""The keypoint extractor: a heat map of keypoints, dense descriptors, and how far each descriptor can be trusted.

Convolutions on a pyramid down to 1/32, fused at 1/8, as light as XFeat (Potje et al. 2024). The keypoint head refines an
explicit corner measure (Shi and Tomasi 1994) computed inside the graph: before any training the heat map is the corner
response, shared out within each 8x8 cell, and training decides which corners repeat.
"""

import torch
import torch.nn.functional as F
from torch import nn

CELL = 8
DIMENSION = 64
WIDE_DIMENSION = 128


class Convolution(nn.Sequential):
    """3x3 (or 1x1) convolution, batch norm, ReLU."""

    def __init__(self, inputs: int, outputs: int, stride: int = 1, size: int = 3):
        super().__init__(
            nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False),
            nn.BatchNorm2d(outputs),
            nn.ReLU(inplace=True),
        )


class CornerMeasure(nn.Module):
    """Logarithm of the structure tensor's smaller eigenvalue at every pixel, in units of the image's own contrast.

    At two scales: a corner of noise is one at the fine scale alone.
    """

    FLOOR = 1e-4

    def __init__(self):
        super().__init__()
        smooth, slope = torch.tensor([1.0, 2.0, 1.0]), torch.tensor([-1.0, 0.0, 1.0])
        sobel = torch.stack([torch.outer(smooth, slope), torch.outer(slope, smooth)])[:, None] / 8
        self.register_buffer("sobel", sobel)

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        """n x 1 x h x w to n x 2 x h x w: fine, coarse."""
        return torch.cat([self._measured(image), self._measured(box(box(image)))], 1)

    def _measured(self, image: torch.Tensor) -> torch.Tensor:
        gradient = F.conv2d(F.pad(image, (1, 1, 1, 1), mode="replicate"), self.sobel)
        gx, gy = gradient[:, :1], gradient[:, 1:]
        # A box twice is a pyramid of 5x5, and cheaper.
        tensor = box(box(torch.cat([gx * gx, gy * gy, gx * gy], 1)))
        xx, yy, xy = tensor[:, :1], tensor[:, 1:2], tensor[:, 2:]
        eigenvalue = 0.5 * (xx + yy - torch.sqrt((xx - yy) ** 2 + 4 * xy * xy + 1e-12))
        return torch.log(eigenvalue.clamp(min=0) + self.FLOOR)


class Extractor(nn.Module):
    """Grey image (n x 1 x h x w, 0 to 255; h and w multiples of 32) to keypoint logits, descriptors, reliability logits."""

    def __init__(self):
        super().__init__()
        self.corner_measure = CornerMeasure()
        self.front = nn.Sequential(Convolution(4, 16), Convolution(16, 16))
        self.quarter = nn.Sequential(Convolution(16, 32, 2), Convolution(32, 32), Convolution(32, 32))
        self.eighth = nn.Sequential(Convolution(32, 64, 2), Convolution(64, 64))
        self.sixteenth = nn.Sequential(Convolution(64, 64, 2), Convolution(64, 64), Convolution(64, 64))
        self.thirty_second = nn.Sequential(
            Convolution(64, 96, 2), Convolution(96, 96), Convolution(96, 96), nn.Conv2d(96, 64, 1)
        )
        self.fuse = nn.Sequential(Convolution(64, 64), Convolution(64, 64))
        self.describe = nn.Conv2d(64, DIMENSION, 1)
        # Longer descriptors for nearest neighbours without a matcher.
        self.describe_wide = nn.Sequential(Convolution(64, 128), nn.Conv2d(128, WIDE_DIMENSION, 1))
        self.reliability = nn.Sequential(Convolution(64, 32, size=1), nn.Conv2d(32, 1, 1))
        # Detail at half resolution reaches the keypoint head by one product over each cell's 4x4 positions.
        self.detail = nn.Conv2d(16, 96, 4, stride=4)
        self.context = nn.Conv2d(64, 96, 1)
        self.keypoints = nn.Sequential(
            nn.BatchNorm2d(96), nn.ReLU(inplace=True), Convolution(96, 96), nn.Conv2d(96, CELL * CELL + 1, 1)
        )
        self.corner_gain = nn.Parameter(torch.tensor([0.5, 0.5]))
        last = self.keypoints[-1]
        nn.init.zeros_(last.weight)
        nn.init.zeros_(last.bias)

    def forward(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Returns n x 65 x h/8 x w/8 logits, n x 64 x h/8 x w/8 unit descriptors, n x 1 x h/8 x w/8 logits."""
        logits, features, reliability = self._features(image)
        return logits, F.normalize(self.describe(features).float(), dim=1), reliability

    def wide(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """The same with n x 128 x h/8 x w/8 unit descriptors."""
        logits, features, reliability = self._features(image)
        return logits, F.normalize(self.describe_wide(features).float(), dim=1), reliability

    def both(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]:
        """Logits, both kinds of descriptors, reliability logits: for training."""
        logits, features, reliability = self._features(image)
        descriptors = (F.normalize(head(features).float(), dim=1) for head in (self.describe, self.describe_wide))
        return logits, *descriptors, reliability

    def _features(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        image = self.normalised(image)
        half = self.front(F.pixel_unshuffle(image, 2))
        eighth = self.eighth(self.quarter(half))
        sixteenth = self.sixteenth(eighth)
        fused = eighth + enlarged(sixteenth, 2, eighth) + enlarged(self.thirty_second(sixteenth), 4, eighth)
        return self._keypoint_logits(image, half, eighth), self.fuse(fused), self.reliability(fused)

    def _keypoint_logits(self, image: torch.Tensor, half: torch.Tensor, eighth: torch.Tensor) -> torch.Tensor:
        corners = (self.corner_measure(image) * self.corner_gain.view(1, 2, 1, 1)).sum(1, keepdim=True)
        corners = F.pixel_unshuffle(corners, CELL)
        # The dustbin competes with a cell of weak texture: the response of a flat, noisy surface summed over 64 pixels.
        empty = torch.full_like(corners[:, :1], -1.0)
        prior = torch.cat([corners, empty], 1)
        return prior + self.keypoints(self.detail(half) + self.context(eighth))

    @staticmethod
    def normalised(image: torch.Tensor) -> torch.Tensor:
        """Zero mean, unit deviation over each picture; next to nothing is left of a picture without texture."""
        mean = image.mean((2, 3), keepdim=True)
        centred = image - mean
        deviation = torch.sqrt((centred * centred).mean((2, 3), keepdim=True) + 4.0)
        return centred / deviation


def box(x: torch.Tensor) -> torch.Tensor:
    """Mean over 3x3, zeros outside: as pooling for ONNX Runtime, as sums of shifts for PyTorch, where pooling is slow."""
    if torch.onnx.is_in_onnx_export():
        return F.avg_pool2d(x, 3, 1, 1)
    x = F.pad(x, (1, 1, 1, 1))
    rows = (x[:, :, :-2] + x[:, :, 1:-1]).add_(x[:, :, 2:])
    return (rows[..., :-2] + rows[..., 1:-1]).add_(rows[..., 2:]).mul_(1 / 9)


def enlarged(x: torch.Tensor, factor: int, like: torch.Tensor) -> torch.Tensor:
    """Bilinear enlargement, cut to the size of `like` where the picture was no multiple of 32."""
    large = F.interpolate(x, scale_factor=float(factor), mode="bilinear")
    if large.shape[2:] != like.shape[2:]:
        large = large[:, :, : like.shape[2], : like.shape[3]]
    return large


class ExportedExtractor(nn.Module):
    """What is exported: heat map n x 1 x h x w, descriptors, and reliability as a probability."""

    def __init__(self, extractor: Extractor):
        super().__init__()
        self.extractor = extractor

    def forward(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        logits, descriptors, reliability = self.extractor(image)
        return heat_map(logits), descriptors, torch.sigmoid(reliability)


def heat_map(logits: torch.Tensor) -> torch.Tensor:
    """Keypoint probability of every pixel: n x 65 x h/8 x w/8 to n x 1 x h x w."""
    n, _, rows, columns = logits.shape
    # Channels last before the softmax: the shuffle then moves runs of eight pixels, three times faster on a CPU.
    cells = torch.softmax(logits.float().permute(0, 2, 3, 1), 3)[..., : CELL * CELL]
    return cells.reshape(n, rows, columns, CELL, CELL).permute(0, 1, 3, 2, 4).reshape(n, 1, rows * CELL, columns * CELL)


def sample_descriptors(descriptors: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
    """Bilinear, renormalised: n x 64 x h/8 x w/8 at n x k x 2 pixels gives n x k x 64."""
    rows, columns = descriptors.shape[2:]
    scale = points.new_tensor([columns * CELL, rows * CELL])
    grid = (points + 0.5) / scale * 2 - 1
    sampled = F.grid_sample(
        descriptors.float(), grid[:, None].float(), mode="bilinear", padding_mode="border", align_corners=False
    )
    return F.normalize(sampled[:, :, 0].transpose(1, 2), dim=2)


def select_keypoints(score: torch.Tensor, count: int, radius: int, threshold: float) -> tuple[torch.Tensor, torch.Tensor]:
    """The `count` strongest local maxima of n x 1 x h x w scores, strongest first.

    Positions are refined to a part of a pixel. Returns pixels n x count x 2 and scores n x count; where there are fewer maxima above `threshold`,
    scores are 0.
    """
    largest = _largest(_largest(score.detach(), radius, 2), radius, 3)
    border = torch.zeros_like(score)
    border[:, :, 4:-4, 4:-4] = 1
    peaks = torch.where((score >= largest) & (score > threshold), score, 0 * score) * border
    values, flat = peaks.flatten(1).topk(count, dim=1)
    width = score.shape[3]
    pixels = torch.stack([flat % width, flat // width], 2).float()
    return pixels + _centroid(score, flat), values


def _largest(x: torch.Tensor, radius: int, axis: int) -> torch.Tensor:
    """The largest of each value and its neighbours along an axis: by shifts, as PyTorch's pooling is slow on a CPU."""
    length = x.shape[axis]
    padded = F.pad(x, (0, 0, radius, radius) if axis == 2 else (radius, radius, 0, 0), value=-torch.inf)
    largest = padded.narrow(axis, 0, length)
    for shift in range(1, 2 * radius + 1):
        largest = torch.maximum(largest, padded.narrow(axis, shift, length))
    return largest


def _centroid(score: torch.Tensor, flat: torch.Tensor) -> torch.Tensor:
    """Offset of the scores' centre of gravity over the 3x3 about each of n x k pixels, given by flat index: n x k x 2."""
    y, x = torch.meshgrid(torch.arange(-1, 2), torch.arange(-1, 2), indexing="ij")
    shifts = torch.stack([x.flatten(), y.flatten()], 1).to(score.device)
    around = flat[:, :, None] + shifts[:, 1] * score.shape[3] + shifts[:, 0]
    scores = score.flatten(1)
    near = scores.gather(1, around.flatten(1).clamp(0, scores.shape[1] - 1)).view(around.shape)
    return (near[..., None] * shifts).sum(2) / near.sum(2, keepdim=True).clamp(min=1e-12)


def keypoint_score(heat: torch.Tensor, reliability: torch.Tensor) -> torch.Tensor:
    """Heat times reliability, the latter (n x 1 x h/8 x w/8, a probability) interpolated to every pixel."""
    return heat * F.interpolate(reliability, scale_factor=float(CELL), mode="bilinear")
