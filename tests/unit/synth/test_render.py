"""The two back ends against closed forms and against each other, on a furnished room."""

from __future__ import annotations

import gc
import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("embreex")

from render_room import CAMERA, LIGHTS, PERSON_ID, POSE, box, ellipsoid, mesh, person, room, shell

from hsbench.errors import HsbenchError, SchemaError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.synth.render import Lighting, Mesh, PointLight, Renderer, View, Window, open_renderer, probe
from hsbench.synth.render.shading import lambert

HERE = Path(__file__).parent
REPOSITORY = HERE.parents[2]
PERSON_WINDOW = Window(263, 61, 121, 353)


def opened(name: str) -> Renderer:
    try:
        return open_renderer(name)  # type: ignore[arg-type]
    except HsbenchError as error:
        pytest.skip(str(error))


@pytest.fixture(params=["pyrender", "raycast"])
def renderer(request: pytest.FixtureRequest) -> Renderer:
    return opened(request.param)


def same(a: View, b: View) -> bool:
    return all(np.array_equal(getattr(a, k), getattr(b, k)) for k in ("rgb", "depth_m", "ids"))


def digest(view: View) -> str:
    return hashlib.sha256(view.rgb.tobytes() + view.depth_m.tobytes() + view.ids.tobytes()).hexdigest()


def crop(view: View, w: Window) -> View:
    box = (slice(w.v0, w.v0 + w.height), slice(w.u0, w.u0 + w.width))
    return View(view.rgb[box], view.depth_m[box], view.ids[box])


def quad(mesh_id: int, a: float, b: float, c: float, reach: float = 50.0) -> Mesh:
    """The plane z = a + b x + c y of the camera frame (camera at the world's origin), its front to the camera."""
    xy = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * reach
    points = np.column_stack([xy, a + xy @ [b, c]])
    return mesh(mesh_id, points, np.array([[0, 2, 1], [0, 3, 2]]), (200, 120, 60))


# --- closed forms


@pytest.mark.parametrize("distance", [0.4, 3.0, 9.0])
def test_fronto_parallel_plane_has_its_distance_as_depth(renderer: Renderer, distance: float) -> None:
    view = renderer.render([quad(7, distance, 0, 0)], CAMERA, np.eye(4), Lighting(1.0))
    assert (view.ids == 7).all()
    tolerance = 0.0 if renderer.name == "raycast" else 1e-5 * distance**2  # 24-bit depth, near plane .05 m
    assert np.abs(view.depth_m - np.float32(distance)).max() <= tolerance


@pytest.mark.parametrize(("b", "c"), [(0.5, 0.0), (0.0, -0.7), (-0.4, 0.3)])
def test_slanted_plane_has_the_depth_of_the_ray_through_the_pixel_centre(
    renderer: Renderer, b: float, c: float
) -> None:
    view = renderer.render([quad(1, 3.0, b, c, reach=4.0)], CAMERA, np.eye(4), LIGHTS)
    rays = CAMERA.rays()
    expected = 3.0 / (1.0 - b * rays[..., 0] - c * rays[..., 1])
    inside = (np.abs(rays[..., :2] * expected[..., None]) < 3.95).all(axis=-1)
    assert inside.sum() > 100_000
    error = np.abs(view.depth_m - expected)[inside]
    assert error.max() <= (4e-7 * expected.max() if renderer.name == "raycast" else 2e-4)


def test_ids_use_all_sixteen_bits(renderer: Renderer) -> None:
    ids = [1, 2, 127, 128, 255, 256, 257, 32767, 32768, 65280, 65533, 65534]
    bars = [box(i, (2.0, 1.2 - 0.2 * k, 0.0), (0.1, 0.2, 3.0), (255, 255, 255)) for k, i in enumerate(ids)]
    view = renderer.render(bars, CAMERA, np.array(POSE_ALONG_X), LIGHTS)
    row = view.ids[240]
    assert [int(i) for i in row[np.flatnonzero(np.diff(row, prepend=0))] if i] == ids
    assert ((view.depth_m > 0) == (view.ids > 0)).all()


POSE_ALONG_X = [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]]


def test_full_ambient_light_gives_the_colours_themselves_also_along_silhouettes(renderer: Renderer) -> None:
    colour = (201, 97, 33)
    ball = ellipsoid(3, (0.1, 0.0, 2.0), (0.4, 0.6, 0.4), colour)
    view = renderer.render([ball], CAMERA, np.eye(4), Lighting(1.0))
    assert (view.rgb[view.ids == 3] == colour).all()
    assert (view.rgb[view.ids == 0] == 0).all()


