"""A detector's settings: what it reports, how far off it is, what it loses, invents and confuses.

Where a figure is published, the field says where; the others are choices of hsbench, of a size that users of such
detectors know. docs/data/poses.md lists what the presets give beside what was published.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from hsbench.errors import SchemaError
from hsbench.schema.skeletons import BODY_25, COCO_18, KINECT_V2, SKELETONS
from hsbench.synth.config import settings

UPPER_BODY = (
    "spine_mid", "neck", "head", "spine_shoulder", "shoulder_left", "shoulder_right",
    "elbow_left", "elbow_right", "wrist_left", "wrist_right", "hand_left", "hand_right",
)  # fmt: skip


@dataclass(frozen=True)
class DetectorConfig:
    """A pose detector. Shares are probabilities, 0..1. Raises SchemaError for a value out of range.

    skeleton: what it reports: joints in metres for ``kinect-v2-25``, else pixels.
    range_m: nearest and farthest joint, along the optical axis (a sphere's: along the ray).
    least_tracked: joints that must be tracked for a body to be found; a Kinect's are counted in the upper body alone.

    Errors in metres:
    tracked_m: standard deviation of a coordinate of a tracked joint next to the camera; drifts.
    jitter: its white part, as a multiple of a Kinect v2's (``space.JITTER_M``).
    doubled_at_m: distance at which both are twice that; they grow with the square, as the depth noise that they come
    from (Nguyen, Izadi, Lovell, 3DIMPVT 2012).
    inferred_m: as tracked_m, of an inferred joint, at any distance.

    Errors in pixels:
    annotators: standard deviation, as a multiple of what people who annotate COCO differ by (``image.SIGMAS``); half of
    the variance drifts.
    annotators_inferred: the same of an inferred joint.
    uneven: both are those of a median look; those of a body go up and down by a log-normal factor that drifts, whose
    logarithm has this standard deviation.
    cells: cells of the heatmap along the person, whose centres are the answers; 0: sub-pixel peaks. A network input of
    368 px at stride 8 has 46 (Wei, Ramakrishna, Kanade, Sheikh, "Convolutional Pose Machines", CVPR 2016).

    drift_s: time scale of what drifts (see ``drift``). In the recordings named in ``space`` the length of a bone
    correlates by .7 after 1/6 s and .3 after 1/2 s; in the one of a minute by .7 after 1/2 s and .3 after 1 s.
    guessed_share: hidden joints that are reported (as inferred); the others are missing.
    joint_loss_share: visible joints that are missing.
    miss_share: bodies missed in one look, each look by itself.
    bursts_per_min, burst_s: times over which a body is lost though it could be seen: rate, and shortest and longest.
    phantoms_per_min, phantom_s: false bodies: rate, and shortest and longest.
    lost_s: a body lost for longer comes back under a new track id.
    relabel_share: of a shorter loss that ends with a new track id.
    near_m, swap_share: two bodies that come so near to each other (in pixels: across the line of sight) exchange their
    track ids with this probability, once each time.
    """

    skeleton: str = KINECT_V2.name
    range_m: tuple[float, float] = (0.5, 8.0)
    least_tracked: int = 6
    tracked_m: float = 0.0
    jitter: float = 0.0
    doubled_at_m: float = 4.0
    inferred_m: float = 0.0
    annotators: float = 0.0
    annotators_inferred: float = 0.0
    uneven: float = 0.0
    cells: int = 0
    drift_s: float = 0.4
    guessed_share: float = 1.0
    joint_loss_share: float = 0.0
    miss_share: float = 0.0
    bursts_per_min: float = 0.0
    burst_s: tuple[float, float] = (0.1, 0.5)
    phantoms_per_min: float = 0.0
    phantom_s: tuple[float, float] = (0.2, 1.5)
    lost_s: float = 1.0
    relabel_share: float = 0.0
    near_m: float = 0.5
    swap_share: float = 0.0

    def __post_init__(self) -> None:
        if self.skeleton not in SKELETONS:
            raise SchemaError(f"detector.skeleton is {self.skeleton!r}; expected one of {', '.join(SKELETONS)}")
        for name, value in asdict(self).items():
            if name == "skeleton":
                continue
            low, high = value if isinstance(value, tuple) else (0.0, value)
            if not 0 <= low <= high:
                raise SchemaError(f"detector.{name} is {value}; expected numbers >= 0, the smaller one first")
            if name.endswith("share") and high > 1:
                raise SchemaError(f"detector.{name} is {value}; expected a share of 0..1 (is it in percent?)")
        for name in ("drift_s", "doubled_at_m"):
            if not getattr(self, name) > 0:
                raise SchemaError(f"detector.{name} is {getattr(self, name)}; expected > 0 (inf: never)")

    @property
    def in_metres(self) -> bool:
        """Whether it reports joints in metres; else in pixels."""
        return self.skeleton == KINECT_V2.name

    @property
    def counted(self) -> tuple[str, ...]:
        """The joints among which ``least_tracked`` are counted."""
        return UPPER_BODY if self.in_metres else SKELETONS[self.skeleton].names


KINECT = DetectorConfig(
    tracked_m=0.006,
    jitter=1.0,
    inferred_m=0.06,
    bursts_per_min=2.0,
    phantoms_per_min=0.05,
    relabel_share=0.1,
    swap_share=0.2,
)
# Errors and losses of people in full view give the AP of OpenPose on COCO, as docs/data/poses.md says.
OPENPOSE_LIKE = DetectorConfig(
    skeleton=COCO_18.name,
    range_m=(0.3, 12.0),
    least_tracked=4,
    annotators=0.9,
    annotators_inferred=1.8,
    uneven=1.0,
    cells=46,
    guessed_share=0.4,
    joint_loss_share=0.03,
    miss_share=0.02,
    bursts_per_min=2.0,
    burst_s=(0.2, 1.0),
    phantoms_per_min=0.2,
    relabel_share=0.3,
    swap_share=0.3,
)
HARSH = replace(
    OPENPOSE_LIKE,
    skeleton=BODY_25.name,
    tracked_m=0.02,
    jitter=4.0,
    inferred_m=0.12,
    annotators=1.8,
    annotators_inferred=3.6,
    cells=23,
    guessed_share=0.2,
    joint_loss_share=0.1,
    miss_share=0.1,
    bursts_per_min=6.0,
    burst_s=(0.2, 3.0),
    phantoms_per_min=2.0,
    phantom_s=(0.2, 5.0),
    relabel_share=0.6,
    swap_share=0.6,
)
PRESETS: dict[str, DetectorConfig] = {
    "clean": DetectorConfig(least_tracked=1),
    "kinect": KINECT,
    "openpose-like": OPENPOSE_LIKE,
    "harsh": HARSH,
}
"""Detectors by name. ``clean``: no error but what hides joints; hidden joints are inferred without error."""


def detector(table: Mapping[str, Any], name: str) -> DetectorConfig:
    """The detector of a recipe's section: its ``preset`` (``kinect`` if none is named) with the other keys over it.

    Raises SchemaError for an unknown preset or key.
    """
    preset = table.get("preset", "kinect")
    if preset not in PRESETS:
        raise SchemaError(f"config section [{name}]: preset is {preset!r}; expected one of {', '.join(PRESETS)}")
    own = {key: value for key, value in table.items() if key != "preset"}
    return settings(DetectorConfig, {**vars(PRESETS[preset]), **own}, name)
