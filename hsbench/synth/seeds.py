"""Named, counter-based random generators: the stream of a name depends on the name alone, not on order or workers."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Seeds:
    """A node in a tree of random streams: (seed, path of names). Seed 0 is a seed like any other.

    ``Seeds(0).child("rgbd-activity").child(12).rng("layout")`` is the same stream on every machine.
    """

    seed: int
    path: tuple[str, ...] = ()

    def child(self, name: str | int) -> Seeds:
        """The node one name deeper."""
        return Seeds(self.seed, (*self.path, str(name)))

    def rng(self, name: str | int) -> np.random.Generator:
        """A generator for one purpose: Philox keyed by a 128-bit hash of seed, path and name."""
        text = "\x1f".join((str(self.seed), *self.path, str(name)))
        key = int.from_bytes(hashlib.blake2b(text.encode(), digest_size=16).digest(), "little")
        return np.random.Generator(np.random.Philox(key=key))