def test_full_ambient_light_keeps_every_byte(renderer: Renderer) -> None:
    """Colours that number triangles rely on it (render/surfaces.py)."""
    values = np.arange(256)
    bars = np.array([[k / 256, 0, 1] for k in range(257)]) * 2.0 + [-1.0, -1.0, 1.0]
    vertices = np.concatenate([bars, bars + [0.0, 2.0, 0.0]])
    low = np.stack([values, values + 1, values + 258], axis=1)
    high = np.stack([values, values + 258, values + 257], axis=1)
    codes = np.stack([values, 255 - values, values * 7 % 256], axis=1).astype(np.uint8)
    strip = Mesh(1, vertices, np.concatenate([low, high])[:, ::-1], np.concatenate([codes, codes]))
    view = renderer.render([strip], PinholeCamera(1024, 8, 1536.0, 1536.0, 512.0, 4.0), np.eye(4), Lighting(1.0))
    assert np.array_equal(view.rgb, np.broadcast_to(np.repeat(codes, 4, axis=0), (8, 1024, 3)))


def test_lambert_of_a_point_light() -> None:
    lamp = Lighting(0.1, points=(PointLight((0.0, 0.0, 2.0), 0.6, (1.0, 0.5, 0.0)),))
    light = lambert(np.zeros((3, 3)), np.array([[0, 0, 1.0], [0, 0.8, 0.6], [0, 0, -1.0]]), lamp)
    assert np.allclose(light, [[0.25, 0.175, 0.1], [0.19, 0.145, 0.1], [0.1, 0.1, 0.1]])


def test_surfaces_seen_from_behind_or_nearer_than_the_near_plane_are_not_drawn(renderer: Renderer) -> None:
    wall = quad(9, 3.0, 0, 0)
    around = box(1, (-1, -1, -1), (2, 2, 2), (9, 9, 9))
    near = quad(2, 0.03, 0, 0)
    view = renderer.render([around, near, wall], CAMERA, np.eye(4), LIGHTS)
    assert same(view, renderer.render([wall], CAMERA, np.eye(4), LIGHTS))


# --- the two back ends agree


def test_back_ends_agree_on_a_furnished_room() -> None:
    gl, rays = (opened(name).render(room(), CAMERA, POSE, LIGHTS) for name in ("pyrender", "raycast"))
    assert len(np.unique(rays.ids)) > 30
    assert (rays.ids > 0).all()
    assert (np.abs(gl.depth_m - rays.depth_m) <= 0.002).mean() >= 0.995
    assert (gl.ids == rays.ids).mean() >= 0.995
    difference = np.abs(gl.rgb.astype(int) - rays.rgb)
    assert np.percentile(difference, 99) <= 6
    assert difference.mean() <= 1


# --- windows, moving people, repeatability


def test_a_window_equals_the_same_pixels_of_the_full_image(renderer: Renderer) -> None:
    for meshes in ([person(2.2, 2.0)], room()):
        full = renderer.render(meshes, CAMERA, POSE, LIGHTS)
        for window in (PERSON_WINDOW, Window(0, 0, 1, 1), Window(617, 402, 23, 78)):
            part = renderer.render(meshes, CAMERA, POSE, LIGHTS, window)
            assert part.ids.shape == (window.height, window.width)
            assert same(part, crop(full, window))


def test_what_alone_is_asked_for_is_as_in_the_full_view(renderer: Renderer) -> None:
    for window in (None, PERSON_WINDOW):
        full = renderer.render(room(), CAMERA, POSE, LIGHTS, window)
        shape = renderer.render(room(), CAMERA, POSE, LIGHTS, window, only="shape")
        rgb = renderer.render(room(), CAMERA, POSE, LIGHTS, window, only="rgb")
        assert same(full, View(rgb.rgb, shape.depth_m, shape.ids))


def test_a_moved_person_is_drawn_like_a_new_one(renderer: Renderer) -> None:
    start, target = person(2.2, 2.0), person(2.6, 1.6, lean=0.2)
    before = renderer.render([*room()[:-1], start], CAMERA, POSE, LIGHTS)
    moved = renderer.render([start.moved(target.vertices)], CAMERA, POSE, LIGHTS)
    fresh = renderer.render([target], CAMERA, POSE, LIGHTS)
    assert same(moved, fresh)
    assert not np.array_equal(moved.ids, np.where(before.ids == PERSON_ID, before.ids, 0))


