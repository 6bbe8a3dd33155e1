"""An episode: one sensor watching one scene for a while. Inputs on the episode, everything else under ``truth``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.events import EventTable
from hsbench.schema.motions import ObjectMotions, check_things
from hsbench.schema.occupancy import AffordanceTruth, ObjectTruth, OccupancyTruth, check_view
from hsbench.schema.poses import PoseTable, TruePoseTable, require
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.typing import Float32Array, IntArray, UInt8Array, UInt16Array

NS_PER_S = 1_000_000_000


@dataclass(frozen=True, eq=False)
class Frame:
    """What the sensor gave at one time: rgb (h, w, 3) uint8, depth_m (h, w) float32 metres, 0 = none; each optional."""

    timestamp_ns: int
    rgb: UInt8Array | None = None
    depth_m: Float32Array | None = None


@dataclass(frozen=True, eq=False)
class FrameTruth:
    """Truth of a frame: clean depth_m (h, w) float32, instance (h, w) uint16, semantic and affordance (h, w) uint8."""

    timestamp_ns: int
    depth_m: Float32Array | None = None
    instance: UInt16Array | None = None
    semantic: UInt8Array | None = None
    affordance: UInt8Array | None = None


@runtime_checkable
class Frames(Protocol):
    """A sequence of frames, decoded when indexed. ``timestamps_ns`` (n,) int64 ascends strictly."""

    @property
    def timestamps_ns(self) -> IntArray:
        """(n,) int64 time stamps."""
        ...

    def __len__(self) -> int: ...
    def __getitem__(self, index: int) -> Frame: ...


@runtime_checkable
class FramesTruth(Protocol):
    """Truth of the same frames, decoded when indexed."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int) -> FrameTruth: ...


@dataclass(frozen=True, eq=False)
class FrameList:
    """Frames held in memory."""

    frames: tuple[Frame, ...] = ()

    @property
    def timestamps_ns(self) -> IntArray:
        """(n,) int64 time stamps."""
        return np.array([f.timestamp_ns for f in self.frames], dtype=np.int64)

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> Frame:
        return self.frames[index]


@dataclass(frozen=True, eq=False)
class FramesUntil:
    """The first ``count`` frames of a sequence."""

    frames: Frames
    count: int

    @property
    def timestamps_ns(self) -> IntArray:
        """(n,) int64 time stamps."""
        return self.frames.timestamps_ns[: self.count]

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, index: int) -> Frame:
        return self.frames[range(self.count)[index]]


@dataclass(frozen=True, eq=False)
class FramesTruthUntil:
    """Truth of the first ``count`` frames of a sequence."""

    frames: FramesTruth
    count: int

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, index: int) -> FrameTruth:
        return self.frames[range(self.count)[index]]


@dataclass(frozen=True, eq=False)
class ActivityMaps:
    """Activity maps for data without pictures: maps (n_act, h, w) float32 in 0..1, one name a channel.

    cell_m: side of a cell in metres, or None where the scale is relative. Rows and columns as AffordanceTruth.
    """

    maps: Float32Array
    channels: tuple[str, ...]
    cell_m: float | None

    def __post_init__(self) -> None:
        require(self.maps, "activity_maps.maps", (len(self.channels), None, None), np.float32)
        if self.maps.size and not (self.maps.min() >= 0.0 and self.maps.max() <= 1.0):
            raise SchemaError("activity_maps.maps leave 0..1 or hold NaN")
        if self.cell_m is not None and not (np.isfinite(self.cell_m) and self.cell_m > 0):
            raise SchemaError(f"activity_maps.cell_m is {self.cell_m}; expected metres > 0, or None where unknown")


@dataclass(frozen=True, eq=False)
class EpisodeTruth:
    """Everything a method must not see; each part None where a data set does not know it.

    sensor: with what the inputs do not tell of it, such as the height of a 360 camera; None where they tell all.
    motions: how things of the scene move after t0. view_affordance: (h, w) uint8, bits of ``Affordance`` of what each
    pixel shows at t0 without people, and VIEW_UNSCORED. Raises SchemaError where motions name what the scene does not
    have.
    """

    scene: Scene | None = None
    poses: TruePoseTable | None = None
    events: EventTable | None = None
    occupancy: OccupancyTruth | None = None
    objects: ObjectTruth | None = None
    affordance: AffordanceTruth | None = None
    motions: ObjectMotions | None = None
    frames: FramesTruth | None = None
    view_affordance: UInt8Array | None = None
    sensor: Sensor | None = None

    def __post_init__(self) -> None:
        if self.view_affordance is not None:
            check_view(self.view_affordance)
        if self.motions is not None and len(self.motions):
            if self.scene is None:
                raise SchemaError("truth has motions of things but no scene; expected the scene that holds them")
            check_things(self.scene, self.motions.tracks)


