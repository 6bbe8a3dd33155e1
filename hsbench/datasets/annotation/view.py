"""Labels of one picture carried over to another of the same place: ``view_affordance`` of an episode."""

from __future__ import annotations

from dataclasses import dataclass

from hsbench.datasets.annotation.backgrounds import background_rgb
from hsbench.datasets.annotation.homography import Homography, estimate, fixed
from hsbench.datasets.annotation.labels import ViewLabels, labels_at
from hsbench.errors import DataError
from hsbench.geometry.cameras import EquirectangularCamera, TopDownCamera, pixel_centres
from hsbench.schema.episode import Episode
from hsbench.typing import UInt8Array

CAMERAS = ("auto", "fixed")
"""How the place of the camera is known: found from the pictures, or said not to have changed."""


@dataclass(frozen=True, eq=False)
class Transfer:
    """The background of an episode (h, w, 3), its labels, (h, w) uint8 bits of a view, and how they came there."""

    background: UInt8Array
    labels: UInt8Array
    homography: Homography


def annotated_picture(episode: Episode, frame: int) -> UInt8Array:
    """(h, w, 3) uint8, the picture that was labelled. Raises DataError where there is none."""
    if not 0 <= frame < len(episode.frames):
        raise DataError(f"episode {episode.episode_id} has no frame {frame}; expected 0 to {len(episode.frames) - 1}")
    rgb = episode.frames[frame].rgb
    if rgb is None:
        raise DataError(f"frame {frame} of episode {episode.episode_id} has no colour; expected a colour picture")
    return rgb


def transfer(
    labels: ViewLabels, bits: tuple[int, ...], source: Episode, picture: UInt8Array, target: Episode, camera: str
) -> Transfer:
    """Labels of a picture (h, w, 3) of an episode carried over to the background of one of the same place.

    camera: one of ``CAMERAS``. Raises DataError where the labels are of a picture of another size, or the quality is
    not good enough; the message tells the figures.
    """
    for name, shape in (("labels are of a picture", (labels.height_px, labels.width_px)), ("frame", picture.shape)):
        check_size(name, shape, source)
    shown = background_rgb(target)
    check_size("pictures", shown.shape, target)
    if camera == "auto":
        found = estimate(picture, shown, source.sensor.camera, target.sensor.camera)
    elif source.sensor.camera == target.sensor.camera:
        found = fixed(picture, shown, source.sensor.camera)
    else:
        raise DataError(f"episode {target.episode_id} has another camera than {source.episode_id}: not fixed")
    fault = found.quality.fault()
    curved = isinstance(target.sensor.camera, EquirectangularCamera | TopDownCamera)
    if fault is None and curved and not found.is_identity:
        fault = "the camera moved, and no homography joins its pictures; expected labels of each place"
    if fault is not None:
        raise DataError(f"episode {target.episode_id}: labels cannot be carried over: {fault}")
    return Transfer(shown, carried(labels, bits, found), found)


def carried(labels: ViewLabels, bits: tuple[int, ...], found: Homography) -> UInt8Array:
    """(h, w) uint8 bits of a view: the labels at the place in their picture that each pixel's centre comes from.

    Exact for polygons; of masks the pixel it falls into. ``VIEW_UNSCORED`` where the labelled picture does not reach.
    """
    return labels_at(labels, bits, found.sources(pixel_centres(found.target.width_px, found.target.height_px)))


def check_size(what: str, shape: tuple[int, ...], episode: Episode) -> None:
    """Raise DataError unless a picture (h, w, ...) has the size that the camera of an episode says."""
    camera = episode.sensor.camera
    if shape[:2] != (camera.height_px, camera.width_px):
        raise DataError(
            f"{what} of {shape[1]} x {shape[0]} px; expected {camera.width_px} x {camera.height_px} as the camera of"
            f" episode {episode.episode_id} (resized for labelling?)"
        )