def test_an_id_can_pass_from_one_shape_to_another(renderer: Renderer) -> None:
    ball, cube = ellipsoid(5, (0, 0, 2), (0.5, 0.5, 0.5), (200, 0, 0)), box(5, (-0.5, -0.5, 2), (1, 1, 1), (0, 200, 0))
    views = [renderer.render([m], CAMERA, np.eye(4), LIGHTS) for m in (ball, cube, ball)]
    assert same(views[0], views[2])
    assert (views[1].ids > 0).sum() > (views[0].ids > 0).sum()
    # Meshes that share the other arrays: turned inside out its far side shows, and smooth normals change the shade.
    inside_out = renderer.render([replace(cube, triangles=cube.triangles[:, ::-1])], CAMERA, np.eye(4), LIGHTS)
    assert inside_out.depth_m.max() == pytest.approx(3.0, abs=1e-3)
    assert views[1].depth_m.max() == pytest.approx(2.0, abs=1e-3)
    smooth = renderer.render([replace(cube, smooth=True)], CAMERA, np.eye(4), LIGHTS)
    assert not np.array_equal(smooth.rgb, views[1].rgb)


def test_meshes_dropped_from_gl_memory_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    renderer = opened("pyrender")
    first = renderer.render(room(), CAMERA, POSE, LIGHTS)
    monkeypatch.setattr("hsbench.synth.render.pyrender_backend.MAX_UPLOADED_MESHES", 2)
    for one in shell():
        renderer.render([one], CAMERA, POSE, LIGHTS)
    assert same(first, renderer.render(room(), CAMERA, POSE, LIGHTS))


def test_compositing_a_person_by_depth_equals_drawing_everything(renderer: Renderer) -> None:
    background = renderer.render(room()[:-1], CAMERA, POSE, LIGHTS)
    alone = renderer.render([room()[-1]], CAMERA, POSE, LIGHTS)
    front = (alone.ids > 0) & (alone.depth_m < background.depth_m)
    everything = renderer.render(room(), CAMERA, POSE, LIGHTS)
    assert np.array_equal(np.where(front, alone.ids, background.ids), everything.ids)
    assert np.array_equal(np.where(front, alone.depth_m, background.depth_m), everything.depth_m)
    assert np.array_equal(np.where(front[..., None], alone.rgb, background.rgb), everything.rgb)


def test_other_image_sizes_in_between_change_nothing(renderer: Renderer) -> None:
    first = renderer.render(room(), CAMERA, POSE, LIGHTS)
    for width, height in ((64, 48), (801, 33), (200, 700)):
        small = PinholeCamera(width, height, 150.0, 160.0, width / 2, height / 2)
        view = renderer.render(room(), small, POSE, LIGHTS)
        assert view.rgb.shape == (height, width, 3)
    assert same(first, renderer.render(room(), CAMERA, POSE, LIGHTS))


def coinciding() -> list[Mesh]:
    """The room and, in the very place of its table top, a second one: which of the two is seen must not be chance."""
    return [*room(), box(900, (2.9, 1.7, 0.38), (1.1, 0.65, 0.05), (20, 220, 220), 0.25)]


def test_the_same_bytes_in_another_process(renderer: Renderer) -> None:
    code = (
        "from test_render import *\n"
        f"print(digest(open_renderer({renderer.name!r}).render(coinciding(), CAMERA, POSE, LIGHTS)))"
    )
    mine = digest(renderer.render(coinciding(), CAMERA, POSE, LIGHTS))
    assert mine == digest(renderer.render(coinciding(), CAMERA, POSE, LIGHTS))
    assert in_process(code).stdout.split() == [mine]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_forked_process_is_told_why_opengl_cannot_draw() -> None:
    opened("pyrender")
    code = (
        "import os, sys\nfrom test_render import *\nrenderer = open_renderer('pyrender')\n"
        "if os.fork() == 0:\n"
        "    try: renderer.render(room(), CAMERA, POSE, LIGHTS)\n"
        "    except HsbenchError as error: print(error, flush=True)\n"
        "    os._exit(0)\n"
        "os.wait()"
    )
    assert "spawn" in in_process(code).stdout


