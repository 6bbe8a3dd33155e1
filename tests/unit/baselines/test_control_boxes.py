"""Detection: stops of a person who stays and goes on, boxes around blocks of depth, means by hand."""

from __future__ import annotations

import numpy as np
import pytest
from lived_rooms import figure

from hsbench.baselines.controls.boxes import Stop, components, fit_constant, fit_usual, stops
from hsbench.geometry.cameras import PinholeCamera
from hsbench.schema import Episode, PoseTable, Sensor
from hsbench.schema.episode import Frame, FrameList
from hsbench.schema.skeletons import COCO_18
from hsbench.tasks.object_detection import MAX_BOXES


def test_stops_are_where_somebody_stays_and_not_where_one_passes() -> None:
    walk = [(2.0 + 0.1 * k, 0.5) for k in range(20)]  # one metre a second, ten poses a second
    places = [(2.0, 0.5)] * 50 + walk + [(4.0, 0.5)] * 5
    joints = np.stack([figure(p) for p in places] + [figure((4.0, -1.0), sits=True)] * 40)
    n = len(joints)
    poses = PoseTable(
        COCO_18.name,
        np.arange(n, dtype=np.int64) * 100_000_000,
        np.ones(n, np.int32),
        np.full((n, 18), 2, np.uint8),
        joints.astype(np.float32),
    )
    sat, stood = stops(poses)
    assert (sat.sat, stood.sat) == (True, False)
    assert np.hypot(sat.x - 4.0, sat.y + 1.0) < 0.2
    assert np.hypot(stood.x - 2.0, stood.y - 0.5) < 0.2
    assert sat.seconds == pytest.approx(4.0, abs=0.01)
    assert 5.0 <= stood.seconds < 5.5
    assert stops(poses.select(np.zeros(n, bool))) == []


def test_the_usual_object_by_hand() -> None:
    boxes = np.array([[2.0, 0.0, 0.4, 1.0, 1.0, 0.8, 0.3], [4.0, 0.0, 0.5, 2.0, 1.0, 1.0, 0.0]])
    usual = fit_usual([([Stop(2.1, 0.0, 9.0, True), Stop(4.0, 3.0, 9.0, False)], boxes), ([], boxes)])
    assert usual.size.tolist() == [[2.0, 1.0, 1.0], [1.0, 1.0, 0.8]]  # stood near the second, sat on the first
    assert usual.z.tolist() == [0.5, 0.4]
    assert usual.share.tolist() == [0.0, 1.0]
    found = usual.boxes([Stop(1.0, 1.0, 2.0, True), Stop(3.0, 1.0, 8.0, True)], 0.25)
    expected = np.array([[3, 1, 0.4, 1, 1, 0.8, 0.25], [1, 1, 0.4, 1, 1, 0.8, 0.25]])
    assert found.boxes == pytest.approx(expected, abs=1e-6)
    assert found.scores.tolist() == [1.0, 0.625]
    many = usual.boxes([Stop(k, 0.0, 2.0, False) for k in range(100)], 0.0)
    assert len(many.boxes) == MAX_BOXES
    assert len(usual.boxes([], 0.0).boxes) == 0


def test_the_constant_is_the_mean_box_of_each_place() -> None:
    first = np.array([[1.0, 0.1, 0.5, 1.0, 1.0, 1.0, 0.2]])
    second = np.array([[1.2, 0.3, 0.3, 0.6, 1.0, 0.6, 0.9], [5.0, -3.0, 1.0, 2.0, 1.0, 2.0, 0.0]])
    found = fit_constant([first, second])
    assert found.boxes.astype(np.float64) == pytest.approx(
        np.array([[1.1, 0.2, 0.4, 0.8, 1.0, 0.8, 0.0], [5.0, -3.0, 1.0, 2.0, 1.0, 2.0, 0.0]]), abs=1e-6
    )
    assert found.scores.tolist() == [1.0, 0.5]


def test_two_blocks_of_depth_are_two_boxes() -> None:
    """A room of 4 x 4 m seen from its wall, with two crates on the floor."""
    camera = PinholeCamera(320, 240, 200.0, 200.0, 160.0, 120.0)
    sensor = Sensor("rgbd", camera, 1.6, 0.35)
    crates = [((1.6, 2.1), (-0.9, -0.5), 0.5), ((2.4, 3.0), (0.4, 1.0), 0.7)]
    rays = camera.rays() @ sensor.world_T_camera[:3, :3].T
    start = sensor.world_T_camera[:3, 3]

    def enters(low: np.ndarray, high: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (low - start) / rays, (high - start) / rays
        near, far = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
        return np.where((near < far) & (near > 0), near, np.inf), far

    _, depth = enters(np.array([-0.1, -2.0, 0.0]), np.array([4.0, 2.0, 2.5]))  # the inside of the room
    for (x0, x1), (y0, y1), top in crates:
        depth = np.minimum(depth, enters(np.array([x0, y0, 0.0]), np.array([x1, y1, top]))[0])
    frame = Frame(0, None, depth.astype(np.float32))
    found = components(Episode("crates", "rgbd-activity", sensor, FrameList((frame,)), None, 0, 0))
    assert len(found.boxes) == 2
    for (x0, x1), (y0, y1), top in crates:
        box = found.boxes[np.argmin(np.abs(found.boxes[:, 1] - (y0 + y1) / 2))]
        yaw = (box[6] + np.pi / 4) % (np.pi / 2) - np.pi / 4
        assert abs(yaw) < 0.02
        assert np.abs(box[:2] - [(x0 + x1) / 2, (y0 + y1) / 2]).max() < 0.15
        assert box[5] == pytest.approx(top, abs=0.06)
    blind = Frame(0, None, np.zeros((240, 320), np.float32))
    nothing = components(Episode("blind", "rgbd-activity", sensor, FrameList((blind,)), None, 0, 0))
    assert len(nothing.boxes) == 0
