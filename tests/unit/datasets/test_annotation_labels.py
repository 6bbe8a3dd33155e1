"""Labels of a picture: forms of files, polygons, masks, and what is refused."""

from __future__ import annotations

import base64
import copy
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO

from hsbench.cli.main import run
from hsbench.datasets.annotation import polygons, rle
from hsbench.datasets.annotation.label_files import FORMS, of_picture, read_labels, write_labels
from hsbench.datasets.annotation.labels import NAMES, Region, ViewLabels, bits_of, labels_at, read_names
from hsbench.datasets.annotation.plan import PlanRegion, on_picture, plan_truth, read_plan, write_plan
from hsbench.errors import DataError
from hsbench.geometry.cameras import pixel_centres
from hsbench.io.images import encode_png
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.states import Affordance
from tests.unit.datasets.mutations import mutated, refused, refused_or_read

WIDTH, HEIGHT = 24, 16
TRIANGLE = [[2.0, 3.0], [20.5, 4.0], [11.0, 14.25]]
SQUARE = [[1.0, 1.0], [5.0, 1.0], [5.0, 6.0], [1.0, 6.0]]


def labels() -> ViewLabels:
    """Two polygons in one region, one in another, and a mask."""
    mask = np.zeros((HEIGHT, WIDTH), dtype=np.bool_)
    mask[3:9, 5:17] = True
    mask[4, 7] = False
    regions = (
        Region("walkable", (np.array(TRIANGLE), np.array(SQUARE))),
        Region("sittable", (np.array(SQUARE) + 8,)),
        Region("reachable", mask=mask),
    )
    return ViewLabels("000000_rgb.png", WIDTH, HEIGHT, regions)


def picture_of(found: ViewLabels) -> np.ndarray:
    return labels_at(found, bits_of(found, NAMES, "labels"), pixel_centres(found.width_px, found.height_px))


def star(rng: np.random.Generator) -> np.ndarray:
    """A simple polygon of seven corners about the middle of the picture."""
    angle = 2 * np.pi * (np.arange(7) + rng.uniform(0, 0.9, 7)) / 7
    return np.array([12.0, 8.0]) + rng.uniform(2, 7, 7)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def same(a: ViewLabels, b: ViewLabels) -> bool:
    def plain(found: ViewLabels) -> Any:
        return [
            (r.label, [p.tolist() for p in r.polygons_px], None if r.mask is None else r.mask.tolist())
            for r in found.regions
        ]

    head = [(x.file_name, x.width_px, x.height_px) for x in (a, b)]
    return head[0] == head[1] and plain(a) == plain(b)


