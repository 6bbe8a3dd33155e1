"""What there is of NYU v2 in real files: the map of 40 classes, the rotations of its frames, one depth picture.

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout.
"""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import loadmat

from hsbench.datasets.importers import nyu_labelled, sscnet, upright
from hsbench.datasets.importers.mat5 import read_mat5
from hsbench.datasets.importers.room_boxes import NEUTRAL, category_of
from tests.unit.datasets.mutations import mutated, refused_or_read

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
SSC = REALDATA / "ssc"
ROTATIONS = SSC / "nyuv2_camera_rotations_NYU.txt"
pytestmark = pytest.mark.skipif(not SSC.is_dir(), reason=f"needs the real captures in {SSC} (set HSBENCH_REALDATA)")
ANY_FILE = settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])


def test_matlab_files_are_read_as_scipy_reads_them() -> None:
    for path in sorted(SSC.glob("*.mat")):
        ours, theirs = read_mat5(path), loadmat(path)
        assert set(ours) == {name for name in theirs if not name.startswith("__")}
        for name, value in ours.items():
            flat = theirs[name].ravel(order="F")
            if isinstance(value, list):
                assert [str(item) for item in value] == [str(item[0]) if item.size else "[]" for item in flat]
            else:
                np.testing.assert_array_equal(value, theirs[name])


def test_the_map_of_40_classes() -> None:
    coarse = nyu_labelled._coarse(SSC / "nyuv2_classMapping40.mat")
    names = [str(name[0]) for name in loadmat(SSC / "nyuv2_classMapping40.mat")["allClassName"].ravel()]
    assert len(coarse) == len(names) == 894
    by_name = dict(zip(names, coarse.values(), strict=True))
    assert (by_name["bed"], by_name["bookshelf"], by_name["night stand"]) == ("bed", "bookshelf", "night stand")
    # Most of the 40 classes have a category of ours.
    assert sum(category_of(name) != NEUTRAL for name in set(coarse.values())) >= 28


def test_every_rotation_is_read() -> None:
    tilts = []
    for index in range(1449):
        R = nyu_labelled.read_rotation(ROTATIONS, index)
        _, episode_T_upright = upright.to_episode_frame(R, -1.0)
        assert episode_T_upright[2, 3] == 1.0
        tilts.append(math.degrees(math.asin(-R[2, 2])))
    assert 0 < np.median(tilts) < 30
    assert np.max(np.abs(tilts)) < 75


def test_the_rotation_of_a_frame_agrees_with_its_room_model() -> None:
    """NYU0001 has a pose in SSCNet's volume, made from its room model; both say how it leans, to a degree."""
    frame = sscnet.read_frame(SSC / "sscnet_NYU0001_0000_depth.png", SSC / "sscnet_NYU0001_0000.bin")
    up_model, up_rotation = frame.world_T_camera[2, :3], nyu_labelled.read_rotation(ROTATIONS, 0)[2]
    assert up_model @ up_rotation > math.cos(math.radians(1.0))
    assert up_model @ nyu_labelled.read_rotation(ROTATIONS, 0).T[2] < 0.5  # the other way round
    # The floor that the upright depth shows is where the model has it.
    points = frame.camera.unproject(frame.depth_m)[frame.depth_m > 0]
    level = upright.floor_level(points @ up_rotation)
    assert level == pytest.approx(-frame.world_T_camera[2, 3], abs=0.1)


@ANY_FILE
@given(data=st.data())
def test_mutated_real_files_are_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(["nyuv2_classMapping40.mat", "sscnet_ClassMapping.mat"]))
    refused_or_read(read_mat5, tmp_path / name, data.draw(mutated((SSC / name).read_bytes())))
