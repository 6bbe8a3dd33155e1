"""How people live in the plane, how a 360 camera errs about them, and how maps are drawn. All defaults are ours."""

from __future__ import annotations

from dataclasses import dataclass

from hsbench.errors import SchemaError

Range = tuple[float, float]


@dataclass(frozen=True)
class PlanarLifeConfig:
    """A life of positions only. Ranges are drawn from evenly, those of durations evenly on a logarithmic scale.

    minutes: length. people: fewest and most. rate_hz: moments a second. explore, sit, touch: weights of what is done
    next. stand_s, sit_s, touch_s: stays at a place, on a seat, at a part. speed_m_s: a walker's pace.
    unused_share: of places nobody ever uses in a life. seated_touch_share: of sits where a part is in reach that has a
    hand on it for a while. atypical_share: of sits and touches that become sitting on the floor or an edge.
    """

    minutes: Range = (5.0, 30.0)
    people: tuple[int, int] = (1, 4)
    rate_hz: float = 5.0
    explore: float = 0.30
    sit: float = 0.30
    touch: float = 0.40
    stand_s: Range = (1.0, 20.0)
    sit_s: Range = (20.0, 600.0)
    touch_s: Range = (2.0, 60.0)
    speed_m_s: Range = (0.6, 1.3)
    unused_share: float = 0.25
    seated_touch_share: float = 0.5
    atypical_share: float = 0.04

    def __post_init__(self) -> None:
        for name in ("minutes", "people", "stand_s", "sit_s", "touch_s", "speed_m_s"):
            low, high = getattr(self, name)
            if not 0 < low <= high:
                raise SchemaError(f"life.{name} is ({low}, {high}); expected 0 < least <= most")
        if not self.rate_hz > 0:
            raise SchemaError(f"life.rate_hz is {self.rate_hz}; expected moments a second > 0")
        weights = (self.explore, self.sit, self.touch)
        if min(weights) < 0 or sum(weights) <= 0:
            raise SchemaError(f"life weights explore, sit, touch are {weights}; expected >= 0, not all zero")
        for name in ("unused_share", "seated_touch_share", "atypical_share"):
            _check_share(f"life.{name}", getattr(self, name))


@dataclass(frozen=True)
class SphereErrors:
    """What a pose detector on 360 pictures, and depth from the size of body parts, get wrong.

    Depth is d = l / (2 tan(alpha / 2)) of a part of length l seen under an angle alpha. So an error of alpha makes one
    of depth that grows with d^2, an unknown stature scales all depths of a person, and a part that leans towards the
    camera looks far. stature_sd: relative, adults of 1.7 m. joint_sd_px: of a joint along a picture
    ``width_px`` wide, after sub-pixel peaks and a short median over time.
    part_m: l, a torso of .288 of the stature (Winter, *Biomechanics and Motor Control of Human Movement*).
    foreshortened_sd: relative, of each stay, upright and seated; only the far side of it is taken.
    miss_share: of poses in full sight that the detector loses. far_m: where distance leaves 1 / e of the poses.
    near_m: nobody nearer is found. confusion: rows are what is done (stand, sit, interact), columns what is said.
    """

    width_px: int = 1024
    joint_sd_px: float = 1.2
    part_m: float = 0.49
    stature_sd: float = 0.045
    foreshortened_sd: tuple[float, float] = (0.04, 0.10)
    miss_share: float = 0.10
    near_m: float = 0.5
    far_m: float = 9.0
    confusion: tuple[tuple[float, float, float], ...] = ((0.90, 0.03, 0.07), (0.06, 0.86, 0.08), (0.15, 0.07, 0.78))

    def __post_init__(self) -> None:
        if min(self.joint_sd_px, self.stature_sd, *self.foreshortened_sd) < 0:
            raise SchemaError("errors: standard deviations are negative; expected >= 0")
        if not (self.width_px > 0 and self.part_m > 0 and 0 <= self.near_m < self.far_m):
            raise SchemaError(
                f"errors: width_px {self.width_px}, part_m {self.part_m}, near_m {self.near_m}, far_m {self.far_m}; "
                "expected a width and a length > 0 and 0 <= nearest < farthest"
            )
        _check_share("errors.miss_share", self.miss_share)
        rows = self.confusion
        if [len(row) for row in rows] != [3, 3, 3] or any(min(r) < 0 or abs(sum(r) - 1) > 1e-9 for r in rows):
            raise SchemaError(f"errors.confusion is {rows}; expected three rows of three shares that sum to 1")


@dataclass(frozen=True)
class MapConfig:
    """Maps of ``side_cells`` squared cells about the camera, and how many of them share a room.

    samples_per_room: other lives, cameras and headings in the same room, which has its truth computed once.
    home_share: of scenes that are whole flats or offices. camera_height_m: range. central_share: the camera stands on
    one of so many of the room's walkable cells, those nearest to all others. blur_m: standard deviation of a pose's
    mark. delta: what a pose adds to its middle.
    """

    samples_per_room: int = 20
    home_share: float = 0.1
    camera_height_m: Range = (1.2, 1.8)
    central_share: float = 0.15
    side_cells: int = 256
    cell_m: float = 0.05
    blur_m: float = 0.10
    delta: float = 1.0 / 15.0

    def __post_init__(self) -> None:
        if not (self.samples_per_room > 0 and self.side_cells > 0 and self.cell_m > 0 and self.blur_m > 0):
            raise SchemaError("maps: samples_per_room, side_cells, cell_m and blur_m must be > 0")
        _check_share("maps.home_share", self.home_share)
        _check_share("maps.central_share", self.central_share)
        if not 0 < self.delta <= 1:
            raise SchemaError(f"maps.delta is {self.delta}; expected 0..1, above 0")

    @property
    def low_m(self) -> float:
        """Smallest x and y of the maps in the episode frame."""
        return -self.side_cells * self.cell_m / 2


def _check_share(name: str, share: float) -> None:
    if not 0 <= share <= 1:
        raise SchemaError(f"{name} is {share}; expected 0..1 (is it in percent?)")
