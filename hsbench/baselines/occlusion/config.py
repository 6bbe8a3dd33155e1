"""Every constant of carving in one place.

Source: S. Fowler, "Visual Analysis of Human Activity", PhD thesis, University of Surrey, 2019, chapter 3 (and
Fowler, Kim, Hilton, BMVC 2017). What the source states: two actions, maps in [0, 1] from 0 that add up, one frame
without people, voxels of .05 m. Every number below is an hsbench default that fills a gap; none is the thesis' value.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CarveConfig:
    """Defaults of hsbench.

    Actions: a pose stands if (hip - knee height) / thigh length exceeds ``stand_ratio`` and the pelvis is above
    ``pelvis_stand_m``; it sits below ``sit_ratio`` with the pelvis within ``pelvis_sit_m``. Where no leg is tracked the
    height of the head decides: above ``head_stand_m`` stands, within ``head_sit_m`` sits. Votes are pooled over
    ``vote_frames`` poses of a track.
    Maps: a pose adds ``delta`` to a disc of ``body_radius_m``.
    Carving: where a map exceeds ``threshold``, standing frees voxels up to ``stand_top_m``; sitting frees
    ``sit_clear_m`` above the seat and supports the seat from below. The seat is ``pelvis_over_seat_m`` below the
    pelvis, at ``seat_height_m`` where no pelvis was tracked.
    """

    stand_ratio: float = 0.75
    sit_ratio: float = 0.5
    pelvis_stand_m: float = 0.60  # recorded Kinect skeletons of standing adults have their pelvis at .73 m and above
    pelvis_sit_m: tuple[float, float] = (0.25, 0.75)
    head_stand_m: float = 1.40
    head_sit_m: tuple[float, float] = (0.80, 1.35)
    vote_frames: int = 15
    body_radius_m: float = 0.22
    delta: float = 1.0 / 15.0
    threshold: float = 0.3
    stand_top_m: float = 1.75
    sit_clear_m: float = 0.85
    seat_height_m: float = 0.45
    pelvis_over_seat_m: float = 0.10


@dataclass(frozen=True)
class CuboidConfig:
    """Defaults of hsbench for cuboid candidates and their choice; lengths in metres, costs in voxels.

    Room: voxels of ``voxel_m`` up to ``height_m``; furniture is above ``floor_m``, farther than ``wall_m`` from the
    boundary, and not below surface that is higher than ``furniture_top_m``.
    Faces: at least ``least_face_voxels``; rows at an end that are filled less than ``end_fill`` of the fullest are cut.
    Candidates: layers that are free by more than ``free_share`` end a box; what ends within ``near_floor_m`` of the
    floor stands on it; faces meet within ``meet_voxels`` where they share ``meet_share`` of the shorter; depths behind
    a side are tried from ``usual_depths_m``; parts below each of ``part_levels_m`` have ``least_part_voxels``; backs of
    seats rise by ``backs_m``; sides are between ``least_m`` and ``most_m``, the longest over ``longest_least_m``.
    Of candidates with an IoU above ``same_iou`` the cheapest stays, ``most_candidates`` in all.
    Program: a box costs ``free_cost`` a voxel of free space in it, ``face_cost`` a voxel of side without a face behind
    it, and ``box_cost``; it gains the weight of what it covers, each voxel once. Two may not share more than
    ``exclusion`` of the smaller; what they share above ``least_overlap`` costs ``overlap_cost`` a voxel. HiGHS stops
    at ``gap`` or after ``limit_s`` seconds. ``greedy`` takes boxes by falling gain instead, without a proof.
    """

    voxel_m: float = 0.05
    height_m: float = 2.4
    floor_m: float = 0.05
    wall_m: float = 0.10
    furniture_top_m: float = 2.15
    least_face_voxels: int = 20
    end_fill: float = 0.3
    free_share: float = 0.5
    near_floor_m: float = 0.3
    meet_voxels: int = 3
    meet_share: float = 0.5
    usual_depths_m: tuple[float, ...] = (0.3, 0.45, 0.6, 0.9)
    part_levels_m: tuple[float, ...] = (0.5, 0.8, 1.2, 2.4)
    least_part_voxels: int = 64
    backs_m: tuple[float, ...] = (0.0, 0.4)
    least_m: float = 0.1
    longest_least_m: float = 0.3
    most_m: float = 3.0
    same_iou: float = 0.9
    most_candidates: int = 400
    free_cost: float = 0.3
    face_cost: float = 0.2
    box_cost: float = 40.0
    surface_weight: float = 1.0
    support_weight: float = 1.0
    hidden_weight: float = 0.5
    exclusion: float = 0.1
    least_overlap: float = 0.01
    overlap_cost: float = 0.5
    gap: float = 0.01
    limit_s: float = 10.0
    greedy: bool = False
