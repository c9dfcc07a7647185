"""Partial assignment by optimal transport with dustbins (SuperGlue, Sarlin et al. 2020, eq. 7 to 10).

Every keypoint has mass 1 and either dustbin as much as the other image has keypoints. Scores are the matcher's similarities;
the score of a keypoint and its dustbin follows from its matchability m and the logarithm of its sum of weights:

    bin_i = log sum_j exp(s_ij) + log((1 - m_i) / m_i)

so that the first normalisation of the rows leaves a keypoint the share m_i for its partners and 1 - m_i for the dustbin.
"""

from typing import NamedTuple

import torch

from .matcher import Assignment


class Transport(NamedTuple):
    """A plan u * weights * v in its factors (n x ka x 1, n x ka x kb, n x 1 x kb), and the masses left in either dustbin."""

    u: torch.Tensor
    weights: torch.Tensor
    v: torch.Tensor
    alone_a: torch.Tensor
    alone_b: torch.Tensor


def transport(assignment: Assignment, iterations: int) -> Transport:
    """Sinkhorn's iterations by products of the exponential with vectors; `log_plan` is the definition.

    Similarities are bounded, so that their exponentials need no logarithms of sums.
    """
    weights = assignment.weights
    ka, kb = weights.shape[1:]
    to_bin, from_bin, corner = (part.exp() for part in log_bins(assignment))
    v, v_bin = torch.ones_like(from_bin), torch.ones_like(corner)
    for _ in range(iterations):
        u = 1 / (weights @ v.transpose(1, 2) + to_bin * v_bin)
        u_bin = kb / ((from_bin * v).sum(2, keepdim=True) + corner * v_bin)
        v = 1 / (u.transpose(1, 2) @ weights + from_bin * u_bin)
        v_bin = ka / ((to_bin * u).sum(1, keepdim=True) + corner * u_bin)
    return Transport(u, weights, v, (u * to_bin * v_bin)[..., 0], (u_bin * from_bin * v)[:, 0])


def log_bins(assignment: Assignment) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Scores of the keypoints with their dustbins, n x ka x 1 and n x 1 x kb, and of the dustbins with each other, n x 1 x 1."""
    rows, columns = assignment.log_sums()
    # log((1 - m) / m) of a logistic m is minus its logit.
    to_bin, from_bin = (rows - assignment.logit_x)[:, :, None], (columns - assignment.logit_y)[:, None]
    return to_bin, from_bin, 0.5 * (to_bin.mean(1, keepdim=True) + from_bin.mean(2, keepdim=True))


def log_plan(assignment: Assignment, iterations: int) -> torch.Tensor:
    """The definition in logarithms: the log plan n x (ka + 1) x (kb + 1), dustbins last (SuperGlue eq. 9, 10)."""
    similarity = torch.log(assignment.weights)
    to_bin, from_bin, corner = log_bins(assignment)
    scores = torch.cat([torch.cat([similarity, to_bin], 2), torch.cat([from_bin, corner], 2)], 1)
    ka, kb = similarity.shape[1:]
    log_mass_a, log_mass_b = scores.new_zeros(ka + 1), scores.new_zeros(kb + 1)
    log_mass_a[-1], log_mass_b[-1] = torch.log(torch.tensor(float(kb))), torch.log(torch.tensor(float(ka)))
    v = torch.zeros_like(scores[:, :1])
    for _ in range(iterations):
        u = log_mass_a[:, None] - torch.logsumexp(scores + v, 2, keepdim=True)
        v = log_mass_b - torch.logsumexp(scores + u, 1, keepdim=True)
    return scores + u + v


def transported_matches(assignment: Assignment, iterations: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Each keypoint's partner (n x ka, -1 without) if each is the other's best, and the mass that goes between them.

    The best of a column is sought along rows of the transposed product: runtimes search the last axis many times faster.
    """
    x, y = assignment.x, assignment.y
    plan = transport(assignment, iterations)
    best, partner = (plan.weights * plan.v).max(2)
    partner_back = (y @ x.transpose(1, 2) + torch.log(plan.u).transpose(1, 2)).argmax(2)
    mutual = partner_back.gather(1, partner) == torch.arange(x.shape[1], device=x.device)
    return torch.where(mutual, partner, -1), torch.where(mutual, best * plan.u[..., 0], torch.zeros_like(best))
