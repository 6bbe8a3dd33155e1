"""BVH files: a walk of ours written as one comes back, in any unit, axis and naming; hostile files are refused."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hsbench.errors import DataError, HsbenchError, SchemaError
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.people.body import Body, J
from hsbench.synth.people.bvh import MOST_FRAMES, read_bvh
from hsbench.synth.people.channels import concatenate, pose, standing
from hsbench.synth.people.footfalls import soles
from hsbench.synth.people.motion import walk

FPS = 30
BODY = Body(1.75)
TREE = (  # joint of ours, its parent in the file
    ("spine_base", ""), ("spine_mid", "spine_base"), ("neck", "spine_mid"), ("head", "neck"),
    *((f"{n}_{s}", f"{p}_{s}" if p not in ("spine_base", "spine_mid") else p)
      for s in ("left", "right")
      for n, p in (("shoulder", "spine_mid"), ("elbow", "shoulder"), ("wrist", "elbow"), ("hip", "spine_base"),
                   ("knee", "hip"), ("ankle", "knee"), ("foot", "ankle"))),
)  # fmt: skip
CMU = {
    "spine_base": "Hips", "spine_mid": "Spine", "neck": "Neck", "head": "Head", "shoulder": "Arm", "elbow": "ForeArm",
    "wrist": "Hand", "hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "foot": "ToeBase",
}  # fmt: skip
MIXAMO = {key: f"mixamorig:{name}" for key, name in CMU.items()}
XSENS = {
    "spine_base": "Hips", "spine_mid": "Chest2", "neck": "Neck", "head": "Head", "shoulder": "Shoulder",
    "elbow": "Elbow", "wrist": "Wrist", "hip": "Hip", "knee": "Knee", "ankle": "Ankle", "foot": "Toe",
}  # fmt: skip


def our_walk() -> np.ndarray:
    start = standing(BODY, np.zeros(2), 0.3)
    way = walk(BODY, start, np.array([[0.0, 0.0], [1.5, 0.5], [1.5, 1.5]]), None, 1.1, FPS)
    return pose(BODY, concatenate([start, way]), FPS, None)


def named(joint: str, names: dict[str, str]) -> str:
    base, _, side = joint.rpartition("_") if joint.endswith(("left", "right")) else (joint, "", "")
    prefix, _, bare = names[base].rpartition(":")
    return f"{prefix}{':' if prefix else ''}{side.capitalize()}{bare}"


def written(path: Path, joints: np.ndarray, names: dict[str, str], unit: float = 100.0, up: str = "y") -> Path:
    """A BVH file in which every joint turns its only child's offset, along the file's y, to where the bone points.

    Joints with several children carry these on zero rotations and positions of their own, as some exporters do.
    """
    places = {n: joints[:, J[n]] * unit for n, _ in TREE}
    if up == "y":
        places = {n: np.stack([p[:, 0], p[:, 2], -p[:, 1]], axis=1) for n, p in places.items()}
    lines, columns = ["HIERARCHY"], []
    turned: dict[str, Rotation] = {}

    def write(joint: str, parent: str, depth: int) -> None:
        tab = "\t" * depth
        children = [n for n, p in TREE if p == joint]
        base = turned.get(parent)
        where = places[joint] if not parent else base.inv().apply(places[joint] - places[parent])
        turn = Rotation.random(len(joints), random_state=len(columns))  # any rotation: places are given
        turned[joint] = turn if base is None else base * turn
        offset = " ".join(f"{v:.6f}" for v in where[0])
        lines.append(f"{tab}{'JOINT' if parent else 'ROOT'} {named(joint, names)}\n{tab}{{\n{tab}\tOFFSET {offset}")
        lines.append(f"{tab}\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation")
        columns.append(np.concatenate([where, turn.as_euler("ZXY", degrees=True)], axis=1))
        for child in children:
            write(child, joint, depth + 1)
        if not children:
            lines.append(f"{tab}\tEnd Site\n{tab}\t{{\n{tab}\t\tOFFSET 0 0 0\n{tab}\t}}")
        lines.append(f"{tab}}}")

    write("spine_base", "", 0)
    lines.append(f"MOTION\nFrames: {len(joints)}\nFrame Time: {1 / FPS:.7f}")
    lines += [" ".join(f"{v:.6f}" for v in row) for row in np.concatenate(columns, axis=1)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("names", [CMU, MIXAMO, XSENS], ids=["cmu", "mixamo", "xsens"])
@pytest.mark.parametrize(("unit", "factor"), [("cm", 100.0), ("m", 1.0)])
@pytest.mark.parametrize("up", ["y", "z"])
def test_our_walk_comes_back(tmp_path: Path, names: dict[str, str], unit: str, factor: float, up: str) -> None:
    joints = our_walk()
    clip = read_bvh(written(tmp_path / "walk.bvh", joints, names, factor, up), BODY, unit, up)
    assert clip.fps == pytest.approx(FPS, abs=1e-2)
    rows = [J[n] for n in ("spine_base", "spine_mid", "knee_left", "ankle_right", "foot_left", "elbow_right")]
    assert np.abs(clip.joints[:, rows] - joints[:, rows]).max() < 0.003
    assert np.abs(clip.joints - joints).max() < 0.05  # hands and skull, which the file has no joints for


def test_a_clip_takes_the_bones_of_its_body_and_stands_on_the_floor(tmp_path: Path) -> None:
    path = written(tmp_path / "walk.bvh", our_walk(), CMU)
    for body in (Body(1.58), Body(1.92)):
        joints = read_bvh(path, body, "cm", "y").joints
        rest = pose(body, standing(body, np.zeros(2), 0.0), FPS, None)[0]
        for parent, child in KINECT_V2.bones:
            length = np.linalg.norm(joints[:, child] - joints[:, parent], axis=1)
            assert np.allclose(length, np.linalg.norm(rest[child] - rest[parent]), atol=5e-4)
        assert soles(body, joints)[..., 2].min() == pytest.approx(0.0, abs=1e-3)
        way = np.linalg.norm(joints[-1, 0, :2] - joints[0, 0, :2])
        assert way == pytest.approx(np.hypot(1.5, 1.5) * body.stature_m / BODY.stature_m, rel=0.01)


def test_rotations_turn_children_as_the_format_says(tmp_path: Path) -> None:
    """Root rotated by 90 degrees about z after 90 about x: a child at +y goes to Rz Rx y = z."""
    text = written(tmp_path / "walk.bvh", our_walk()[:1], CMU, up="z").read_text()
    still = read_bvh(tmp_path / "walk.bvh", BODY, "cm", "z").joints[0]
    head, _, values = text.partition("Frame Time:")
    row = values.split()
    turn = Rotation.from_euler("ZXY", [float(v) for v in row[4:7]], degrees=True)
    spun = Rotation.from_euler("z", 90, degrees=True) * turn
    row[4:7] = [f"{v:.6f}" for v in spun.as_euler("ZXY", degrees=True)]
    (tmp_path / "spun.bvh").write_text(f"{head}Frame Time: {' '.join(row)}\n")
    spun_joints = read_bvh(tmp_path / "spun.bvh", BODY, "cm", "z").joints[0]
    want = (still - still[0]) @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    assert np.abs(spun_joints - spun_joints[0] - want).max() < 1e-3


@pytest.mark.parametrize(("unit", "hint"), [("m", "is the unit cm"), ("inch", "expected one of m, cm")])
def test_a_wrong_unit_is_refused(tmp_path: Path, unit: str, hint: str) -> None:
    path = written(tmp_path / "walk.bvh", our_walk()[:2], CMU)
    with pytest.raises(SchemaError, match=hint):
        read_bvh(path, BODY, unit, "y")
    with pytest.raises(SchemaError, match="up is 'x'"):
        read_bvh(path, BODY, "cm", "x")


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda t: "", "no HIERARCHY and MOTION"),
        (lambda t: t[: len(t) // 40], "cut off"),
        (lambda t: t[: int(len(t) * 0.9)].rsplit(" ", 1)[0], "numbers of motion"),
        (lambda t: t.replace("Frames: 3", "Frames: 1000000"), f"1000000 frames; expected 1..{MOST_FRAMES}"),
        (lambda t: t.replace("Frames: 3", "Frames: 400000"), "expected 400000 frames"),
        (lambda t: t.replace("Frames: 3", "Frames: nan"), "finite"),
        (lambda t: t.replace("Frame Time: 0.03", "Frame Time: -0.03"), "frame time"),
        (lambda t: t.rsplit(" ", 1)[0] + " nan", "frame 2 holds NaN"),
        (lambda t: t.rsplit(" ", 1)[0] + " one", "expected numbers"),
        (lambda t: t.replace("OFFSET", "OFSET", 1), "'OFSET' in HIERARCHY"),
        (lambda t: t.replace("Xrotation", "Wrotation", 1), "Wrotation"),
        (lambda t: t.replace("CHANNELS 6", "CHANNELS 999999999", 1), "damaged|stay open"),
        (lambda t: t.replace("LeftForeArm", "Tentacle"), "no joint named like leftforearm"),
        (lambda t: t.replace("}", "", 1), "stay open"),
        (lambda t: t.replace("}", "} }", 40), "damaged|expected"),
    ],
)
def test_damaged_files_are_refused_in_one_line(tmp_path: Path, damage: Callable[[str], str], message: str) -> None:
    path = written(tmp_path / "walk.bvh", our_walk()[:3], CMU)
    path.write_text(damage(path.read_text()))
    with pytest.raises(DataError, match=message) as caught:
        read_bvh(path, BODY, "cm", "y")
    assert "\n" not in str(caught.value)


def test_what_is_no_text_or_not_there_is_refused(tmp_path: Path) -> None:
    (tmp_path / "noise.bvh").write_bytes(bytes(range(256)) * 10)
    for name in ("noise.bvh", "absent.bvh"):
        with pytest.raises(DataError, match="cannot be read as text"):
            read_bvh(tmp_path / name, BODY, "cm", "y")


def test_no_damage_gets_past_as_another_error(tmp_path: Path) -> None:
    text = written(tmp_path / "walk.bvh", our_walk()[:2], CMU).read_text()
    rng = np.random.default_rng(0)
    for _ in range(200):
        start, length = rng.integers(len(text)), rng.integers(1, 60)
        (tmp_path / "cut.bvh").write_text(text[:start] + text[start + length :])
        with contextlib.suppress(HsbenchError):
            assert np.isfinite(read_bvh(tmp_path / "cut.bvh", BODY, "cm", "y").joints).all()
