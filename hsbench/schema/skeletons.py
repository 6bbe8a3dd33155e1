"""Skeletons: joint names in their order on disk, the bone tree, and maps from the canonical Kinect v2 joints.

Joint orders are those of the Kinect v2 SDK (JointType), COCO keypoints, and OpenPose's COCO-18 and BODY_25.
"""

from __future__ import annotations

from dataclasses import dataclass

from hsbench.errors import SchemaError


@dataclass(frozen=True)
class Skeleton:
    """Joint ``names`` (J) in order and ``bones``, pairs of joint indices (parent, child)."""

    name: str
    names: tuple[str, ...]
    bones: tuple[tuple[int, int], ...]

    def index(self, joint: str) -> int:
        """Index of a joint by name. Raises SchemaError for an unknown one."""
        try:
            return self.names.index(joint)
        except ValueError:
            raise SchemaError(
                f"skeleton {self.name} has no joint {joint!r}; expected one of {', '.join(self.names)}"
            ) from None

    @property
    def mirror(self) -> tuple[int, ...]:
        """For every joint the index of its left/right counterpart (itself on the mid line)."""

        def swapped(name: str) -> str:
            if "left" in name:
                return name.replace("left", "right")
            return name.replace("right", "left")

        return tuple(self.names.index(swapped(name)) for name in self.names)


KINECT_V2 = Skeleton(
    "kinect-v2-25",
    (
        "spine_base", "spine_mid", "neck", "head",
        "shoulder_left", "elbow_left", "wrist_left", "hand_left",
        "shoulder_right", "elbow_right", "wrist_right", "hand_right",
        "hip_left", "knee_left", "ankle_left", "foot_left",
        "hip_right", "knee_right", "ankle_right", "foot_right",
        "spine_shoulder", "hand_tip_left", "thumb_left", "hand_tip_right", "thumb_right",
    ),
    (
        (0, 1), (1, 20), (20, 2), (2, 3),
        (20, 4), (4, 5), (5, 6), (6, 7), (7, 21), (6, 22),
        (20, 8), (8, 9), (9, 10), (10, 11), (11, 23), (10, 24),
        (0, 12), (12, 13), (13, 14), (14, 15),
        (0, 16), (16, 17), (17, 18), (18, 19),
    ),
)  # fmt: skip

COCO_17 = Skeleton(
    "coco-17",
    (
        "nose", "eye_left", "eye_right", "ear_left", "ear_right",
        "shoulder_left", "shoulder_right", "elbow_left", "elbow_right", "wrist_left", "wrist_right",
        "hip_left", "hip_right", "knee_left", "knee_right", "ankle_left", "ankle_right",
    ),
    (
        (0, 1), (0, 2), (1, 3), (2, 4), (5, 6), (5, 7), (7, 9), (6, 8), (8, 10),
        (5, 11), (6, 12), (11, 12), (11, 13), (13, 15), (12, 14), (14, 16),
    ),
)  # fmt: skip

COCO_18 = Skeleton(
    "coco-18",
    (
        "nose", "neck", "shoulder_right", "elbow_right", "wrist_right", "shoulder_left", "elbow_left", "wrist_left",
        "hip_right", "knee_right", "ankle_right", "hip_left", "knee_left", "ankle_left",
        "eye_right", "eye_left", "ear_right", "ear_left",
    ),
    (
        (1, 0), (1, 2), (2, 3), (3, 4), (1, 5), (5, 6), (6, 7), (1, 8), (8, 9), (9, 10),
        (1, 11), (11, 12), (12, 13), (0, 14), (14, 16), (0, 15), (15, 17),
    ),
)  # fmt: skip

BODY_25 = Skeleton(
    "body-25",
    (
        "nose", "neck", "shoulder_right", "elbow_right", "wrist_right", "shoulder_left", "elbow_left", "wrist_left",
        "hip_mid", "hip_right", "knee_right", "ankle_right", "hip_left", "knee_left", "ankle_left",
        "eye_right", "eye_left", "ear_right", "ear_left",
        "big_toe_left", "small_toe_left", "heel_left", "big_toe_right", "small_toe_right", "heel_right",
    ),
    (
        (1, 0), (1, 2), (2, 3), (3, 4), (1, 5), (5, 6), (6, 7), (1, 8), (8, 9), (9, 10), (10, 11), (8, 12),
        (12, 13), (13, 14), (0, 15), (15, 17), (0, 16), (16, 18), (14, 19), (19, 20), (14, 21), (11, 22),
        (22, 23), (11, 24),
    ),
)  # fmt: skip

SKELETONS: dict[str, Skeleton] = {s.name: s for s in (KINECT_V2, COCO_17, COCO_18, BODY_25)}

_KINECT_NAME = {"hip_mid": "spine_base", "big_toe_left": "foot_left", "big_toe_right": "foot_right"}


def kinect_map(skeleton: Skeleton) -> tuple[int, ...]:
    """For every joint of ``skeleton`` the Kinect v2 joint at the same place, or -1.

    Nose, eyes, ears, small toes and heels have no Kinect counterpart: Kinect's head is the middle of the
    skull and its foot the ball of the foot.
    """
    names = (_KINECT_NAME.get(name, name) for name in skeleton.names)
    return tuple(KINECT_V2.names.index(name) if name in KINECT_V2.names else -1 for name in names)
