"""What recipes with an RGB-D camera share: their settings, and a room of the kinds they film."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hsbench.geometry.grids import VoxelGrid
from hsbench.io.scene_folder import read_scene
from hsbench.schema.scene import Scene
from hsbench.synth.activities import LifeConfig
from hsbench.synth.activities.schedule import NOVEL_HABITS
from hsbench.synth.config import settings
from hsbench.synth.detectors import DetectorConfig, detector
from hsbench.synth.furniture import COMMON_FAMILIES, NOVEL_FAMILIES
from hsbench.synth.placement import CameraConfig, camera_config
from hsbench.synth.rooms import COMMON_TEMPLATES, NOVEL_TEMPLATES, TEMPLATES, RoomConfig, build_scene
from hsbench.synth.rooms.templates import even_weights
from hsbench.synth.seeds import Seeds

ROOM_TYPES = ("living", "bedroom", "dining", "study", "kitchen", "office", "meeting")  # room enough for a life


@dataclass(frozen=True)
class RgbdConfig:
    """What an RGB-D episode records. frame_rate_hz: pictures a second; pose_rate_hz: looks of the detector a second, a
    divisor of the life's; grid_*: the truth grid in the episode frame.

    The grid's defaults are those of task scene-completion: 128 x 128 x 48 voxels of .05 m.
    """

    frame_rate_hz: float = 2.0
    pose_rate_hz: int = 30
    depth_noise: str = "kinect"
    grid_origin_m: tuple[float, float, float] = (0.0, -3.2, 0.0)
    grid_shape: tuple[int, int, int] = (128, 128, 48)
    voxel_m: float = 0.05

    @property
    def grid(self) -> VoxelGrid:
        """The truth grid."""
        return VoxelGrid(self.grid_origin_m, self.grid_shape, self.voxel_m)


@dataclass(frozen=True)
class RgbdSettings:
    """The sections [room], [life], [camera], [poses] and [recording] of a recipe's ``config.toml``, for one split.

    imported: the scene folder that ``scene`` names, filmed in place of generated rooms.
    """

    room: RoomConfig
    families: tuple[str, ...]
    life: LifeConfig
    camera: CameraConfig
    detector: DetectorConfig
    recording: RgbdConfig
    imported: Path | None = None

    @classmethod
    def of(cls, config: Mapping[str, Any], split: str) -> RgbdSettings:
        """Settings for a split: ``test-novel`` has templates, style families and habits of its own.

        Raises SchemaError naming unknown keys.
        """
        novel = split == "test-novel"
        life = settings(LifeConfig, config["life"], "life")
        names = (n for n in (NOVEL_TEMPLATES if novel else COMMON_TEMPLATES) if TEMPLATES[n].room_type in ROOM_TYPES)
        return cls(
            replace(settings(RoomConfig, config["room"], "room"), templates=even_weights(tuple(names))),
            NOVEL_FAMILIES if novel else COMMON_FAMILIES,
            replace(life, habits=NOVEL_HABITS) if novel else life,
            camera_config(config["camera"], "camera"),
            detector(config["poses"], "poses"),
            settings(RgbdConfig, config["recording"], "recording"),
            Path(config["scene"]) if "scene" in config else None,
        )

    def scene(self, scene_id: str, seeds: Seeds) -> Scene:
        """One furnished room, or the imported one, which keeps its own id."""
        if self.imported is not None:
            return read_scene(self.imported)
        return build_scene(scene_id, seeds, self.room, self.families)
