"""Features and matches for the evaluation, from checkpoints, exported models or OpenCV's SIFT."""

from pathlib import Path

import cv2
import numpy as np
import torch

from .exported import ExportedMatcher
from .extractor import ExportedExtractor, keypoint_score, sample_descriptors, select_keypoints
from .matcher import normalised_points
from .keypoint_set import NMS_RADIUS
from .train_extractor import load_extractor
from .train_matcher import load_matcher

KEYPOINT_THRESHOLD = 0.002
DUAL_SOFTMAX_SCALE, DUAL_SOFTMAX_CONFIDENCE = 20.0, 0.1
SIFT_RATIO, WIDE_RATIO = 0.8, 0.95


def extractor_runner(path: Path, kind: str):
    """A function from an image (1 x 1 x h x w) to heat map, descriptors (`kind`: narrow or wide) and reliability."""
    if path.suffix == ".onnx":
        return _onnx_runner(path)
    extractor, _ = load_extractor(path, torch.device("cpu"))
    return torch.no_grad()(ExportedExtractor(extractor, kind).eval())


def matcher_runner(path: Path, fast: bool):
    """A function from two images' keypoints to matches and confidences; a checkpoint's first layers if `fast`."""
    if path.suffix == ".onnx":
        return _onnx_runner(path)
    matcher, _ = load_matcher(path, torch.device("cpu"))
    layers = matcher.config.fast_layers if fast else matcher.config.layers
    return torch.no_grad()(ExportedMatcher(matcher, layers).eval())


def _onnx_runner(path: Path):
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = torch.get_num_threads()
    session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    names = [i.name for i in session.get_inputs()]

    def run(*inputs: torch.Tensor) -> tuple[torch.Tensor, ...]:
        outputs = session.run(None, {name: value.numpy() for name, value in zip(names, inputs)})
        return tuple(torch.from_numpy(o) for o in outputs)

    return run


class LearnedFeatures:
    """Keypoints (k x 2), descriptors (k x 64 or 128) and scores (k) of a grey image, strongest first."""

    def __init__(self, path: Path, count: int, kind: str = "narrow"):
        self._run, self._count = extractor_runner(path, kind), count

    def __call__(self, image: np.ndarray) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        height, width = image.shape
        # The network wants multiples of 32: the rest is filled by repeating the last row and column.
        padded = np.pad(image, ((0, -height % 32), (0, -width % 32)), mode="edge").astype(np.float32)
        heat, descriptors, reliability = self._run(torch.from_numpy(padded)[None, None])
        score = keypoint_score(heat, reliability)
        score[:, :, height - 4 :], score[:, :, :, width - 4 :] = 0, 0
        points, scores = select_keypoints(score, min(self._count, score.numel()), NMS_RADIUS, KEYPOINT_THRESHOLD)
        kept = int((scores[0] > 0).sum())
        points, scores = points[:, :kept], scores[:, :kept]
        return points[0], sample_descriptors(descriptors, points)[0], scores[0]


class LearnedMatcher:
    """Matching pixels (n x 2 of either image) by the matcher."""

    def __init__(self, path: Path, confidence: float, fast: bool):
        self._run, self._confidence = matcher_runner(path, fast), confidence

    def __call__(self, a, b, shape_a, shape_b) -> tuple[np.ndarray, np.ndarray]:
        if not len(a[0]) or not len(b[0]):
            return np.zeros((0, 2)), np.zeros((0, 2))
        place_a = normalised_points(a[0], shape_a[1], shape_a[0])
        place_b = normalised_points(b[0], shape_b[1], shape_b[0])
        matches, confidences = self._run(place_a, a[1], a[2], place_b, b[1], b[2])
        chosen = (matches >= 0) & (confidences > self._confidence)
        return a[0][chosen].numpy().astype(np.float64), b[0][matches[chosen]].numpy().astype(np.float64)


def dual_softmax_matches(a, b) -> tuple[np.ndarray, np.ndarray]:
    """Mutual nearest neighbours that a dual softmax trusts: the extractor without the matcher."""
    if not len(a[0]) or not len(b[0]):
        return np.zeros((0, 2)), np.zeros((0, 2))
    similarity = DUAL_SOFTMAX_SCALE * a[1] @ b[1].T
    probability = torch.softmax(similarity, 0) * torch.softmax(similarity, 1)
    best, partner = probability.max(1)
    mutual = probability.argmax(0)[partner] == torch.arange(len(partner))
    chosen = mutual & (best > DUAL_SOFTMAX_CONFIDENCE)
    return a[0][chosen].numpy().astype(np.float64), b[0][partner[chosen]].numpy().astype(np.float64)


def ratio_matches(a, b) -> tuple[np.ndarray, np.ndarray]:
    """Mutual nearest neighbours that pass a ratio test, as paper 2's pipeline takes them: descriptors without a matcher."""
    if len(a[0]) < 2 or len(b[0]) < 2:
        return np.zeros((0, 2)), np.zeros((0, 2))
    cosine = a[1] @ b[1].T
    (best, second), (partner, _) = (x.T for x in cosine.topk(2, 1))
    mutual = cosine.argmax(0)[partner] == torch.arange(len(partner))
    # Distances of unit vectors: d^2 = 2 - 2 cos.
    chosen = mutual & ((1 - best) < WIDE_RATIO**2 * (1 - second))
    return a[0][chosen].numpy().astype(np.float64), b[0][partner[chosen]].numpy().astype(np.float64)


class Sift:
    """OpenCV's SIFT: keypoints (k x 2) and descriptors (k x 128)."""

    def __init__(self, count: int):
        self._sift = cv2.SIFT_create(nfeatures=count)

    def __call__(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        keypoints, descriptors = self._sift.detectAndCompute(np.rint(image).astype(np.uint8), None)
        points = np.array([k.pt for k in keypoints], np.float64).reshape(-1, 2)
        return points, descriptors if descriptors is not None else np.zeros((0, 128), np.float32)


def sift_matches(a, b) -> tuple[np.ndarray, np.ndarray]:
    """Nearest neighbours that pass Lowe's ratio test."""
    if len(a[0]) < 2 or len(b[0]) < 2:
        return np.zeros((0, 2)), np.zeros((0, 2))
    found = cv2.BFMatcher(cv2.NORM_L2).knnMatch(a[1], b[1], k=2)
    kept = [m for m, second in found if m.distance < SIFT_RATIO * second.distance]
    return a[0][[m.queryIdx for m in kept]], b[0][[m.trainIdx for m in kept]]