@pytest.mark.parametrize("form", FORMS[:3])
def test_every_form_reads_back_as_written(form: str, tmp_path: Path) -> None:
    write_labels(tmp_path / "a.json", labels(), form)
    assert same(read_labels(tmp_path / "a.json"), labels())


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**32 - 1), form=st.sampled_from(FORMS[:3]))
def test_any_labels_survive_every_form(seed: int, form: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    regions = []
    for _ in range(rng.integers(1, 5)):
        name = str(rng.choice(["walkable", "seat of a chair", "Stuhl", "\u6905\u5b50"]))
        if rng.random() < 0.4:
            regions.append(Region(name, mask=rng.random((HEIGHT, WIDTH)) < rng.random()))
        else:
            regions.append(Region(name, tuple(star(rng) for _ in range(rng.integers(1, 4)))))
    drawn = ViewLabels("a b.png", WIDTH, HEIGHT, tuple(regions))
    write_labels(tmp_path / "a.json", drawn, form)
    assert same(read_labels(tmp_path / "a.json"), drawn)


def test_a_label_picture_keeps_every_bit(tmp_path: Path) -> None:
    picture = np.arange(256, dtype=np.uint8).reshape(16, 16)
    picture[picture >= VIEW_UNSCORED] = VIEW_UNSCORED  # where nothing is scored no other bit counts
    write_labels(tmp_path / "a.png", of_picture(picture, "a.png"), "png")
    assert (cv2.imread(str(tmp_path / "a.png"), cv2.IMREAD_UNCHANGED) == picture).all()
    assert (picture_of(read_labels(tmp_path / "a.png")) == picture).all()


@settings(max_examples=60)
@given(st.integers(1, 20), st.integers(1, 20), st.integers(0, 2**32 - 1), st.floats(0, 1))
def test_run_lengths_are_those_of_pycocotools(width: int, height: int, seed: int, share: float) -> None:
    mask = np.random.default_rng(seed).random((height, width)) < share
    theirs = coco_mask.encode(np.asfortranarray(mask.astype(np.uint8)))
    text = theirs["counts"].decode()
    assert (rle.decode(text, width, height, "x") == mask).all()
    assert (rle.decode(rle.encode(mask), width, height, "x") == mask).all()
    packed = coco_mask.frPyObjects({"size": [height, width], "counts": rle.encode(mask)}, height, width)
    assert packed["counts"] == theirs["counts"]


CORNERS = st.lists(st.tuples(st.integers(0, 8), st.integers(0, 8)), min_size=3, max_size=9)


@settings(max_examples=300)
@given(CORNERS)
def test_simple_polygons_are_those_of_shapely(corners: list[tuple[int, int]]) -> None:
    ring = [c for k, c in enumerate(corners) if c != corners[k - 1]]
    distinct = len(set(ring)) >= 3
    simple = distinct and shapely.LinearRing(ring).is_simple and shapely.Polygon(ring).area > 0
    try:
        polygons.checked([list(c) for c in corners], "x", (0, 0), (8, 8), "pixels")
        found = True
    except DataError:
        found = False
    assert found == simple


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1))
def test_pixels_of_a_polygon_are_those_whose_middle_it_holds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    outline = star(rng)
    centres = pixel_centres(WIDTH, HEIGHT)
    inside = Region("walkable", (outline,)).holds(centres)
    expected = shapely.contains_xy(shapely.Polygon(outline), centres[..., 0], centres[..., 1])
    assert (inside == expected).all()


def test_bits_join_where_regions_overlap_and_nothing_is_scored_outside() -> None:
    found = labels()
    places = np.array([[6.5, 5.5], [0.5, 0.5], [-0.1, 3.0], [24.0, 3.0], [np.nan, 3.0]])
    bits = labels_at(found, bits_of(found, NAMES, "x"), places)
    walk_and_reach = 1 << Affordance.WALKABLE | 1 << Affordance.REACHABLE
    assert bits.tolist() == [walk_and_reach, 0, VIEW_UNSCORED, VIEW_UNSCORED, VIEW_UNSCORED]


def test_a_region_of_nothing_is_a_hole_in_what_is_below_it() -> None:
    outer, hole = np.array(SQUARE) * 2, np.array(SQUARE) + 2
    regions = (Region("walkable", (outer,)), Region("nothing", (hole,)), Region("sittable", (hole,)))
    found = ViewLabels("a.png", WIDTH, HEIGHT, regions)
    assert labels_at(found, bits_of(found, NAMES, "x"), np.array([[4.5, 4.5], [2.5, 2.5]])).tolist() == [2, 1]
    turned = ViewLabels("a.png", WIDTH, HEIGHT, regions[::-1])
    assert labels_at(turned, bits_of(turned, NAMES, "x"), np.array([[4.5, 4.5], [2.5, 2.5]])).tolist() == [1, 1]


def test_own_names(tmp_path: Path) -> None:
    path = tmp_path / "names.json"
    path.write_text('{"chair seat": ["sittable", "reachable"], "wall": []}')
    names = read_names(path)
    assert names["chair seat"] == 1 << Affordance.SITTABLE | 1 << Affordance.REACHABLE
    assert names["wall"] == 0
    assert names["walkable"] == 1 << Affordance.WALKABLE
    for text, match in (("[]", "no object"), ('{"a": ["flyable"]}', "flyable"), ('{"a": 3}', "expected a list")):
        path.write_text(text)
        refused(read_names, path, match)


