"""The common schema: what an episode of any sensor is, whether generated or captured.

Frozen dataclasses that cannot be built wrong, and their plain forms (``codec``). Files are for ``hsbench.io``.
"""

from hsbench.schema.categories import CATEGORIES, STRUCTURE, Category, category
from hsbench.schema.episode import ActivityMaps, Episode, EpisodeTruth, Frame, Frames, FramesTruth, FrameTruth
from hsbench.schema.events import EventTable
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.occupancy import AffordanceTruth, AffordanceVoxels, ObjectTruth, OccupancyTruth, PartAffordances
from hsbench.schema.poses import JointState, PoseTable, TruePoseTable
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import KINECT_V2, SKELETONS, Skeleton
from hsbench.schema.states import Action, Evidence, Visibility, VoxelState

SCHEMA_VERSION = "0.4"

__all__ = [
    "CATEGORIES",
    "KINECT_V2",
    "SCHEMA_VERSION",
    "SKELETONS",
    "STRUCTURE",
    "Action",
    "ActivityMaps",
    "AffordanceTruth",
    "AffordanceVoxels",
    "Category",
    "Episode",
    "EpisodeTruth",
    "EventTable",
    "Evidence",
    "Frame",
    "FrameTruth",
    "Frames",
    "FramesTruth",
    "JointState",
    "ObjectMotions",
    "ObjectTruth",
    "OccupancyTruth",
    "Part",
    "PartAffordances",
    "PoseTable",
    "Room",
    "Scene",
    "SceneObject",
    "Sensor",
    "Skeleton",
    "TruePoseTable",
    "Visibility",
    "VoxelState",
    "category",
]
