"""Down-sampling of labelled voxels by the rule of SSCNet, which its data and its evaluation share.

Per block of factor x factor x factor voxels (``downSample.m``, github.com/shurans/sscnet; factor 4 gives the
benchmark's 60 x 36 x 60 voxels of 0.08 m from 240 x 144 x 240 of 0.02 m):

- more than 95 % of its voxels are empty (0) or unlabelled (255): the more frequent of these two, ``tie`` on a tie;
- else the most frequent label of 1..254, the smallest on a tie; 0 and 255 do not vote.

Ties of empty and unlabelled: the MATLAB source gives 0, the smaller value. Python ports (waterljwant/SSC, LMSCNet,
MonoScene) give 255, which takes voxels along the room's boundary out of an evaluation that ignores 255.
"""

from __future__ import annotations

import numpy as np

from hsbench.errors import SchemaError
from hsbench.typing import AnyArray, UInt8Array

EMPTY, UNLABELLED = 0, 255
EMPTY_FRACTION = 0.95


def downsample_labels(labels: AnyArray, factor: int = 4, *, tie: int = EMPTY) -> UInt8Array:
    """(X, Y, Z) uint8 labels -> (X/factor, Y/factor, Z/factor) uint8, by the rule in this module's docstring.

    tie: 0 as SSCNet, 255 as its Python ports. Raises SchemaError if the shape is not a multiple of the factor.
    """
    if factor < 1 or labels.ndim != 3 or any(side % factor for side in labels.shape):
        raise SchemaError(f"labels have shape {labels.shape}; expected three multiples of the factor {factor}")
    if labels.dtype != np.uint8:
        raise SchemaError(f"labels have dtype {labels.dtype}; expected uint8: 0 empty, 255 unlabelled")
    if tie not in (EMPTY, UNLABELLED):
        raise SchemaError(f"tie is {tie}; expected 0 (SSCNet) or 255 (its Python ports)")
    nx, ny, nz = (side // factor for side in labels.shape)
    blocks = labels.reshape(nx, factor, ny, factor, nz, factor).transpose(0, 2, 4, 1, 3, 5).reshape(-1, factor**3)
    empty, unlabelled = (blocks == EMPTY).sum(axis=1), (blocks == UNLABELLED).sum(axis=1)
    result = np.where(empty > unlabelled, EMPTY, UNLABELLED).astype(np.uint8)
    result[empty == unlabelled] = tie
    voting = np.flatnonzero(empty + unlabelled <= EMPTY_FRACTION * factor**3)
    best = np.zeros(len(voting), dtype=np.int64)
    for label in np.unique(blocks[voting]):
        if label not in (EMPTY, UNLABELLED):
            votes = (blocks[voting] == label).sum(axis=1)
            # Strictly more: labels ascend, so the smallest keeps a tie.
            result[voting[votes > best]] = label
            best = np.maximum(best, votes)
    return result.reshape(nx, ny, nz)
