"""Room models of NYU v2 written here with SciPy from the layout, and MATLAB 5 files of any kind as SciPy reads them.

*Unverified on real data*: no model was at hand.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.io import loadmat, savemat

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers import mat5
from hsbench.datasets.importers.mat5 import read_mat5
from hsbench.datasets.importers.mat73 import read_mat73
from hsbench.datasets.importers.nyucad import read_nyucad
from hsbench.datasets.importers.room_captures import nyucad_episode
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError
from hsbench.typing import AnyArray, FloatArray
from tests.unit.datasets import room_files as made
from tests.unit.datasets.mutations import mutated, refused, refused_or_read

h5py = pytest.importorskip("h5py")
ANY_FILE = settings(deadline=None, max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
TO_MODEL = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # (x right, y ahead, z up) -> (x right, y up, z back)
FACES = np.array([[1, 3, 2], [1, 4, 3], [5, 6, 7], [5, 7, 8], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 4, 8],
                  [3, 8, 7], [4, 1, 5], [4, 5, 8]])  # fmt: skip


def cell(items: list[Any]) -> AnyArray:
    array = np.empty((1, len(items)), dtype=object)
    for k, item in enumerate(items):
        array[0, k] = item
    return array


def to_model(points_episode: FloatArray) -> FloatArray:
    """(N, 3) points of the episode frame as a model has them: x right, y up, z back, the camera at the origin."""
    x, y, z = points_episode.T
    return np.stack([-y, x, z - made.HEIGHT_M], axis=1) @ TO_MODEL.T


def surface(corners_xy: FloatArray, z: float) -> dict[str, Any]:
    points = to_model(np.column_stack([corners_xy, np.full(len(corners_xy), z)]))
    return {"polygon": {"pts": cell([dict(zip("xyz", map(float, p), strict=True)) for p in points])}}


def prism(corners_xy: FloatArray, low: float, high: float, faces: AnyArray = FACES) -> dict[str, Any]:
    ring = [np.column_stack([corners_xy, np.full(4, z)]) for z in (low, high)]
    return {"comp": cell([{"vertices": to_model(np.concatenate(ring)), "faces": faces.astype(float)}])}


ROOM = np.array([[0.0, -2.0], [3.0, -2.0], [3.0, 1.5], [0.0, 1.5]])


def model() -> dict[str, Any]:
    camera_R = (TO_MODEL @ made.upright_R_camera() @ np.diag([1.0, -1.0, -1.0])).T
    box = made.box_corners()[::-1]  # counter-clockwise
    objects = [
        {
            "model": {"label": "night stand", "surfaces": cell([])},
            "mesh": prism(box, made.BOX_LOW[2], made.BOX_HIGH[2]),
        },
        {"model": {"label": "floor", "surfaces": cell([surface(ROOM, 0.0)])}},
        {"model": {"label": "ceiling", "surfaces": cell([])}, "mesh": prism(ROOM, 2.5, 2.55)},
        {"model": {"label": "garbage disposal unit", "surfaces": cell([])}, "mesh": prism(box + [0, 0.9], 0.0, 0.3)},
    ]
    return {"objects": cell(objects), "camera": {"R": camera_R}}


def write(path: Path, found: dict[str, Any] | None = None, compressed: bool = True) -> Path:
    savemat(path, {"model": model() if found is None else found}, do_compression=compressed)
    return path


@pytest.mark.parametrize("compressed", [True, False])
def test_the_room_is_found(tmp_path: Path, compressed: bool) -> None:
    found = read_nyucad(write(tmp_path / "1_office.mat", compressed=compressed))
    assert found.floor_m == pytest.approx(-made.HEIGHT_M)
    assert found.without_mesh == 1
    np.testing.assert_allclose(found.upright_R_camera, made.upright_R_camera(), atol=1e-9)
    episode, notes = nyucad_episode(found, "a")
    sensor = episode.sensor
    assert (sensor.height_m, sensor.tilt_rad, sensor.roll_rad) == pytest.approx(
        (made.HEIGHT_M, made.TILT_RAD, made.ROLL_RAD), abs=1e-6
    )
    assert episode.truth is not None
    assert episode.truth.scene is not None
    scene = episode.truth.scene
    assert [item.category_name for item in scene.objects] == ["night_stand", "ceiling", "object"]
    stand = scene.objects[0]
    low, high = stand.vertices.min(axis=0), stand.vertices.max(axis=0)
    np.testing.assert_allclose([low, high], [made.BOX_LOW, made.BOX_HIGH], atol=1e-4)
    assert len(stand.solids) == 1  # closed, convex, and its faces look outward
    assert stand.solids[0].volume_m3 == pytest.approx(np.prod(made.BOX_HIGH - made.BOX_LOW), rel=1e-3)
    assert scene.height_m == pytest.approx(2.5)
    assert scene.rooms[0].area_m2 == pytest.approx(10.5)
    assert any("1 objects without a mesh" in note for note in notes)
    assert any("garbage disposal unit" in note for note in notes)


def put(file: Any, where: Any, name: str, value: Any) -> None:
    """Write a value as MATLAB 7.3 does."""
    if isinstance(value, dict):
        group = where.create_group(name)
        group.attrs["MATLAB_class"] = np.bytes_(b"struct")
        for key, inner in value.items():
            put(file, group, key, inner)
        return
    if isinstance(value, str):
        where[name] = np.array([[ord(letter)] for letter in value], dtype=np.uint16)
        kind = b"char"
    elif isinstance(value, np.ndarray) and value.dtype == object and value.size:
        references = np.empty(value.shape[::-1], dtype=h5py.ref_dtype)
        for k, inner in enumerate(value.ravel()):
            refs = file.require_group("#refs#")
            at = f"r{len(refs)}"
            put(file, refs, at, inner)
            references[k, 0] = refs[at].ref
        where[name] = references
        kind = b"cell"
    elif isinstance(value, np.ndarray) and not value.size:
        where[name] = np.array(value.shape, dtype=np.uint64)
        where[name].attrs["MATLAB_empty"] = 1
        kind = b"cell"
    else:
        where[name] = np.atleast_2d(value).T
        kind = b"double"
    where[name].attrs["MATLAB_class"] = np.bytes_(kind)


def write73(path: Path, found: dict[str, Any] | None = None) -> Path:
    with h5py.File(path, "w", userblock_size=512) as file:
        put(file, file, "model", model() if found is None else found)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: made".ljust(124) + b"\x00\x02IM")
    return path


def equal(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return isinstance(b, dict) and set(a) == set(b) and all(equal(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(map(equal, a, b))
    if isinstance(b, list):
        return not b and not len(a)  # an empty cell array of version 7.3 is an empty array
    return a == b if isinstance(a, str) else bool(np.array_equal(a, b))


def test_both_versions_of_matlab_say_the_same(tmp_path: Path) -> None:
    new, old = read_mat73(write73(tmp_path / "a.mat"), "model"), read_mat5(write(tmp_path / "b.mat"))["model"]
    assert equal(new, old)
    episodes = [nyucad_episode(read_nyucad(tmp_path / name), "a")[0] for name in ("a.mat", "b.mat")]
    scenes = [episode.truth.scene for episode in episodes if episode.truth is not None]
    first_scene, second_scene = (scene for scene in scenes if scene is not None)
    for a, b in zip(first_scene.objects, second_scene.objects, strict=True):
        assert a.category_name == b.category_name
        np.testing.assert_array_equal(a.vertices, b.vertices)


def test_arrays_of_structs_of_version_73(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.mat", "w") as file:
        group = file.create_group("s")
        for name, numbers in (("x", (1.0, 2.0)), ("y", (5.0, 6.0))):
            references = np.empty((2, 1), dtype=h5py.ref_dtype)
            for k, number in enumerate(numbers):
                file[f"#refs#/{name}{k}"] = [[number]]
                references[k, 0] = file[f"#refs#/{name}{k}"].ref
            group[name] = references
    found = read_mat73(tmp_path / "a.mat", "s")
    assert [(row["x"].item(), row["y"].item()) for row in found] == [(1.0, 5.0), (2.0, 6.0)]


def cyclic(file: Any) -> None:
    file.create_dataset("model", (9, 1), h5py.ref_dtype)
    file["model"][...] = np.array([[file["model"].ref]] * 9, dtype=h5py.ref_dtype)


@pytest.mark.parametrize(
    ("build", "match"),
    [
        (lambda file: file.create_group("other"), "has no 'model'"),
        (lambda file: file.__setitem__("model", h5py.ExternalLink("b.mat", "/m")), "has no 'model'"),
        (lambda file: file.__setitem__("model", 3.0), "is an array of shape"),
        (lambda file: file.create_dataset("model", (10**7, 10), "f8", chunks=(1000, 10)), "more than 67,108,864 bytes"),
        (
            lambda file: file.create_dataset("model", (10**6, 10), "u1", chunks=(10**6, 10), maxshape=(None, 10)),
            "struct",
        ),
        (lambda file: file.create_group("model").__setitem__("objects", h5py.SoftLink("/x")), "links to another place"),
        (cyclic, "more than 1,000,000 values, or nested deeper than 32"),
        (lambda file: file.create_dataset("model", (2, 1), h5py.ref_dtype), "cannot be read"),
    ],
)
def test_hostile_files_of_version_73(tmp_path: Path, build: Callable[[Any], object], match: str) -> None:
    with h5py.File(tmp_path / "a.mat", "w") as file:
        build(file)
    refused(read_nyucad, tmp_path / "a.mat", match)


def test_import_with_a_depth_picture(tmp_path: Path) -> None:
    path = write(tmp_path / "1_office.mat")
    made.write_grey16(tmp_path / "d.png", made.rotated(np.full((480, 640), 2.0)))
    arguments = ["import", "nyucad", str(path), "--depth", str(tmp_path / "d.png"), "--out", str(tmp_path / "out")]
    assert run(arguments) == 0
    assert run([*arguments[:3], "--name", "plain", *arguments[5:]]) == 0
    assert verify_files(tmp_path / "out") == []
    with_depth, plain = (load(tmp_path / "out", truth=True)[k] for k in range(2))
    assert [verify_episode(episode) for episode in (with_depth, plain)] == [[], []]
    assert (len(with_depth.frames), len(plain.frames)) == (1, 0)
    assert plain.truth is not None
    assert plain.truth.scene is not None
    assert len(plain.truth.scene.objects) == 3
    with pytest.raises(DataError, match="9 x 9 px; expected 640 x 480"):
        nyucad_episode(read_nyucad(path), "a", np.ones((9, 9), np.float32))


def edited(edit: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
    found = model()
    edit(found)
    return found


def first(found: dict[str, Any]) -> Any:
    return found["objects"][0, 0]


def first_mesh(found: dict[str, Any]) -> Any:
    return first(found)["mesh"]["comp"][0, 0]


@pytest.mark.parametrize(
    ("found", "match"),
    [
        ({"objects": cell([])}, "without 'camera'; expected a struct"),
        (edited(lambda m: m.update(objects=cell([]))), "no object is labelled floor"),
        (edited(lambda m: m.update(objects="none")), "model.objects is a text; expected a cell array"),
        (edited(lambda m: m["camera"].update(R=np.eye(4))), r"camera.R is an array of shape \(4, 4\)"),
        (edited(lambda m: m["camera"].update(R=2 * np.eye(3))), "camera.R .* is no rotation"),
        (edited(lambda m: m["camera"].update(R=np.full((3, 3), np.nan))), "camera.R has a value that is NaN"),
        (edited(lambda m: first(m)["model"].update(label=5.0)), r"objects\{1\}.model.label"),
        (edited(lambda m: first(m).pop("model")), r"objects\{1\} is a struct without 'model'"),
        (edited(lambda m: first_mesh(m).update(faces=FACES + 1)), "row 4 has 9; expected vertices 1 to 8"),
        (edited(lambda m: first_mesh(m).update(faces=FACES - 1)), "row 1 has 0; expected vertices 1 to 8"),
        (edited(lambda m: first_mesh(m).update(faces=FACES[:, :2])), r"faces is an array of shape \(12, 2\)"),
        (edited(lambda m: first_mesh(m).update(vertices=np.full((8, 3), 900.0))), "NaN or beyond 100 m"),
        (edited(lambda m: m["objects"][0, 1]["model"].update(surfaces=cell([]))), "surfaces is empty"),
        (edited(lambda m: m["objects"][0, 1]["model"].update(surfaces=cell([surface(ROOM[:2], 0.0)]))), "2 corners"),
    ],
)  # fmt: skip
def test_other_layouts_are_named_in_one_line(tmp_path: Path, found: dict[str, Any], match: str) -> None:
    refused(read_nyucad, write(tmp_path / "a.mat", found), match)


def test_a_room_upside_down_or_without_anything_in_it(tmp_path: Path) -> None:
    only_floor = edited(lambda m: m.update(objects=cell([m["objects"][0, 1]])))
    with pytest.raises(DataError, match="nothing of the model is above its floor"):
        nyucad_episode(read_nyucad(write(tmp_path / "a.mat", only_floor)), "a")
    above = edited(lambda m: m["objects"][0, 1]["model"].update(surfaces=cell([surface(ROOM, 2.0)])))
    with pytest.raises(DataError, match="above the camera; expected it below"):
        nyucad_episode(read_nyucad(write(tmp_path / "b.mat", above)), "a")


# MATLAB files


def same(ours: Any, scipys: Any) -> bool:
    """Whether a value of ours is that of SciPy's reader, whose structs are arrays of records."""
    if isinstance(ours, dict):
        return scipys.size == 1 and all(same(v, scipys.ravel()[0][k]) for k, v in ours.items())
    if isinstance(ours, list):
        flat = scipys.ravel(order="F")
        return len(ours) == len(flat) and all(
            all(same(v, b[k]) for k, v in a.items()) if scipys.dtype.names else same(a, b)
            for a, b in zip(ours, flat, strict=True)
        )
    if isinstance(ours, str):
        return (scipys.size == 0 and ours == "") or ours == str(scipys[0])
    return bool(ours.shape == scipys.shape and np.array_equal(ours, scipys, equal_nan=True))