def test_rectangles_of_labelme(tmp_path: Path) -> None:
    shape = {"label": "sittable", "shape_type": "rectangle", "points": [[5, 6], [2, 3]]}
    root = {"shapes": [shape], "imagePath": "a.png", "imageWidth": 9, "imageHeight": 8}
    (tmp_path / "a.json").write_text(json.dumps(root))
    expected = np.zeros((8, 9), dtype=np.uint8)
    expected[3:6, 2:5] = 1 << Affordance.SITTABLE
    assert (picture_of(read_labels(tmp_path / "a.json")) == expected).all()


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # pycocotools under numpy 2
def test_pycocotools_reads_what_is_written(tmp_path: Path) -> None:
    write_labels(tmp_path / "a.json", labels(), "coco")
    coco = COCO(str(tmp_path / "a.json"))
    names = {row["id"]: row["name"] for row in coco.loadCats(coco.getCatIds())}
    found = [coco.anns[k] for k in sorted(coco.anns)]
    assert [names[row["category_id"]] for row in found] == ["walkable", "sittable", "reachable"]
    assert (coco.annToMask(found[2]).astype(bool) == labels().regions[2].mask).all()
    square = coco.annToMask(found[1]).astype(bool)
    assert (square == labels().regions[1].holds(pixel_centres(WIDTH, HEIGHT))).all()
    assert [row["area"] for row in found] == [r.holds(pixel_centres(WIDTH, HEIGHT)).sum() for r in labels().regions]


