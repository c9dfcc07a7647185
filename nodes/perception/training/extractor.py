"""The keypoint extractor: a heat map of keypoints, dense descriptors, and how far each descriptor can be trusted.

Convolutions on a pyramid down to 1/32, fused at 1/8, as light as XFeat (Potje et al. 2024), learn the descriptors and how
reliable they are. Keypoints are blobs, maxima of the determinant of the Hessian (Lindeberg 1998) computed inside the graph:
after the same time of training none of the learned heat maps that were tried repeated as precisely.
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


class BlobMeasure(nn.Module):
    """The determinant of the Hessian at a deviation of 1.6 pixels where it is positive, in units of the image's own contrast.

    On noisy pictures bright and dark spots repeat twice as often as corners do, to a pixel, and edges have none. A maximum's
    value is the determinant to the power of 3/4; about it the map falls with the determinant's square, so that the centre of
    gravity lies close to the true place.
    """

    GAIN, FLOOR, RADIUS = 8.0, 1e-9, 2

    def __init__(self):
        super().__init__()
        line, slope = torch.tensor([1.0, -2.0, 1.0]), torch.tensor([-1.0, 0.0, 1.0])
        xx, yy = torch.zeros(3, 3), torch.zeros(3, 3)
        xx[1], yy[:, 1] = line, line
        self.register_buffer("second", torch.stack([xx, yy, torch.outer(slope, slope) / 4])[:, None])

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        """n x 1 x h x w to the same shape."""
        # A box of three pixels four times is nearly a Gaussian of 1.6.
        smooth = box(box(box(box(F.pad(image, (5, 5, 5, 5), mode="replicate")))))
        second = F.conv2d(smooth[:, :, 4:-4, 4:-4], self.second)
        xx, yy, xy = second[:, :1], second[:, 1:2], second[:, 2:]
        determinant = (xx * yy - xy * xy).clamp(min=0)
        largest = largest_near(determinant, self.RADIUS).clamp(min=self.FLOOR)
        return self.GAIN * determinant * determinant / (largest * torch.sqrt(torch.sqrt(largest)))


class Extractor(nn.Module):
    """Grey image (n x 1 x h x w, 0 to 255; h and w multiples of 32) to keypoint logits, descriptors, reliability logits."""

    def __init__(self):
        super().__init__()
        self.blob_measure = BlobMeasure()
        self.front = Convolution(4, 16)
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

    def forward(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Returns the heat map n x 1 x h x w, n x 64 x h/8 x w/8 unit descriptors, n x 1 x h/8 x w/8 reliability logits."""
        image = self.normalised(image)
        features, reliability = self._features(image)
        return self.blob_measure(image), F.normalize(self.describe(features).float(), dim=1), reliability

    def wide(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """The same with n x 128 x h/8 x w/8 unit descriptors."""
        image = self.normalised(image)
        features, reliability = self._features(image)
        return self.blob_measure(image), F.normalize(self.describe_wide(features).float(), dim=1), reliability

    def both(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Both kinds of descriptors and reliability logits: for training."""
        features, reliability = self._features(self.normalised(image))
        descriptors = (F.normalize(head(features).float(), dim=1) for head in (self.describe, self.describe_wide))
        return *descriptors, reliability

    def _features(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        eighth = self.eighth(self.quarter(self.front(F.pixel_unshuffle(image, 2))))
        sixteenth = self.sixteenth(eighth)
        fused = eighth + enlarged(sixteenth, 2, eighth) + enlarged(self.thirty_second(sixteenth), 4, eighth)
        return self.fuse(fused), self.reliability(fused)

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


def largest_near(x: torch.Tensor, radius: int) -> torch.Tensor:
    """The largest value up to `radius` pixels away along either axis: as pooling for ONNX Runtime, as shifts for PyTorch."""
    side = 2 * radius + 1
    if torch.onnx.is_in_onnx_export():
        return F.max_pool2d(F.max_pool2d(x, (side, 1), 1, (radius, 0)), (1, side), 1, (0, radius))
    for axis, margin in ((2, (0, 0, radius, radius)), (3, (radius, radius, 0, 0))):
        length, padded = x.shape[axis], F.pad(x, margin, value=-torch.inf)
        x = padded.narrow(axis, 0, length)
        for shift in range(1, side):
            x = torch.maximum(x, padded.narrow(axis, shift, length))
    return x


def enlarged(x: torch.Tensor, factor: int, like: torch.Tensor) -> torch.Tensor:
    """Bilinear enlargement, cut to the size of `like` where the picture was no multiple of 32."""
    large = F.interpolate(x, scale_factor=float(factor), mode="bilinear")
    if large.shape[2:] != like.shape[2:]:
        large = large[:, :, : like.shape[2], : like.shape[3]]
    return large


class ExportedExtractor(nn.Module):
    """What is exported: heat map n x 1 x h x w, descriptors (`kind`: narrow or wide), and reliability as a probability."""

    def __init__(self, extractor: Extractor, kind: str = "narrow"):
        super().__init__()
        self.extractor, self.kind = extractor, kind

    def forward(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        run = self.extractor.wide if self.kind == "wide" else self.extractor
        heat, descriptors, reliability = run(image)
        return heat, descriptors, torch.sigmoid(reliability)


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
    largest = largest_near(score, radius)
    border = torch.zeros_like(score)
    border[:, :, 4:-4, 4:-4] = 1
    peaks = torch.where((score >= largest) & (score > threshold), score, 0 * score) * border
    values, flat = peaks.flatten(1).topk(count, dim=1)
    width = score.shape[3]
    pixels = torch.stack([flat % width, flat // width], 2).float()
    return pixels + _centroid(score, flat), values


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
