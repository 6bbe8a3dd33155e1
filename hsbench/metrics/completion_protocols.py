"""Other benchmarks' protocols for scene completion (SC) and semantic scene completion (SSC), each as its scorer does.

Labels: 0 empty, 1..n-1 classes, 255 unlabelled. A voxel is solid where its label is not 0 (and not 255).

| protocol | voxels | truth 255 | SC: P, R, IoU | SSC: IoU of classes 1.. | class without truth |
|---|---|---|---|---|---|
| ``sscnet`` | SC: occluded. SSC: surface, occluded | empty, evaluated | a scene, then mean | pooled | spoils the mean |
| ``aicnet`` | surface, occluded | left out | a scene, then mean | a scene that has it, then mean | skipped a scene |
| ``3dsketch`` | SC: occluded. SSC: surface, occluded | left out | pooled | pooled | skipped if not predicted |
| ``monoscene`` | all | left out | pooled | pooled, + 1e-5 below | 0 |
| ``semantic-kitti`` | all but invalid | left out | pooled, + 1.2e-7 below | pooled, + 1e-15 below | 0 |

States. The scorers read their own encodings of what the camera saw; functions below turn them into ``VoxelState``:
``states_from_sscnet`` (``vol``, the flipped TSDF), ``states_from_tsdf`` (aicnet), ``states_from_sketch`` and
``states_from_invalid`` (semantic-kitti). With these the voxels are exactly those of the source. States of hsbench's own
truth differ from them near surfaces: SSCNet's surface band reaches its truncation distance, 0.24 m, to the front,
hsbench's half a voxel diagonal to either side. ``monoscene`` and ``semantic-kitti`` leave out UNKNOWN and OUTSIDE_ROOM.

Values without a denominator, as in the source; where it gives NaN the value is None and counted:

- ``sscnet``: precision and recall of a scene are 0 (precision also where TP = 0), its IoU is NaN and spoils the mean;
- ``aicnet``: 0 for all three; a class that no scene has is 0 in the table of classes and left out of the mean;
- ``3dsketch``: NaN. ``monoscene``: all three 0 where TP = 0. ``semantic-kitti``: P and R 0, IoU NaN.

Names. ``aicnet`` serves DDRNet, AICNet, GRFNet and PALNet, ``3dsketch`` all that build on TorchSSC, ``monoscene``
VoxFormer too.

Size of the differences
-----------------------
* On NYU v2 the voxels alone move the IoU of 3DSketch from 71.3 to 49.5 between its own mask and all voxels.
* ``sscnet`` counts predictions in unlabelled space as false: lower precision than all others on the same voxels.
* What is added below the fraction keeps truth as prediction under 1: a class of 100 voxels by 1e-7 in ``monoscene``,
  precision and recall of 100 voxels by 1e-9 in ``semantic-kitti``.
* ``aicnet`` takes one scene a batch. The source averages batches of four: scenes of a last, smaller batch weigh more.
  Its main.py hands one array to both functions and the first overwrites 255 by 0, so that SSC then evaluates unlabelled
  surface voxels as empty: lower (.499 for .519 on our test scenes). Here they are left out, as the functions say.

Verification: ``Protocol.verified_by``. All five were checked against the answers of the scorers themselves, run on the
scenes of ``tests/reference/completion_inputs.py``, and against loops written from this table alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics.tables import Counts
from hsbench.schema.states import VoxelState
from hsbench.typing import AnyArray, BoolArray, UInt8Array

EMPTY, UNLABELLED = 0, 255
SKETCH_NO_PIXEL = 640 * 480
"""Value of 3DSketch's ``mapping`` where no depth pixel falls into the voxel."""

MONOSCENE_EPSILON = 1e-5
KITTI_EPSILON = float(np.finfo(np.float32).eps)
KITTI_CLASS_EPSILON = 1e-15

_OCCLUDED = frozenset({VoxelState.OCCLUDED})
_UNSEEN_OR_SURFACE = frozenset({VoxelState.SURFACE, VoxelState.OCCLUDED})
_KNOWN = frozenset(VoxelState) - {VoxelState.UNKNOWN, VoxelState.OUTSIDE_ROOM}

Ratios = tuple[float | None, float | None, float | None]
"""Precision, recall, IoU."""


@dataclass(frozen=True)
class Protocol:
    """Which voxels a benchmark evaluates and how it averages.

    sc_states, ssc_states: states that count in completion and in semantic completion. unlabelled: what truth 255 is.
    needs_state: whether truth alone does not tell the voxels. verified_by: what our numbers were compared with.
    """

    name: str
    source: str
    sc_states: frozenset[VoxelState]
    ssc_states: frozenset[VoxelState]
    unlabelled: Literal["empty", "ignored"]
    average: Literal["scenes", "pooled"]
    needs_state: bool
    verified_by: str | None


_RUN = "the scorer's own answers, tests/reference/completion_scorers.json"

FOREIGN: Mapping[str, Protocol] = {
    p.name: p
    for p in (
        Protocol(
            "sscnet", "Song et al., CVPR 2017; evaluation_script.m", _OCCLUDED, _UNSEEN_OR_SURFACE,
            "empty", "scenes", True, f"{_RUN} (GNU Octave)",
        ),
        Protocol(
            "aicnet", "Li et al., CVPR 2020; github.com/waterljwant/SSC", _UNSEEN_OR_SURFACE, _UNSEEN_OR_SURFACE,
            "ignored", "scenes", True, _RUN,
        ),
        Protocol(
            "3dsketch", "Chen et al., CVPR 2020; github.com/charlesCXK/TorchSSC", _OCCLUDED, _UNSEEN_OR_SURFACE,
            "ignored", "pooled", True, _RUN,
        ),
        Protocol(
            "monoscene", "Cao and de Charette, CVPR 2022", _KNOWN, _KNOWN,
            "ignored", "pooled", False, f"{_RUN}; a stored SSCNet prediction",
        ),
        Protocol(
            "semantic-kitti", "Behley et al., ICCV 2019; evaluate_completion.py", _KNOWN, _KNOWN,
            "ignored", "pooled", True, _RUN,
        ),
    )
}  # fmt: skip
"""Protocols by name; the table in the module's docstring."""