def test_one_of_the_pictures_of_a_coco_file(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    write_labels(path, labels(), "coco")
    root = json.loads(path.read_text())
    root["images"].append({"id": 2, "file_name": "b.png", "width": 4, "height": 4})
    own = {"id": 9, "image_id": 2, "category_id": 1, "segmentation": [[0, 0, 4, 0, 4, 4]], "iscrowd": 0}
    root["annotations"].append(own)
    path.write_text(json.dumps(root))
    assert same(read_labels(path, "000000_rgb.png"), labels())
    assert [p.tolist() for p in read_labels(path, "b.png").regions[0].polygons_px] == [[[0, 0], [4, 0], [4, 4]]]
    refused(read_labels, path, "2 images; expected one")
    refused(lambda p: read_labels(p, "c.png"), path, "0 images 'c.png'")


def _written(tmp_path: Path, form: str) -> dict[str, Any]:
    write_labels(tmp_path / "sound.json", labels(), form)
    return json.loads((tmp_path / "sound.json").read_text())


BOW_TIE = [[1, 1], [9, 9], [9, 1], [1, 9]]
WRONG_POLYGONS = {
    "cross or touch": BOW_TIE,
    "2 corners": [[1, 1], [2, 2]],
    "no area": [[1, 1], [1, 1], [1, 1]],
    "expected a number": [[1, 1], [None, 2], [3, 3]],
    "is a number; expected a list": [1, 2, 3, 4, 5, 6],
    "expected pixels from": [[1, 1], [26, 1], [3, 3]],
    "items; expected at most 4,096": [[1, 1]] * 5000,
    "has 3 items; expected at most 2": [[1, 1, 1], [2, 2, 2], [2, 3, 3]],
}


@pytest.mark.parametrize("match", WRONG_POLYGONS)
def test_wrong_polygons_are_refused_naming_file_and_item(match: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    plain = _written(tmp_path, "plain")
    plain["regions"][1]["polygons_px"][0] = WRONG_POLYGONS[match]
    labelme = _written(tmp_path, "labelme")
    labelme["shapes"][1]["points"] = WRONG_POLYGONS[match]
    for root, item in ((plain, r"regions\[1\].polygons_px\[0\]"), (labelme, r"shapes\[1\] \(walkable\).points")):
        path.write_text(json.dumps(root))
        refused(read_labels, path, f"{item}.*{match}")


def _at(root: Any, *keys: Any) -> Any:
    for key in keys:
        root = root[key]
    return root


WRONG: tuple[tuple[str, tuple[Any, ...], Any, str], ...] = (
    ("plain", ("version",), 2, "version is 2"),
    ("plain", ("image", "width_px"), 0, "image: width_px is 0"),
    ("plain", ("image", "width_px"), 65_000, "add up to|expected at most|polygon"),
    ("plain", ("regions",), [], "no region is labelled"),
    ("plain", ("regions", 0, "label"), None, r"regions\[0\].label is null"),
    ("plain", ("regions", 2, "mask_counts"), [384, 1], r"regions\[2\].mask_counts add up to 385"),
    ("plain", ("regions", 2, "mask_counts"), [-1, 385], r"mask_counts\[0\] is -1"),
    ("plain", ("regions", 2, "mask_counts"), "0]", "expected COCO's run lengths|add up"),
    ("plain", ("regions", 2, "mask_counts"), "oooooooooo", "expected COCO's run lengths"),
    ("plain", ("regions", 1, "polygons_px"), [], r"regions\[1\].polygons_px is empty"),
    ("labelme", ("imageWidth",), None, "imageWidth is null"),
    ("labelme", ("shapes", 0, "shape_type"), "circle", r"shapes\[0\] \(walkable\) is of type 'circle'"),
    ("labelme", ("shapes", 3, "mask"), "!!", "no base64"),
    ("labelme", ("shapes", 3, "mask"), None, "no base64"),
    ("labelme", ("shapes", 3, "mask"), base64.b64encode(b"no png").decode(), "no PNG of 12 x 6"),
    ("labelme", ("shapes", 3, "points"), [[5, 3], [99, 8]], "expected first and last pixel"),
    ("labelme", ("shapes", 0, "group_id"), "one", r"group_id is 'one'"),
    ("coco", ("annotations", 0, "category_id"), 77, r"annotations\[0\].category_id is 77"),
    ("coco", ("annotations", 0, "image_id"), 77, r"annotations\[0\].image_id is 77"),
    ("coco", ("annotations", 0, "segmentation"), [], "a box alone is no region"),
    ("coco", ("annotations", 0, "segmentation"), [[1, 2, 3, 4, 5]], "5 numbers; expected u and v"),
    ("coco", ("annotations", 2, "segmentation", "size"), [24, 16], "size is .* expected"),
    ("coco", ("images", 0, "height"), 10**6, "height is 1000000"),
    ("coco", ("categories",), None, "categories is null"),
)


@pytest.mark.parametrize(("form", "keys", "value", "match"), WRONG)
def test_malformed_files_are_refused(
    form: str, keys: tuple[Any, ...], value: Any, match: str, tmp_path: Path
) -> None:  # fmt: skip
    root = copy.deepcopy(_written(tmp_path, form))
    _at(root, *keys[:-1])[keys[-1]] = value
    path = tmp_path / "a.json"
    path.write_text(json.dumps(root))
    refused(read_labels, path, match)


def test_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    for data, match in ((b"", "is empty"), (b"[]", "is no object"), (b"{}", "expected one"), (b'{"a": NaN}', "NaN")):
        path.write_bytes(data)
        refused(read_labels, path, match)
    path = tmp_path / "a.png"
    for data, match in (
        (b"no png", "no PNG"),
        (encode_png(np.zeros((4, 4), dtype=np.uint8)), "no pixel is labelled"),
        (encode_png(np.ones((4, 4, 3), dtype=np.uint8)), "one 8-bit channel"),
        (encode_png(np.ones((4, 4), dtype=np.uint8))[:-30], "readable"),
    ):
        path.write_bytes(data)
        refused(read_labels, path, match)
    refused(read_labels, tmp_path / "none.json", "cannot be read")


def test_an_unknown_label_is_named_with_its_region() -> None:
    odd = ViewLabels("a", 4, 4, (Region("chair", (np.array(SQUARE),)),))
    with pytest.raises(DataError, match=r"f.json: regions\[0\] has the label 'chair'; expected one of walkable"):
        bits_of(odd, NAMES, "f.json")


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), form=st.sampled_from(FORMS))
def test_damaged_files_are_refused_or_read(data: st.DataObject, form: str, tmp_path: Path) -> None:
    path = tmp_path / ("sound.png" if form == "png" else "sound.json")
    write_labels(path, labels(), form)
    damaged = data.draw(mutated(path.read_bytes()))
    refused_or_read(read_labels, path.with_stem("bad"), damaged, lambda found: bits_of(found, NAMES, "bad"))


