"""The homography between two pictures of one place, and how well it is known.

Features are SIFT (Lowe 2004), matched both ways with Lowe's ratio; outliers are dropped by RANSAC, and the homography
is the least squares fit to the rest (cv2.findHomography). A homography is exact where the camera turned about its
centre, or where everything lies in one plane; where it moved, what stands before the main plane does not fit, and shows
as a small share of inliers.

Lenses that bend straight lines are allowed for: homographies are between places as a pinhole would have shown them
(``lenses``).

Quality is told by matches, the share of inliers, their error, the standard error of the worst place, and the overlap.
The standard error follows from the errors and where the inliers lie, by linear error propagation: a homography that
rests on a poster in one corner is not known in the opposite one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from hsbench.datasets.annotation.lenses import bent, straight
from hsbench.geometry.cameras import Camera, pixel_centres
from hsbench.typing import AnyArray, BoolArray, FloatArray, UInt8Array

RATIO = 0.8  # Lowe 2004, sec. 7.1
BORDER_PX = 9  # a feature so near to the edge of a redrawn picture may be the edge
MAX_FEATURES = 5000  # the strongest of each picture
RANSAC_PX = 2.0
RANSAC_STEPS, CONFIDENCE = 10_000, 0.9999
UNKNOWNS = 8  # of a homography
MIN_MATCHES = UNKNOWNS // 2
ILL_CONDITIONED = 1e12  # of the normal matrix: the inliers lie in a line
LATTICE = 64  # places along each side at which the overlap is looked up
HALF_PX = 0.5  # cv2's places count from the middle of the first pixel

MIN_INLIERS = 30
MIN_INLIER_SHARE = 0.75
MAX_ERROR_PX = 1.0
MAX_WORST_PX = 2.0
MIN_OVERLAP = 0.5
"""What a transfer must reach. Of features matched by looks alone about a tenth are wrong where everything fits
(docs/annotate.md), so that a quarter leaves room for people and moved things, not for another plane; two pixels are the
width of a line drawn by hand; less than half of a picture is better labelled anew."""

SAME_PX, SAME_ERRORS, SAME_SHARE = MAX_WORST_PX, 3.0, 0.9
"""A camera did not move, and labels are taken over pixel by pixel, where no place moved by more than a drawn line is
wide or three standard errors, and standing still explains nine tenths of the inliers."""


@dataclass(frozen=True)
class Quality:
    """How well a homography fits two pictures. Lengths in pixels of the target; None: not to be told.

    error_px: root mean square over inliers. worst_px: largest standard error of a place of the source that the target
    shows, 0 where the camera is said not to have moved. overlap: share of the target's pixels that the source shows.
    """

    matches: int
    inliers: int
    error_px: float | None
    worst_px: float | None
    overlap: float

    @property
    def inlier_share(self) -> float:
        """Inliers over matches; 0 without a match."""
        return self.inliers / max(self.matches, 1)

    def fault(self) -> str | None:
        """What of it is not good enough and what was asked for, None where all is."""
        if self.inliers < MIN_INLIERS:
            return f"{self.inliers} of {self.matches} features fit; expected at least {MIN_INLIERS} (another place?)"
        if self.inlier_share < MIN_INLIER_SHARE:
            return f"{self.inlier_share:.0%} of {self.matches} features fit; expected {MIN_INLIER_SHARE:.0%} (moved?)"
        if self.error_px is None or self.error_px > MAX_ERROR_PX:
            return f"features fit to {_shown(self.error_px)}; expected {MAX_ERROR_PX:g} px"
        if self.worst_px is None or self.worst_px > MAX_WORST_PX:
            return f"the worst place is known to {_shown(self.worst_px)}; expected {MAX_WORST_PX:g} px"
        if self.overlap < MIN_OVERLAP:
            return f"{self.overlap:.0%} of the picture is shown; expected {MIN_OVERLAP:.0%}"
        return None


@dataclass(frozen=True, eq=False)
class Homography:
    """From the picture of one camera to that of another: ``target_H_source`` (3, 3) maps straight places (u, v, 1)."""

    source: Camera
    target: Camera
    target_H_source: FloatArray
    quality: Quality

    @property
    def is_identity(self) -> bool:
        """Whether labels stay where they are."""
        return self.source == self.target and bool(np.array_equal(self.target_H_source, np.eye(3)))

    def sources(self, pixels: FloatArray) -> FloatArray:
        """(..., 2) places in the target picture -> where they come from in the source; NaN beyond the horizon."""
        if self.is_identity:
            return pixels
        return bent(self.source, mapped(inverse(self.target_H_source), straight(self.target, pixels)))


def match(source: UInt8Array, target: UInt8Array, shown: BoolArray | None = None) -> tuple[FloatArray, FloatArray]:
    """Two pictures (h, w, 3) uint8 -> (n, 2) places in each of what they both show, by looks alone.

    shown: (h, w) bool, where the source has a picture; None: everywhere.
    """
    sift = cv2.SIFT.create(nfeatures=MAX_FEATURES, enable_precise_upscale=True)
    grey = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in (source, target)]
    found_a, looks_a = sift.detectAndCompute(grey[0], None if shown is None else shown.astype(np.uint8))
    found_b, looks_b = sift.detectAndCompute(grey[1], None)
    if min(len(found_a), len(found_b)) < 2:
        return np.zeros((0, 2)), np.zeros((0, 2))
    there, back = _nearest(looks_a, looks_b), _nearest(looks_b, looks_a)
    pairs = [(i, j) for i, j in there.items() if back.get(j) == i]
    a = np.array([found_a[i].pt for i, _ in pairs], dtype=np.float64).reshape(-1, 2) + HALF_PX
    b = np.array([found_b[j].pt for _, j in pairs], dtype=np.float64).reshape(-1, 2) + HALF_PX
    # One feature may be found several times, with several directions: it is one.
    _, first = np.unique(np.round(np.hstack([a, b]), 1), axis=0, return_index=True)
    first.sort()
    return a[first], b[first]


def estimate(source: UInt8Array, target: UInt8Array, from_: Camera, to: Camera) -> Homography:
    """From a picture (h, w, 3) uint8 of a camera to another of the same place; of quality zero where there is none.

    Twice: features are found more exactly, and more of them, once the source looks as the target does.
    """
    a, b = _straight_match(source, target, from_, to)
    H, inlier = _fit(a, b)
    if H is None:
        return Homography(from_, to, np.eye(3), Quality(len(a), 0, None, None, 0.0))
    sources = Homography(from_, to, H, Quality(0, 0, None, None, 0.0)).sources
    like, shown = _redrawn(source, sources(pixel_centres(to.width_px, to.height_px)))
    again_a, again_b = match(like, target, shown)
    a2, b2 = straight(from_, sources(again_a)), straight(to, again_b)
    finer, finer_inlier = _fit(a2, b2)
    if finer is not None and finer_inlier.sum() >= inlier.sum():
        a, b, H, inlier = a2, b2, finer, finer_inlier
    found = _judged(H, a, b, inlier, from_, to)
    worst = found.quality.worst_px
    still = np.hypot(*(b - a).T) <= RANSAC_PX
    if from_ == to and worst is not None and still.sum() >= SAME_SHARE * inlier.sum():
        places = _shown_places(found)
        if np.hypot(*(mapped(H, places) - places).T).max(initial=0.0) <= max(SAME_PX, SAME_ERRORS * worst):
            return _judged(np.eye(3), a, b, still, from_, to)
    return found


def fixed(source: UInt8Array, target: UInt8Array, camera: Camera) -> Homography:
    """The identity, for a camera that is said not to have moved; how well the pictures bear that out."""
    a, b = _straight_match(source, target, camera, camera)
    found = _judged(np.eye(3), a, b, np.hypot(*(b - a).T) <= RANSAC_PX, camera, camera)
    return replace(found, quality=replace(found.quality, worst_px=0.0))


def mapped(H: FloatArray, points_px: FloatArray) -> FloatArray:
    """(..., 2) places through a homography (3, 3), positive at what is seen; NaN on and beyond its horizon."""
    x = np.asarray(points_px @ H[:, :2].T + H[:, 2], dtype=np.float64)
    depth = np.where(x[..., 2:] > 0, x[..., 2:], np.nan)
    return np.asarray(x[..., :2] / depth)


def inverse(H: FloatArray) -> FloatArray:
    """The homography (3, 3) back: what lies before the horizon of H comes from before that of its inverse."""
    return np.asarray(np.linalg.inv(H), dtype=np.float64)


def _straight_match(source: UInt8Array, target: UInt8Array, from_: Camera, to: Camera) -> tuple[FloatArray, FloatArray]:
    a, b = match(source, target)
    return straight(from_, a), straight(to, b)


def _fit(a: FloatArray, b: FloatArray) -> tuple[FloatArray | None, BoolArray]:
    """The homography from (n, 2) places to (n, 2) others, None where there is none, and (n,) which of them fit it."""
    none = np.zeros(len(a), dtype=np.bool_)
    if len(a) < MIN_MATCHES:
        return None, none
    found, mask = cv2.findHomography(a, b, cv2.RANSAC, RANSAC_PX, maxIters=RANSAC_STEPS, confidence=CONFIDENCE)
    if found is None or not np.isfinite(found).all() or np.linalg.matrix_rank(found) < 3:
        return None, none
    H, inlier = np.asarray(found, dtype=np.float64), np.asarray(mask.ravel() > 0)
    before = (a[inlier] @ H[2, :2] + H[2, 2]).mean() > 0  # of the horizon: what is seen is
    return (H if before else -H), inlier


def _redrawn(source: UInt8Array, places: FloatArray) -> tuple[UInt8Array, BoolArray]:
    """A picture of what the source shows at (h, w, 2) places, and where, off its border, it shows something."""
    u, v = np.nan_to_num(places - HALF_PX, nan=-1e4).clip(-1e4, 1e5).astype(np.float32).transpose(2, 0, 1)
    like = cv2.remap(source, u, v, cv2.INTER_CUBIC)
    shown = cv2.remap(np.full(source.shape[:2], 255, dtype=np.uint8), u, v, cv2.INTER_NEAREST)
    shown = cv2.erode(shown, np.ones((BORDER_PX, BORDER_PX), dtype=np.uint8))
    return np.asarray(like, dtype=np.uint8), np.asarray(shown > 0)


def _nearest(looks_a: AnyArray, looks_b: AnyArray) -> dict[int, int]:
    """Of each feature the nearest of the others by looks, where it is much nearer than the second."""
    pairs = cv2.BFMatcher(cv2.NORM_L2).knnMatch(looks_a, looks_b, k=2)
    return {m.queryIdx: m.trainIdx for m, n in pairs if m.distance < RATIO * n.distance}


def _judged(H: FloatArray, a: FloatArray, b: FloatArray, inlier: BoolArray, from_: Camera, to: Camera) -> Homography:
    gap = mapped(H, a[inlier]) - b[inlier]
    error = float(np.sqrt((gap**2).sum(axis=1).mean())) if inlier.any() else None
    found = Homography(from_, to, H, Quality(len(a), int(inlier.sum()), error, None, 0.0))
    places = _shown_places(found)
    worst = standard_error(H, a[inlier], b[inlier], places) if len(places) else None
    return replace(found, quality=replace(found.quality, worst_px=worst, overlap=len(places) / LATTICE**2))


def _shown_places(found: Homography) -> FloatArray:
    """(n, 2) straight places of the source at the places of a lattice in the target that it shows."""
    across = [(np.arange(LATTICE) + 0.5) / LATTICE * side for side in (found.target.width_px, found.target.height_px)]
    places = found.sources(np.stack(np.meshgrid(*across), axis=-1)).reshape(-1, 2)
    return straight(found.source, places[found.source.contains(places)])


def standard_error(H: FloatArray, a: FloatArray, b: FloatArray, places: FloatArray) -> float | None:
    """Of where (k, 2) places of the source lie in the target, the largest, in pixels; None where it is open.

    H is the least squares fit from (n, 2) places to (n, 2) others.
    """
    free = 2 * len(a) - UNKNOWNS
    if free <= 0:
        return None
    middle, scale = a.mean(axis=0), float(np.abs(a - a.mean(axis=0)).max())
    unit = np.array([[scale, 0, middle[0]], [0, scale, middle[1]], [0, 0, 1.0]])
    # About their middle and in units of their spread the eight unknowns are of one size: well conditioned.
    G = H @ unit
    slope = _jacobian(G, (a - middle) / scale)
    variance = ((mapped(H, a) - b) ** 2).sum() / free
    normal = slope.T @ slope
    if np.linalg.cond(normal) > ILL_CONDITIONED:
        return None
    at = _jacobian(G, (places - middle) / scale).reshape(-1, 2, UNKNOWNS)
    spread = np.einsum("kij,jl,kil->k", at, np.linalg.inv(normal) * variance, at)
    return float(np.sqrt(spread.max()))


def _jacobian(H: FloatArray, points: FloatArray) -> FloatArray:
    """(2 n, 8) derivatives of where (n, 2) points go by the entries of H but the last."""
    homogeneous = np.column_stack([points, np.ones(len(points))])
    x = homogeneous @ H.T
    p, w = x[:, :2] / x[:, 2:], x[:, 2:]
    rows = np.zeros((len(points), 2, 9))
    rows[:, 0, 0:3] = rows[:, 1, 3:6] = homogeneous / w
    rows[:, :, 6:9] = -p[:, :, None] * (homogeneous / w)[:, None]
    return rows.reshape(-1, 9)[:, :8]


def _shown(length_px: float | None) -> str:
    return "an unknown length" if length_px is None else f"{length_px:.2f} px"
