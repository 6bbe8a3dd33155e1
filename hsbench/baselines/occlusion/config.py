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