@dataclass(frozen=True, eq=False)
class Episode:
    """One sensor watching one scene.

    episode_id: unique in its data set. dataset: the data set's name. t0_ns: first time stamp of any sensor;
    end_ns: last. Raises SchemaError where times or sizes disagree.
    """

    episode_id: str
    dataset: str
    sensor: Sensor
    frames: Frames
    poses: PoseTable | None
    t0_ns: int
    end_ns: int
    activity_maps: ActivityMaps | None = None
    truth: EpisodeTruth | None = None

    def __post_init__(self) -> None:
        check_id(self.episode_id, "episode_id")
        if self.end_ns < self.t0_ns:
            raise SchemaError(
                f"episode {self.episode_id} ends at {self.end_ns} ns, before it starts at {self.t0_ns} ns"
            )
        times = self.frames.timestamps_ns
        for name, stamps in (("frames", times), ("poses", None if self.poses is None else self.poses.timestamp_ns)):
            if stamps is not None and len(stamps) and not (self.t0_ns <= stamps[0] and stamps[-1] <= self.end_ns):
                raise SchemaError(
                    f"episode {self.episode_id}: {name} span {stamps[0]}..{stamps[-1]} ns; "
                    f"expected within {self.t0_ns}..{self.end_ns}"
                )
        if (np.diff(times) <= 0).any():
            raise SchemaError(f"episode {self.episode_id}: frame time stamps do not ascend strictly")
        if self.truth is not None and self.truth.motions is not None:
            moved = self.truth.motions.moves_at(self.t0_ns)
            if moved:
                raise SchemaError(
                    f"episode {self.episode_id}: things are moved at t0 ({next(iter(moved))}); "
                    f"expected motions from t0 on"
                )
        if self.truth is not None and self.truth.poses is not None:
            observed = 0 if self.poses is None else len(self.poses)
            if len(self.truth.poses.match) != observed:
                raise SchemaError(
                    f"episode {self.episode_id}: {len(self.truth.poses.match)} matches for {observed} observed poses"
                )

    @property
    def placed_sensor(self) -> Sensor:
        """The sensor with its height: as truth has it where the inputs do not tell it and truth is at hand."""
        return self.sensor if self.truth is None or self.truth.sensor is None else self.truth.sensor

    @property
    def duration_s(self) -> float:
        """Seconds from t0 to the end."""
        return (self.end_ns - self.t0_ns) / NS_PER_S

    def until(self, seconds: float) -> Episode:
        """The episode as a shorter watching would have given it: inputs up to t0 + ``seconds``.

        Truth stays as it is, less the matches of poses that are no longer observed.
        """
        if not seconds >= 0:
            raise SchemaError(f"until_s is {seconds}; expected seconds >= 0")
        end_ns = self.end_ns if seconds >= self.duration_s else self.t0_ns + round(seconds * NS_PER_S)
        poses = None if self.poses is None else self.poses.until(end_ns)
        count = int(np.searchsorted(self.frames.timestamps_ns, end_ns, side="right"))
        truth = self.truth
        if truth is not None and truth.frames is not None:
            truth = replace(truth, frames=FramesTruthUntil(truth.frames, count))
        if truth is not None and truth.poses is not None:
            kept = 0 if poses is None else len(poses)
            truth = replace(truth, poses=replace(truth.poses, match=truth.poses.match[:kept]))
        return replace(self, frames=FramesUntil(self.frames, count), poses=poses, end_ns=end_ns, truth=truth)


def check_id(identifier: str, name: str) -> None:
    """Raise SchemaError unless an identifier is safe as a file name: letters, digits, dot, dash, underscore; <= 100."""
    plain = identifier.replace("-", "").replace("_", "").replace(".", "")
    if not (0 < len(identifier) <= 100 and plain.isascii() and plain.isalnum()) or identifier.startswith("."):
        raise SchemaError(
            f"{name} is {identifier!r}; expected 1-100 letters, digits, '.', '-' or '_', not starting with '.'"
        )
