"""The networks as they are exported: inputs and outputs are those of the runtime's contracts."""

import torch
import torch.nn.functional as F
from torch import nn

from .extractor import CELL, ExportedExtractor, Extractor, keypoint_score, largest_near
from .matcher import Matcher, mutual_matches
from .transport import transported_matches

# Contract "r2d2" keeps what reaches 0.7 on both maps. Roots bring scores near one another; 0.002 becomes 0.7.
SCORE_MIN, LIMIT = 0.002, 0.7


class ExportedR2d2(nn.Module):
    """Red, green and blue, normalised as ImageNet is, to 128-d descriptors, reliability and repeatability (contract "r2d2").

    The descriptors keep their cells of 8 x 8 pixels; both maps have the image's size.
    """

    def __init__(self, extractor: Extractor):
        super().__init__()
        self.extractor = ExportedExtractor(extractor, "wide")
        luma, mean, deviation = [0.299, 0.587, 0.114], [0.485, 0.456, 0.406], [0.229, 0.224, 0.225]
        self.register_buffer("weights", 255 * torch.tensor([w * d for w, d in zip(luma, deviation)]).view(1, 3, 1, 1))
        self.offset = 255 * sum(w * m for w, m in zip(luma, mean))

    def forward(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        grey = (image * self.weights).sum(1, keepdim=True) + self.offset
        heat, descriptors, reliability = self.extractor(grey)
        score = keypoint_score(heat, reliability)
        root = torch.sqrt(torch.sqrt(score))
        limit = SCORE_MIN**0.25
        repeatability = root / (root + limit * (1 - LIMIT) / LIMIT)
        # Contract "r2d2" takes maxima of 3 x 3, these are of 5 x 5.
        peak = (score >= largest_near(score, 2)).float()
        large = F.interpolate(reliability, scale_factor=float(CELL), mode="bilinear")
        return descriptors, LIMIT + (1 - LIMIT) * large, repeatability * peak


class ExportedMatcher(nn.Module):
    """What is exported: two images' keypoints, without a batch axis, to matches (k of image a, -1 without) and confidences."""

    def __init__(self, matcher: Matcher, layers: int):
        super().__init__()
        self.matcher, self.layers = matcher, layers

    def forward(self, keypoints0, descriptors0, scores0, keypoints1, descriptors1, scores1):
        inputs = (keypoints0, descriptors0, scores0, keypoints1, descriptors1, scores1)
        assignments = self.matcher(*(x[None] for x in inputs), layers=self.layers)
        iterations = self.matcher.config.iterations_after(self.layers)
        last = assignments[-1]
        matches, confidences = transported_matches(last, iterations) if iterations else mutual_matches(last)
        return matches[0], confidences[0]