plain_values = st.one_of(
    hnp.arrays(
        st.sampled_from([np.float64, np.float32, np.uint8, np.int16, np.int32, np.uint64]),
        hnp.array_shapes(min_dims=2, max_dims=3, min_side=0, max_side=3),
    ),
    st.text(st.characters(min_codepoint=32, max_codepoint=0x2FF), min_size=1, max_size=9),
)
values = st.recursive(
    plain_values,
    lambda inner: st.one_of(
        st.lists(inner, min_size=1, max_size=3).map(cell),
        st.dictionaries(st.sampled_from(["a", "bb", "long_field_name"]), inner, min_size=1, max_size=3),
    ),
    max_leaves=8,
)


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(found=st.dictionaries(st.sampled_from(["x", "model"]), values, min_size=1), compressed=st.booleans())
def test_every_file_of_scipy_is_read_as_scipy_reads_it(tmp_path: Path, found: dict[str, Any], compressed: bool) -> None:
    path = tmp_path / "a.mat"
    savemat(path, found, do_compression=compressed, long_field_names=True)
    ours, theirs = read_mat5(path), loadmat(path)
    assert set(ours) == set(found)
    assert all(same(value, theirs[name]) for name, value in ours.items())


def test_what_is_no_plain_value_is_none(tmp_path: Path) -> None:
    from scipy.sparse import csc_array

    savemat(tmp_path / "a.mat", {"c": np.array([[1 + 2j]]), "s": csc_array(np.eye(2)), "n": 3.0})
    found = read_mat5(tmp_path / "a.mat")
    assert (found["c"], found["s"], found["n"].item()) == (None, None, 3.0)


