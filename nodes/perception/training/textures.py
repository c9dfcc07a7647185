"""Procedural pictures to paint rooms with: 256 x 256 x 3, 8 bit, any of several kinds or a mixture."""

import cv2
import numpy as np

SIZE = 256


def random_texture(rng: np.random.Generator) -> np.ndarray:
    """One texture of a random kind; sometimes two blended."""
    kinds = (_dead_leaves, _dead_leaves, _glyphs, _tiles, _noise, _blobs)
    texture = kinds[rng.integers(len(kinds))](rng)
    if rng.random() < 0.3:
        other = kinds[rng.integers(len(kinds))](rng)
        texture = cv2.addWeighted(texture, 0.6, other, 0.4, 0)
    return texture


def _color(rng: np.random.Generator) -> tuple[int, int, int]:
    grey = rng.uniform(20, 235)
    return tuple(int(c) for c in np.clip(grey + rng.normal(0, 40, 3), 0, 255))


def _plain(rng: np.random.Generator) -> np.ndarray:
    return np.full((SIZE, SIZE, 3), _color(rng), np.uint8)


def _dead_leaves(rng: np.random.Generator) -> np.ndarray:
    """Shapes of power-law sizes that cover each other: the statistics of natural pictures (Lee et al. 2001)."""
    image = _plain(rng)
    for _ in range(int(rng.integers(60, 220))):
        radius = int(min(70, 4 / max(1e-3, rng.random()) ** 0.6))
        x, y = (int(c) for c in rng.integers(0, SIZE, 2))
        if rng.random() < 0.5:
            axes = (radius, max(1, int(radius * rng.uniform(0.3, 1))))
            cv2.ellipse(image, (x, y), axes, float(rng.uniform(0, 180)), 0, 360, _color(rng), -1, cv2.LINE_AA)
        else:
            box = ((x, y), (2 * radius, max(2, int(2 * radius * rng.uniform(0.3, 1)))), float(rng.uniform(0, 90)))
            cv2.fillPoly(image, [cv2.boxPoints(box).astype(np.int32)], _color(rng), cv2.LINE_AA)
    return image


def _glyphs(rng: np.random.Generator) -> np.ndarray:
    """Print: letters of many sizes."""
    image = _plain(rng)
    letters = np.array(list("ABCDEFGHKLMNPRSTXYZabdeghkmnqrst0123456789&%#@?"))
    for _ in range(int(rng.integers(15, 60))):
        text = "".join(rng.choice(letters, rng.integers(1, 6)))
        place = tuple(int(c) for c in rng.integers(-10, SIZE, 2))
        font = int(rng.choice([cv2.FONT_HERSHEY_SIMPLEX, cv2.FONT_HERSHEY_TRIPLEX, cv2.FONT_HERSHEY_SCRIPT_COMPLEX]))
        size = float(np.exp(rng.uniform(np.log(0.4), np.log(3))))
        cv2.putText(image, text, place, font, size, _color(rng), int(1 + 2 * size), cv2.LINE_AA)
    return image


def _tiles(rng: np.random.Generator) -> np.ndarray:
    """Bricks, tiles and planks, each of slightly another shade."""
    image = _plain(rng)
    rows, columns = rng.integers(2, 12, 2)
    height, width, base = SIZE // rows, SIZE // columns, np.array(_color(rng))
    gap, shift = int(rng.integers(0, 4)), rng.random() < 0.5
    for row in range(rows + 1):
        for column in range(-1, columns + 1):
            x = column * width + (width // 2 if shift and row % 2 else 0)
            shade = tuple(int(c) for c in np.clip(base + rng.normal(0, 14), 0, 255))
            cv2.rectangle(image, (x + gap, row * height + gap), (x + width - 1, (row + 1) * height - 1), shade, -1)
    return image


def _noise(rng: np.random.Generator) -> np.ndarray:
    """Octaves of noise: plaster, stone, cloth."""
    total = np.zeros((SIZE, SIZE, 3), np.float32)
    for octave in range(2, 8):
        coarse = rng.standard_normal((2**octave, 2**octave, 3)).astype(np.float32)
        coarse = coarse.mean(2, keepdims=True) * 1.5 + 0.4 * coarse
        total += cv2.resize(coarse, (SIZE, SIZE), interpolation=cv2.INTER_CUBIC) * np.float32(rng.uniform(2, 22))
    return np.clip(total + _color(rng), 0, 255).astype(np.uint8)


def _blobs(rng: np.random.Generator) -> np.ndarray:
    """Soft spots with some sharp dots: carpets, foliage."""
    image = _noise(rng)
    for _ in range(int(rng.integers(30, 200))):
        centre = tuple(int(c) for c in rng.integers(0, SIZE, 2))
        cv2.circle(image, centre, int(rng.integers(1, 9)), _color(rng), -1, cv2.LINE_AA)
    return cv2.GaussianBlur(image, (0, 0), 0.7)
