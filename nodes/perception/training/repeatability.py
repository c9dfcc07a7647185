"""What makes a keypoint good: that the other picture has one at the same place of the same surface, to a part of a pixel.

The labels of `keypoint_targets` say where clean corners are; these losses reward what the two noisy pictures agree on.
"""

import numpy as np
import torch
import torch.nn.functional as F

from .extractor import select_keypoints

# Width of what still counts as the same place, pixels.
NEAR_PX, PRECISE_PX, PARTNER_PX = 1.0, 0.7, 2.0
# A keypoint must find a partner at least this often to be worth having: just above chance.
COST = 0.1
COUNT, RADIUS = 256, 2


def repeatability_losses(heat_a: torch.Tensor, heat_b: torch.Tensor, dense) -> tuple[torch.Tensor, torch.Tensor]:
    """Two losses from heat maps (n x 1 x h x w) and, per pair, `Warp.dense`.

    The first is minus the expected number of repeated keypoints, less a cost for each, per cell that both pictures see; the
    second one less the mean closeness of the strongest keypoints to their partners, refined to a part of a pixel.
    """
    where = torch.from_numpy(np.stack([d[0] for d in dense])).to(heat_a.device)
    visible = torch.from_numpy(np.stack([d[1] for d in dense])).to(heat_a.device)
    height, width = heat_a.shape[2:]
    grid = (where + 0.5) / where.new_tensor([width, height]) * 2 - 1
    expected = F.grid_sample(_spread(heat_b), grid, mode="bilinear", padding_mode="zeros", align_corners=False)
    gain = (heat_a * (expected - COST))[:, 0] * visible
    repeated = -64 * gain.sum() / visible.sum().clamp(min=1)
    return repeated, 1 - _closeness(heat_a, heat_b, where, visible)


def _spread(heat: torch.Tensor) -> torch.Tensor:
    """Each keypoint's probability spread over its neighbourhood: 1 at its own pixel, falling as a Gaussian."""
    reach = torch.arange(-2, 3, device=heat.device, dtype=heat.dtype)
    line = torch.exp(-0.5 * (reach / NEAR_PX) ** 2)
    rows = sum(w * F.pad(heat, (0, 0, 2, 2))[:, :, i : i + heat.shape[2]] for i, w in enumerate(line))
    return sum(w * F.pad(rows, (2, 2, 0, 0))[..., i : i + heat.shape[3]] for i, w in enumerate(line))


def _closeness(heat_a: torch.Tensor, heat_b: torch.Tensor, where: torch.Tensor, visible: torch.Tensor) -> torch.Tensor:
    """Mean over keypoints of a that have a partner in b of exp(-d^2 / 2), d in units of PRECISE_PX."""
    points_a, points_b = (select_keypoints(heat, COUNT, RADIUS, 0.0)[0] for heat in (heat_a, heat_b))
    landed, seen = _landed(points_a, where, visible)
    partner = torch.cdist(landed.detach(), points_b.detach()).argmin(2)
    squared = ((landed - points_b.gather(1, partner[..., None].expand(-1, -1, 2))) ** 2).sum(2)
    partnered = seen & (squared.detach() < PARTNER_PX**2)
    closeness = torch.exp(-0.5 * squared / PRECISE_PX**2)
    return (closeness * partnered).sum() / partnered.sum().clamp(min=1)


def _landed(points: torch.Tensor, where: torch.Tensor, visible: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Where n x k points land: the warp at the nearest pixel, and from there by its slope, which passes gradients on."""
    n, height, width = visible.shape
    x = points[..., 0].detach().round().long().clamp(1, width - 2)
    y = points[..., 1].detach().round().long().clamp(1, height - 2)
    image = torch.arange(n, device=points.device)[:, None].expand_as(x)
    around = [visible[image, y + dy, x + dx] for dy, dx in ((0, 0), (0, 1), (0, -1), (1, 0), (-1, 0))]
    slope_x = 0.5 * (where[image, y, x + 1] - where[image, y, x - 1])
    slope_y = 0.5 * (where[image, y + 1, x] - where[image, y - 1, x])
    offset = points - torch.stack([x, y], 2)
    landed = where[image, y, x] + slope_x * offset[..., :1] + slope_y * offset[..., 1:]
    return landed, torch.stack(around).all(0)