def header(rest: bytes = b"") -> bytes:
    return b"MATLAB 5.0 MAT-file".ljust(116) + bytes(8) + struct.pack("<H", 0x0100) + b"IM" + rest


def array(kind: int, sides: tuple[int, ...], rest: bytes = b"") -> bytes:
    dims = struct.pack(f"<{len(sides)}i", *sides)
    body = struct.pack("<IIII", 6, 8, kind, 0) + struct.pack("<II", 5, len(dims)) + dims + bytes(-len(dims) % 8)
    body += struct.pack("<II", 1, 0) + rest
    return struct.pack("<II", 14, len(body)) + body


NESTED = b""
for _ in range(40):
    NESTED = array(1, (1, 1), NESTED)


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (b"", "no MATLAB file of version 5 at offset 124"),
        (b"\x89HDF\r\n\x1a\n" + bytes(600), "cannot be read: .*expected MATLAB 7.3"),
        (b"MATLAB 7.3 MAT-file".ljust(600), "cannot be read: .*expected MATLAB 7.3"),
        (header(b"\x00"), "offset 128: 1 bytes; expected a variable"),
        (header(struct.pack("<II", 14, 900)), "offset 128: a variable of 900 bytes of which 0 are there"),
        (header(struct.pack(">II", 14, 0)), "offset 128: "),
        (header(struct.pack("<II", 15, 4) + b"none"), "offset 128: a compressed variable is damaged"),
        (header(struct.pack("<II", 15, 20) + zlib.compress(bytes(9000))[:20]), "compressed variable ends early"),
        (header(array(1, (2**31 - 1, 2**31 - 1))), "arrays in 0 bytes; expected 8 bytes or more each"),
        (header(array(2, (2**20, 2**10), struct.pack("<IIi4xIIs7x", 5, 4, 1, 1, 1, b"a"))), "arrays in 0 bytes"),
        (header(array(6, (2**30, 2**30), struct.pack("<IId", 9, 8, 1.0))), "1 numbers in an array of"),
        (header(array(6, (-1, 1), struct.pack("<IId", 9, 8, 1.0))), "sides .-1, 1.; expected an array"),
        (header(array(6, (1, 1), struct.pack("<IId", 9, 7, 1.0))), "7 bytes of float64"),
        (header(NESTED), "nested deeper than 32"),
    ],
)
def test_damaged_files(tmp_path: Path, content: bytes, match: str) -> None:
    path = tmp_path / "a.mat"
    path.write_bytes(content)
    refused(read_nyucad, path, match)


def test_files_that_would_fill_the_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mat5, "MAX_PLAIN_BYTES", 1 << 20)
    bomb = zlib.compress(bytes(64 << 20), 9)
    (tmp_path / "a.mat").write_bytes(header(struct.pack("<II", 15, len(bomb)) + bomb))
    refused(read_mat5, tmp_path / "a.mat", "more than 1,048,576 bytes in all")
    monkeypatch.setattr(mat5, "MAX_FILE_BYTES", 1000)
    refused(read_mat5, tmp_path / "a.mat", "more than 1,000 bytes")


@ANY_FILE
@given(data=st.data(), version=st.sampled_from(["compressed", "plain", "7.3"]))
def test_mutated_files_are_read_or_refused(tmp_path: Path, data: st.DataObject, version: str) -> None:
    path = tmp_path / "sound.mat"
    sound = (write73(path) if version == "7.3" else write(path, compressed=version == "compressed")).read_bytes()
    path, damaged = tmp_path / "a.mat", data.draw(mutated(sound))
    refused_or_read(read_nyucad, path, damaged, lambda found: nyucad_episode(found, "a"))
