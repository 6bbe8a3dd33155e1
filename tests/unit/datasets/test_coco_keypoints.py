"""The reader of COCO keypoints against annotations and results written here from the documented format."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers import coco_keypoints
from hsbench.datasets.importers.coco_keypoints import COCO_NAMES, read_annotations, read_images, read_results
from hsbench.datasets.importers.pose_captures import coco_episode, coco_episodes
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError
from hsbench.schema.poses import JointState
from hsbench.schema.skeletons import COCO_17
from tests.unit.datasets.mutations import mutated, refused, refused_or_read

ANY_FILE = settings(deadline=None, max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])


def keypoints(seed: int, flags: tuple[int, ...] = (2,) * 17) -> list[int]:
    """51 numbers of somebody in a picture of 640 x 480."""
    rng = np.random.default_rng(seed)
    xy = np.stack([rng.integers(0, 640, 17), rng.integers(0, 480, 17)], -1) * (np.array(flags) > 0)[:, None]
    return np.concatenate([xy, np.array(flags)[:, None]], axis=1).ravel().tolist()


def item(image_id: int, values: list[int], **more: Any) -> dict[str, Any]:
    return {"image_id": image_id, "category_id": 1, "iscrowd": 0, "keypoints": values, **more}


def annotations(found: list[dict[str, Any]], pictures: int = 3) -> dict[str, Any]:
    """Pictures 10, 11, ... named so that the order of names is the reverse of that of ids."""
    return {
        "images": [
            {"id": 10 + i, "file_name": f"frame_{pictures - i:03d}.jpg", "width": 640, "height": 480}
            for i in range(pictures)
        ],
        "categories": [{"id": 1, "name": "person", "keypoints": list(COCO_NAMES)}],
        "annotations": found,
    }


def write(path: Path, content: Any) -> Path:
    path.write_text(json.dumps(content))
    return path


FLAGS = (0, 1, 2) * 5 + (2, 2)
FOUND = [item(10, keypoints(0)), item(12, keypoints(1, FLAGS)), item(10, keypoints(2)), item(11, keypoints(3))]


def test_names_are_cocos() -> None:
    assert COCO_NAMES[:4] == ("nose", "left_eye", "right_eye", "left_ear")
    assert COCO_NAMES[-1] == "right_ankle"


def test_annotations(tmp_path: Path) -> None:
    found = read_annotations(write(tmp_path / "a.json", annotations(FOUND)))
    assert [image.file_name for image in found.images] == ["frame_001.jpg", "frame_002.jpg", "frame_003.jpg"]
    assert [image.image_id for image in found.images] == [12, 11, 10]
    assert found.image.tolist() == [0, 1, 2, 2]
    assert found.track_id.tolist() == [1, 1, 1, 2]
    for row, seed, flags in ((0, 1, FLAGS), (1, 3, (2,) * 17), (2, 0, (2,) * 17), (3, 2, (2,) * 17)):
        values = np.array(keypoints(seed, flags), dtype=np.float64).reshape(17, 3)
        assert found.state[row].tolist() == list(flags)
        expected = np.where(values[:, 2:] == 0, np.nan, values[:, :2] + 0.5)  # centres of pixels
        np.testing.assert_array_equal(found.joints_px[row], expected.astype(np.float32))


def test_crowds_bare_people_and_other_categories_are_left_out(tmp_path: Path) -> None:
    more = [
        item(10, keypoints(5), iscrowd=1),
        item(10, [0] * 51),
        {"image_id": 10, "category_id": 3},
        {**item(10, keypoints(6)), "keypoints": keypoints(6)},
    ]
    found = read_annotations(write(tmp_path / "a.json", annotations([*more, *FOUND])))
    assert (found.crowds, found.unlabelled, len(found.image)) == (1, 1, 5)


def test_results_belong_to_the_pictures_of_annotations(tmp_path: Path) -> None:
    pictures = write(tmp_path / "a.json", annotations([]))
    values = [v + 0.25 if i % 3 < 2 else v for i, v in enumerate(map(float, keypoints(1)))]
    values[5] = 0.0  # confidence of the left eye
    values[8] = 0.013
    results = [{"image_id": 11, "category_id": 1, "keypoints": values, "score": 0.9}]
    found = read_results(write(tmp_path / "r.json", results), read_images(pictures))
    assert found.image.tolist() == [1]
    assert found.state[0].tolist() == [2, 0] + [2] * 15
    assert found.joints_px[0, 0].tolist() == [values[0] + 0.5, values[1] + 0.5]
    refused(read_annotations, tmp_path / "r.json", "is a list; expected annotations .*--images")
    refused(lambda path: read_results(path, ()), pictures, "is an object; expected a list of results")


def test_a_film_has_an_episode_and_so_has_every_photograph(tmp_path: Path) -> None:
    content = annotations(FOUND, pictures=4)  # the last picture by name shows nobody
    content["images"][3]["file_name"] = "frame_009.jpg"
    found = read_annotations(write(tmp_path / "a.json", content))
    film = coco_episode(found, "film", 10.0)
    assert film.poses.timestamp_ns.tolist() == [0, 100_000_000, 200_000_000, 200_000_000]
    assert film.end_ns == 300_000_000
    photos = coco_episodes(found)
    assert [episode.episode_id for episode in photos] == ["frame_002", "frame_003", "frame_004"]
    assert [len(episode.poses) for episode in photos] == [1, 1, 2]
    assert all(episode.poses.skeleton == COCO_17.name and episode.end_ns == 0 for episode in photos)
    content["images"][0]["width"] = 641
    with pytest.raises(
        DataError, match=r"frame_004\.jpg has 641 x 480 px, frame_002\.jpg 640 x 480; expected pictures of one"
    ):
        coco_episode(read_annotations(write(tmp_path / "b.json", content)), "film", 10.0)


def test_pictures_of_one_name_are_no_episodes(tmp_path: Path) -> None:
    content = annotations(FOUND)
    for number, image in enumerate(content["images"]):
        image["file_name"] = f"{number}/photo.jpg"
    with pytest.raises(DataError, match="'photo' names 3 pictures; expected a name each"):
        coco_episodes(read_annotations(write(tmp_path / "a.json", content)))


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path / "people.json", annotations([*FOUND, item(11, keypoints(5), iscrowd=1)]))
    photos, film = tmp_path / "photos", tmp_path / "film"
    assert run(["import", "coco-keypoints", str(path), "--out", str(photos), "--name", "x"]) == 2
    assert run(["import", "coco-keypoints", str(path), "--out", str(photos)]) == 0
    shown = capsys.readouterr()
    assert "3 episodes of a picture each, 4 poses" in shown.out
    assert "left out 1 crowds and 0 people without a joint" in shown.err
    assert run(["import", "coco-keypoints", str(path), "--out", str(film), "--rate", "2"]) == 0
    assert "episode people, 4 poses of 2 tracks in 1.0 s" in capsys.readouterr().out
    assert load(photos).episode_ids == ("frame_001", "frame_002", "frame_003")
    for out in (photos, film):
        assert verify_files(out) == []
        assert verify_episode(load(out, truth=True)[0]) == []
    assert (load(film)[0].poses.joint_state != JointState.MISSING).sum() == 3 * 17 + sum(f > 0 for f in FLAGS)


# damage


def edited(edit: str) -> Any:
    content = annotations([dict(one) for one in FOUND])
    if edit == "null annotations":
        content["annotations"] = None
    elif edit == "null item":
        content["annotations"][2] = None
    elif edit == "null image":
        content["images"][1] = None
    elif edit == "no images":
        del content["images"]
    elif edit == "nobody":
        content["annotations"] = []
    elif edit == "two ids":
        content["images"][1]["id"] = 10
    elif edit == "no categories":
        content["categories"] = []
    elif edit == "fourteen":
        content["categories"][0]["keypoints"] = list(COCO_NAMES[:14])
    elif edit == "mirrored":
        content["categories"][0]["keypoints"] = [name[::-1] for name in COCO_NAMES]
    elif edit.startswith("image:"):
        key, value = edit[6:].split("=")
        content["images"][1][key] = json.loads(value)
    elif edit.startswith("count="):
        content["annotations"][2]["keypoints"] = [1] * int(edit[6:])
    elif edit.startswith("at"):
        index, value = edit[2:].split("=")
        values = list(content["annotations"][2]["keypoints"])
        values[int(index)] = json.loads(value)
        content["annotations"][2]["keypoints"] = values
    else:
        key, value = edit.split("=")
        content["annotations"][2][key] = json.loads(value)
    return content


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ("null annotations", "annotations is null; expected a list"),
        ("null item", r"annotations\[2\] is null; expected an object"),
        ("null image", r"images\[1\] is null; expected an object"),
        ("no images", "the file has no 'images'"),
        ("nobody", "no person with a joint in 3 pictures; expected somebody"),
        ("two ids", "images have id 10 twice"),
        ("no categories", "categories lack id 1, person"),
        ("fourteen", r"categories\[0\] has 14 joints other than COCO's 17"),
        ("mirrored", r"categories\[0\] has 17 joints other than COCO's 17"),
        ("image:width=0", r"images\[1\].width is 0; expected a whole number of 1 to 65536"),
        ("image:width=1e9", r"images\[1\].width is 1000000000.0"),
        ("image:height=99999999999", r"images\[1\].height is 99999999999"),
        ("image:file_name=null", r"images\[1\].file_name is null; expected a text"),
        ('image:file_name="a\\nb"', r"images\[1\].file_name is 'a\\nb'"),
        ("image:id=-1", r"images\[1\].id is -1"),
        ("image_id=77", r"annotations\[2\].image_id is 77; expected one of the 3 pictures"),
        ("image_id=null", r"annotations\[2\].image_id is null"),
        ("category_id=true", r"annotations\[2\].category_id is True"),
        ("iscrowd=2", r"annotations\[2\].iscrowd is 2; expected a whole number of 0 to 1"),
        ("keypoints=null", r"annotations\[2\].keypoints is null; expected a list"),
        ("count=54", r"annotations\[2\].keypoints has 54 items; expected at most 51"),
        ("count=42", r"annotations\[2\].keypoints has 42 values; expected 51 .another skeleton"),
        ("at3=null", r"keypoints\[3\] is null; expected a number"),
        ("at4=1e300", r"keypoints\[4\] is 1e\+300; expected a number of at most 100000"),
        ("at5=3", r"annotations\[2\]: left_eye has visibility 3; expected 0, 1 or 2"),
        ("at5=0.93", r"left_eye has visibility 0.93; expected 0, 1 or 2 .results"),
    ],
)
def test_damage_is_named(tmp_path: Path, edit: str, message: str) -> None:
    refused(read_annotations, write(tmp_path / "damaged.json", edited(edit)), message)


def test_a_negative_confidence_is_refused(tmp_path: Path) -> None:
    pictures = read_images(write(tmp_path / "a.json", annotations([])))
    results = [item(10, [*keypoints(0)[:-1], -1])]
    refused(
        lambda path: read_results(path, pictures), write(tmp_path / "r.json", results), "right_ankle has a negative"
    )


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b'{"images": [', "no valid JSON .*line 1 column 13"),
        (b'{"images": NaN}', "NaN is no JSON number"),
        (b'{"images": [], "images": []}', "'images' is given twice"),
        ("{}".encode("utf-16"), "not UTF-8 at byte 0"),
        (b"{}", "the file has no 'images'; found nothing"),
        (b"null", "the file is null; expected an object"),
    ],
)
def test_not_such_json(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content)
    refused(read_annotations, path, message)


def test_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "a.json", annotations(FOUND))
    monkeypatch.setattr(coco_keypoints, "MAX_ROWS", 3)
    refused(read_annotations, path, "has 17 items|annotations has 4 items; expected at most 3")
    monkeypatch.setattr(coco_keypoints, "MAX_IMAGES", 2)
    refused(read_annotations, path, "images has 3 items; expected at most 2")
    monkeypatch.setattr(coco_keypoints, "MAX_BYTES", 100)
    refused(read_annotations, path, "more than 100 bytes")


@ANY_FILE
@given(data=st.data())
def test_mutations_are_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    sound = json.dumps(annotations(FOUND[:2], pictures=2 + 1))

    refused_or_read(
        read_annotations,
        tmp_path / "mutated.json",
        data.draw(mutated(sound.encode())),
        lambda found: (coco_episodes(found), coco_episode(found, "film", 1.0)),
    )