def ratios(protocol: str, counts: Counts) -> Ratios:
    """Precision, recall and IoU of one table by the protocol's own rule; hsbench's rule for any other name."""
    plain = (counts.precision, counts.recall, counts.iou)
    if protocol == "sscnet":
        return (plain[0] if counts.tp else 0.0, plain[1] or 0.0, plain[2])
    if protocol == "aicnet":
        return (plain[0] or 0.0, plain[1] or 0.0, plain[2] or 0.0) if counts.total else (None, None, None)
    if protocol == "monoscene":
        return plain if counts.tp else (0.0, 0.0, 0.0)
    if protocol == "semantic-kitti":
        precision, recall = (counts.tp / (counts.tp + wrong + KITTI_EPSILON) for wrong in (counts.fp, counts.fn))
        return precision, recall, plain[2]
    return plain


def evaluated(
    protocol: Protocol, truth: AnyArray, state: UInt8Array | None, ignored: BoolArray | None, *, semantic: bool
) -> tuple[AnyArray, BoolArray]:
    """Truth with unlabelled voxels as the protocol takes them, and the mask of voxels that count.

    truth: (nx, ny, nz) labels or bool. state: its ``VoxelState`` or None. ignored: further unlabelled voxels.
    """
    unlabelled = np.zeros(truth.shape, dtype=bool) if truth.dtype == np.bool_ else truth == UNLABELLED
    if ignored is not None:
        unlabelled = unlabelled | ignored
    mask = np.ones(truth.shape, dtype=bool)
    if state is not None:
        mask[:] = False
        for member in protocol.ssc_states if semantic else protocol.sc_states:
            mask |= state == int(member)
    if protocol.unlabelled == "ignored":
        return truth, mask & ~unlabelled
    return np.where(unlabelled, truth.dtype.type(EMPTY), truth), mask


def states_from_sscnet(vol: AnyArray) -> UInt8Array:
    """SSCNet's ``vol`` -> uint8 ``VoxelState`` of the same shape.

    -1 <= vol < 0 occluded, 0 <= vol < 1 surface, 1 free, -2 missing depth, -3 outside the field of view, -4 outside the
    room, -5 above the ceiling (outside the room too). Raises SchemaError for any other value.
    """
    values = _finite(vol, "vol")
    state = np.full(values.shape, 255, dtype=np.uint8)
    state[(values >= -1) & (values < 0)] = VoxelState.OCCLUDED
    state[(values >= 0) & (values < 1)] = VoxelState.SURFACE
    codes = {
        1: VoxelState.FREE, -2: VoxelState.MISSING_DEPTH, -3: VoxelState.OUTSIDE_FOV,
        -4: VoxelState.OUTSIDE_ROOM, -5: VoxelState.OUTSIDE_ROOM,
    }  # fmt: skip
    for code, member in codes.items():
        state[values == code] = member
    if (state == 255).any():
        found = values[state == 255][0]
        raise SchemaError(f"vol holds {found}; expected -1..1 or -2, -3, -4, -5 (a TSDF in metres, or averaged codes?)")
    return state


def states_from_tsdf(tsdf: AnyArray) -> UInt8Array:
    """The TSDF of waterljwant/SSC -> uint8 ``VoxelState``: 1 surface, below 0.001 occluded, anything else free."""
    values = _finite(tsdf, "tsdf").astype(np.float32)  # the limit is a float32 in the source
    state = np.where(values >= np.float32(0.001), VoxelState.FREE, VoxelState.OCCLUDED).astype(np.uint8)
    state[values == 1] = VoxelState.SURFACE
    return state


def states_from_sketch(label_weight: AnyArray, mapping: AnyArray) -> UInt8Array:
    """3DSketch's ``label_weight`` and ``mapping``, of one shape -> uint8 ``VoxelState``.

    Voxels of weight > 0 are occluded where no depth pixel falls into them, else surface; others are free (left out).
    """
    weights = _finite(label_weight, "label_weight")
    if np.shape(mapping) != weights.shape:
        raise SchemaError(f"mapping has shape {np.shape(mapping)}; expected {weights.shape} as label_weight")
    behind = np.where(np.asarray(mapping) == SKETCH_NO_PIXEL, VoxelState.OCCLUDED, VoxelState.SURFACE)
    return np.where(weights > 0, behind, VoxelState.FREE).astype(np.uint8)


def states_from_invalid(invalid: AnyArray) -> UInt8Array:
    """Semantic-kitti's unpacked ``.invalid`` -> uint8 ``VoxelState``: UNKNOWN where 1, else free (evaluated)."""
    flags = np.asarray(invalid)
    if flags.dtype.kind not in "bui" or (flags.size and int(flags.max()) > 1):
        raise SchemaError(f"invalid is {flags.dtype}; expected 0 or 1 a voxel (packed bits? unpack them first)")
    return np.where(flags == 1, VoxelState.UNKNOWN, VoxelState.FREE).astype(np.uint8)


def _finite(array: AnyArray, name: str) -> AnyArray:
    values = np.asarray(array)
    if values.dtype.kind not in "fui" or not np.isfinite(values).all():
        raise SchemaError(f"{name} is {values.dtype} or holds NaN or infinity; expected finite numbers")
    return values
