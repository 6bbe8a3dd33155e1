"""What a submission looks like on disk, and the little it needs to know of a task.

A folder or a zip of it::

    submission.json
    predictions/<episode_id>.npz            the answer after the whole observation
    predictions/<episode_id>@<seconds>s.npz the answer after the first seconds (optional, one per observation time)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from hsbench.io.arrays import ArraySpec
from hsbench.schema.episode import Episode
from hsbench.typing import AnyArray

METADATA_FILE = "submission.json"
PREDICTIONS_FOLDER = "predictions"

HEADER_BYTES = 65536
MISTAKE_BYTES = 32 << 20  # the largest grid of labels as eight-byte numbers
MISTAKE_FACTOR = 64  # a bit a voxel against eight bytes: an unpacked grid of doubles


@dataclass(frozen=True)
class PredictionFormat:
    """The file of one prediction: its suffix, its arrays by name, and the two ways between them and the plain object.

    encode: what a method returns for one episode -> the arrays of the file; raises SchemaError where it does not fit.
    decode: the inverse. faults: what is wrong with the values of arrays that have the right dtypes and shapes, a line
    each. misfits: likewise, with what does not fit the inputs of the episode; None where they do not matter.
    """

    suffix: str
    arrays: Mapping[str, ArraySpec]
    encode: Callable[[Any], dict[str, AnyArray]] = field(compare=False)
    decode: Callable[[Mapping[str, AnyArray]], Any] = field(compare=False)
    hint: str = ""
    faults: Callable[[Mapping[str, AnyArray]], list[str]] = field(default=lambda arrays: [], compare=False)
    misfits: Callable[[Mapping[str, AnyArray], Episode], list[str]] | None = field(default=None, compare=False)

    @property
    def max_bytes(self) -> int:
        """Decompressed bytes a file may have.

        More than its arrays need: an honest mistake (floats, an unpacked grid) must get as far as the check of dtype
        and shape, which looks at headers alone and says what is wrong.
        """
        right = sum(spec.max_bytes for spec in self.arrays.values())
        return HEADER_BYTES + max(right, min(MISTAKE_FACTOR * right, MISTAKE_BYTES))


class SubmittedTask(Protocol):
    """A task as submissions see it; ``hsbench.tasks.TaskSpec`` is one."""

    @property
    def name(self) -> str:
        """As ``submission.json`` names it."""
        ...

    @property
    def version(self) -> str:
        """As ``submission.json`` names it."""
        ...

    @property
    def tracks(self) -> tuple[str, ...]:
        """What a submission may say it used."""
        ...

    @property
    def prediction(self) -> PredictionFormat:
        """The file of one episode."""
        ...

    @property
    def observation_times_s(self) -> tuple[float, ...]:
        """Ascending seconds after t0 at which a prediction may be given; the last is the whole observation.

        Empty where it is given for the whole alone.
        """
        ...


def prediction_file(task: SubmittedTask, episode_id: str, until_s: float | None = None) -> str:
    """Relative posix path of a prediction; the last observation time is the whole observation."""
    whole = until_s is None or until_s in task.observation_times_s[-1:]
    moment = "" if whole else f"@{until_s:g}s"
    return f"{PREDICTIONS_FOLDER}/{episode_id}{moment}{task.prediction.suffix}"