def test_nothing_to_draw_is_an_empty_view(renderer: Renderer) -> None:
    view = renderer.render([], CAMERA, POSE, LIGHTS, Window(3, 4, 5, 6))
    assert view.rgb.shape == (6, 5, 3)
    assert (view.rgb.dtype, view.depth_m.dtype, view.ids.dtype) == (np.uint8, np.float32, np.uint16)
    assert max(view.rgb.max(), view.depth_m.max(), view.ids.max()) == 0


def test_a_collected_renderer_leaves_the_back_end_alive() -> None:
    for _ in range(2):
        renderer = opened("pyrender")
        assert (renderer.render([quad(7, 2.0, 0, 0)], CAMERA, np.eye(4), LIGHTS).ids == 7).all()
        del renderer
        gc.collect()


# --- opening, and what is refused


def in_process(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    paths = os.pathsep.join([str(REPOSITORY), str(HERE)])
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": paths, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )


@pytest.mark.parametrize("fault", ["no driver", "broken library", "other platform", "no package"])
def test_without_egl_auto_warns_once_and_casts_rays(fault: str, tmp_path: Path) -> None:
    (tmp_path / "libEGL.so.1").write_text("not a library")
    environment = {
        "no driver": {"__EGL_VENDOR_LIBRARY_DIRS": str(tmp_path / "empty")},
        "broken library": {"LD_LIBRARY_PATH": str(tmp_path)},
        "other platform": {"PYOPENGL_PLATFORM": "osmesa"},
        "no package": {},
    }[fault]
    block = "import sys; sys.modules['pyrender'] = None\n" if fault == "no package" else ""
    code = block + (
        "from hsbench.synth.render import open_renderer\n"
        "print(open_renderer('auto').name)\nprint(open_renderer('auto').name)\n"
        "try: open_renderer('pyrender')\nexcept Exception as error: print(type(error).__name__)"
    )
    done = in_process(code, **environment)
    assert done.stdout.split() == [
        "raycast",
        "raycast",
        "MissingExtraError" if fault == "no package" else "HsbenchError",
    ]
    # Python 3.13 also shows the line of our own code that warned
    warning = [line for line in done.stderr.splitlines() if line.strip() and not line.startswith("  ")]
    assert len(warning) == 1
    assert ("hsbench[gen]" if fault == "no package" else "libegl1 libgl1 libgl1-mesa-dri") in warning[0]


def test_importing_the_package_loads_no_back_end() -> None:
    done = in_process("import sys, hsbench.synth.render\nprint({'pyrender', 'OpenGL', 'embreex'} & set(sys.modules))")
    assert done.stdout.strip() == "set()"


def test_probe_states_whether_egl_starts() -> None:
    facts = probe()
    assert facts["egl"] == ("gl_renderer" in facts) == ("egl_fault" not in facts)
    assert facts["embreex_version"]


def test_wrong_requests_are_refused(renderer: Renderer) -> None:
    one = quad(1, 2.0, 0, 0)
    with pytest.raises(SchemaError, match="more than once"):
        renderer.render([one, quad(1, 3.0, 0, 0)], CAMERA, POSE, LIGHTS)
    for window in (Window(0, 0, 0, 5), Window(-1, 0, 5, 5), Window(636, 0, 5, 5)):
        with pytest.raises(SchemaError, match="outside the image"):
            renderer.render([one], CAMERA, POSE, LIGHTS, window)
    with pytest.raises(HsbenchError, match="'auto', 'pyrender' or 'raycast'"):
        open_renderer("opengl")  # type: ignore[arg-type]


def test_an_invalid_mesh_cannot_be_built() -> None:
    vertices, triangles, colours = np.eye(3), np.array([[0, 1, 2]]), np.zeros((1, 3), np.uint8)
    for arguments, message in (
        ((0, vertices, triangles, colours), "expected 1..65534"),
        ((65535, vertices, triangles, colours), "expected 1..65534"),
        ((1, vertices[:, :2], triangles, colours), "expected .n, 3"),
        ((1, vertices, triangles + 1, colours), "vertex indices 1..3"),
        ((1, vertices, triangles, np.zeros((3, 3), np.uint8)), "per vertex"),
        ((1, vertices, triangles, colours + 0.5), "dtype float64"),
        ((1, vertices + np.inf, triangles, colours), "not finite"),
    ):
        with pytest.raises(SchemaError, match=message):
            Mesh(*arguments)
    original = Mesh(1, vertices, triangles, colours)
    vertices[:] = 5.0
    assert np.array_equal(original.vertices, np.eye(3))
    with pytest.raises(ValueError, match="read-only"):
        original.vertices[0, 0] = 1.0
