"""What light, lenses, sensors and codecs do to a picture. Every function takes and returns float32 grey, 0 to 255."""

import cv2
import numpy as np

# Luma of ITU-R BT.601, which the runtime uses; training varies the weights about it.
LUMA = np.array([0.299, 0.587, 0.114], np.float32)


def luma(rgb: np.ndarray) -> np.ndarray:
    """The grey image that the exported models are given: height x width x 3 (8 bit) to height x width."""
    return rgb.astype(np.float32) @ LUMA


def random_grey(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Grey with channel weights near luma: cameras disagree on colour."""
    weights = LUMA + rng.uniform(-0.15, 0.15, 3).astype(np.float32)
    return rgb.astype(np.float32) @ (weights / weights.sum())


def photometric(grey: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A plausible other exposure, lens and sensor for the same picture."""
    image = grey
    if rng.random() < 0.6:
        image = _light_field(image, rng)
    if rng.random() < 0.8:
        image = _tone(image, rng)
    if rng.random() < 0.5:
        sigma = rng.uniform(0.3, 1.5)
        image = cv2.GaussianBlur(image, (0, 0), sigma)
    if rng.random() < 0.15:
        image = _motion_blur(image, rng)
    if rng.random() < 0.85:
        image = _sensor_noise(image, rng)
    image = np.clip(image, 0, 255)
    if rng.random() < 0.5:
        image = _jpeg(image, rng)
    return np.rint(image).astype(np.float32)


def _light_field(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Lamps and shadows: a smooth gain over the picture, sometimes with one hard edge."""
    height, width = image.shape
    coarse = rng.uniform(-1, 1, (rng.integers(2, 5), rng.integers(2, 6))).astype(np.float32)
    gain = np.exp(rng.uniform(0.1, 0.6) * cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC))
    if rng.random() < 0.25:
        angle, offset = rng.uniform(0, 2 * np.pi), rng.uniform(-0.3, 0.3)
        x = np.linspace(-0.5, 0.5, width, dtype=np.float32)[None]
        y = np.linspace(-0.5, 0.5, height, dtype=np.float32)[:, None]
        side = np.cos(angle) * x + np.sin(angle) * y > offset
        gain = gain * np.where(side, np.float32(rng.uniform(0.5, 0.9)), np.float32(1.0))
    return image * gain


def _tone(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Exposure, contrast and gamma."""
    gamma = np.exp(rng.uniform(-0.5, 0.5))
    image = 255.0 * np.power(np.clip(image, 0, 255) / 255.0, np.float32(gamma))
    mean = image.mean()
    return (image - mean) * np.float32(rng.uniform(0.55, 1.4)) + np.float32(mean + rng.normal(0, 20))


def _motion_blur(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    length = int(rng.integers(3, 8))
    kernel = np.zeros((length, length), np.float32)
    angle = rng.uniform(0, np.pi)
    reach = (length - 1) / 2
    for t in np.linspace(-reach, reach, 4 * length):
        kernel[int(round(reach + t * np.sin(angle))), int(round(reach + t * np.cos(angle)))] = 1
    return cv2.filter2D(image, -1, kernel / kernel.sum(), borderType=cv2.BORDER_REFLECT)


def _sensor_noise(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Read noise plus shot noise, which grows with the root of the light."""
    sigma = np.exp(rng.uniform(np.log(1.0), np.log(8.0)))
    shot = rng.uniform(0, 1)
    scale = np.sqrt((1 - shot) + shot * np.clip(image, 0, 255) / 128.0)
    noise = rng.standard_normal(image.shape, dtype=np.float32)
    return image + np.float32(sigma) * noise * scale.astype(np.float32)


def _jpeg(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    quality = int(rng.integers(25, 91))
    ok, code = cv2.imencode(".jpg", np.rint(image).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality])
    return cv2.imdecode(code, cv2.IMREAD_GRAYSCALE).astype(np.float32) if ok else image


def depth_sensor(depth_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A structured-light sensor's depth: noise growing with the square of the distance, and holes at edges and in patches."""
    height, width = depth_m.shape
    noisy = depth_m * (1 + 0.0015 * depth_m * rng.standard_normal(depth_m.shape))
    jump = np.abs(cv2.Laplacian(depth_m, cv2.CV_32F, ksize=3)) > 0.15 * np.maximum(depth_m, 0.3)
    holes = cv2.dilate(jump.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    for _ in range(rng.integers(0, 5)):
        centre = (int(rng.integers(width)), int(rng.integers(height)))
        axes = (int(rng.integers(3, max(4, width // 10))), int(rng.integers(3, max(4, height // 10))))
        patch = np.zeros(depth_m.shape, np.uint8)
        cv2.ellipse(patch, centre, axes, float(rng.uniform(0, 180)), 0, 360, 1, -1)
        holes |= patch > 0
    return np.where(holes | (depth_m <= 0), 0, noisy).astype(np.float32)


def random_zoom(shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """3x3 map from native pixels to a zoomed, rolled, shifted training image of the same shape that shows mostly the view."""
    height, width = shape
    zoom, roll = np.exp(rng.uniform(np.log(0.95), np.log(1.7))), rng.normal(0, np.radians(6))
    slack = max(0.0, 1 - 1 / zoom) / 2
    centre = np.array([0.5 + rng.uniform(-slack, slack), 0.5 + rng.uniform(-slack, slack)]) * [width, height] - 0.5
    c, s = zoom * np.cos(roll), zoom * np.sin(roll)
    rotation = np.array([[c, -s], [s, c]])
    target = np.array([(width - 1) / 2, (height - 1) / 2])
    h = np.eye(3)
    h[:2, :2], h[:2, 2] = rotation, target - rotation @ centre
    return h


def random_homography(shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """3x3 map to a training image that looks at the picture as at a flat poster from elsewhere."""
    height, width = shape
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    moved = corners + rng.uniform(-0.22, 0.22, (4, 2)).astype(np.float32) * [width, height]
    roll, zoom = rng.normal(0, np.radians(15)), np.exp(rng.uniform(np.log(0.7), np.log(1.5)))
    c, s = zoom * np.cos(roll), zoom * np.sin(roll)
    centre = np.array([width / 2, height / 2])
    shift = rng.uniform(-0.12, 0.12, 2) * [width, height]
    moved = (moved - centre) @ np.array([[c, s], [-s, c]]) + centre + shift
    return cv2.getPerspectiveTransform(corners, moved.astype(np.float32)).astype(np.float64)