def test_converting_keeps_the_regions(tmp_path: Path) -> None:
    first, second, third = tmp_path / "a.json", tmp_path / "b.json", tmp_path / "c.json"
    write_labels(first, labels(), "labelme")
    assert run(["annotate", "convert", str(first), "--to", "coco", "--out", str(second)]) == 0
    assert run(["annotate", "convert", str(second), "--to", "plain", "--out", str(third)]) == 0
    assert same(read_labels(third), labels())
    assert run(["annotate", "convert", str(first), "--to", "plain", "--out", str(third)]) == 2


PLAN = (
    PlanRegion("walkable", (np.array([[-2.0, -1.5], [3.0, -1.5], [3.0, 2.0], [-2.0, 2.0]]),)),
    PlanRegion("sittable", (np.array([[1.0, 1.0], [2.0, 1.0], [2.0, 1.5], [1.0, 1.5]]),)),
    PlanRegion("unscored", (np.array([[5.0, 5.0], [6.4, 5.0], [6.4, 6.4], [5.0, 6.4]]),)),
)


def test_a_plan_in_metres_labels_the_cells_whose_middle_it_holds(tmp_path: Path) -> None:
    write_plan(tmp_path / "plan.json", PLAN)
    truth = plan_truth(read_plan(tmp_path / "plan.json"), NAMES, "plan")
    x, y = np.meshgrid(6.4 - (np.arange(256) + 0.5) * 0.05, 6.4 - (np.arange(256) + 0.5) * 0.05, indexing="ij")
    walk = (x > -2) & (x < 3) & (y > -1.5) & (y < 2)
    sit = (x > 1) & (x < 2) & (y > 1) & (y < 1.5)
    assert (truth.labels == walk * 1 + sit * 2).all()
    assert (truth.ignored == ((x > 5) & (y > 5))).all()
    assert truth.cell_m == 0.05


def test_a_plan_drawn_on_a_picture_is_the_same(tmp_path: Path) -> None:
    small = on_picture(PLAN, "plan.png")
    large = ViewLabels(
        "plan.png", 1024, 1024, tuple(Region(r.label, tuple(4 * p for p in r.polygons_px)) for r in small.regions)
    )
    write_labels(tmp_path / "plan.json", large, "labelme")
    found, expected = (plan_truth(p, NAMES, "x") for p in (read_plan(tmp_path / "plan.json"), small))
    assert (found.labels == expected.labels).all()
    assert (found.ignored == expected.ignored).all()


def test_wrong_plans_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    write_plan(path, PLAN)
    sound = json.loads(path.read_text())
    for keys, value, match in (
        (("version",), 0, "version is 0"),
        (("regions",), [], "regions is empty"),
        (("regions", 1, "polygons_m", 0), [[100, 100], [300, 100], [300, 300]], "expected metres from"),
        (("regions", 1, "polygons_m", 0), BOW_TIE[:2] + [[3, 1], [1, 3]], "cross or touch|expected metres"),
        (("regions", 0, "polygons_m"), [], "expected label and polygons_m"),
        (("regions", 0, "label"), 3, r"regions\[0\].label is 3"),
    ):
        root = copy.deepcopy(sound)
        _at(root, *keys[:-1])[keys[-1]] = value
        path.write_text(json.dumps(root))
        refused(read_plan, path, match)
    write_labels(path, labels(), "plain")
    refused(read_plan, path, "24 x 16 px; expected a square")


def test_convert_takes_names_of_ones_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    square = (np.array([(1.0, 1.0), (5.0, 1.0), (5.0, 5.0), (1.0, 5.0)]),)
    write_labels(tmp_path / "a.json", ViewLabels("a.png", 8, 6, (Region("carpet", square),)), "plain")
    call = ["annotate", "convert", str(tmp_path / "a.json"), "--to", "png", "--out", str(tmp_path / "a.png")]
    assert run(call) == 2
    assert "a.png: regions[0] has the label 'carpet'" in capsys.readouterr().err
    (tmp_path / "names.json").write_text('{"carpet": ["walkable"]}')
    assert run([*call, "--labels", str(tmp_path / "names.json")]) == 0
    bits = cv2.imread(str(tmp_path / "a.png"), cv2.IMREAD_UNCHANGED)
    assert (bits == 1 << Affordance.WALKABLE).sum() == 16
    assert (bits == 0).sum() == 8 * 6 - 16
