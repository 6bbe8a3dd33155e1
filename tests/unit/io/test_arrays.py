"""NPZ files: exact round trips, every fault named, and nothing ever unpickled."""

from __future__ import annotations

import io
import pickle
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hsbench.errors import DataError, SchemaError
from hsbench.io.arrays import ArraySpec, collect_npz, load_npz, npz_bytes, read_npz, write_npz

SPECS = {"a": ArraySpec((2, None), "float32")}
GOOD = np.arange(6, dtype=np.float32).reshape(2, 3)


class Runs:
    """Unpickling this creates a file: the proof that something was unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return (Path.touch, (self.path,))


def npy(array: np.ndarray, **keywords: bool) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, array, **keywords)
    return buffer.getvalue()


def zipped(members: list[tuple[str, bytes]], compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return buffer.getvalue()


def only_fault(data: bytes, max_bytes: int = 10_000) -> str:
    arrays, faults = collect_npz(data, SPECS, max_bytes)
    assert len(faults) == 1, faults
    assert "\n" not in faults[0]
    assert arrays == {}
    return faults[0]


@given(
    hnp.arrays(
        st.sampled_from(["bool", "uint8", "int16", "int64", "float32", "float64"]),
        hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=5),
        elements={"allow_nan": False, "allow_infinity": False},
    )
)
@settings(max_examples=60, deadline=None)
def test_round_trip(array: np.ndarray) -> None:
    for form in (array, np.array(array, order="F")):
        data = npz_bytes({"a": form})
        got = read_npz(data, {"a": ArraySpec(array.shape, array.dtype.name)}, max_bytes=100_000)["a"]
        assert got.dtype == array.dtype
        assert got.shape == array.shape
        assert np.array_equal(got, array)
        assert data == npz_bytes({"a": array})


def test_bytes_depend_on_the_arrays_alone(tmp_path: Path) -> None:
    write_npz(tmp_path / "one.npz", a=GOOD, b=GOOD)
    write_npz(tmp_path / "two.npz", b=GOOD, a=GOOD)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    with np.load(tmp_path / "one.npz", allow_pickle=False) as reference:
        assert np.array_equal(reference["b"], GOOD)
    loaded = load_npz(tmp_path / "one.npz")
    assert list(loaded) == ["a", "b"]
    assert np.array_equal(loaded["a"], GOOD)


def test_what_numpy_writes_is_read_in_either_order(tmp_path: Path) -> None:
    for array in (GOOD, np.asfortranarray(GOOD)):
        np.savez(tmp_path / "x.npz", a=array)
        got = read_npz(tmp_path / "x.npz", SPECS, 10_000)["a"]
        assert np.array_equal(got, GOOD)
        assert got.flags.c_contiguous
        assert got.flags.writeable


def test_pickled_code_never_runs(tmp_path: Path) -> None:
    trap = tmp_path / "it ran"
    objects = np.array([Runs(trap)], dtype=object)
    assert "would need pickle" in only_fault(zipped([("a.npy", npy(objects, allow_pickle=True))]))
    # a bare pickle under the name of an array
    assert "header cannot be read" in only_fault(zipped([("a.npy", pickle.dumps(Runs(trap)))]))
    # a header that hides code where a literal is expected
    header = b"{'descr': __import__('pathlib').Path('%s').touch(), 'fortran_order': False, 'shape': (2, 3)}"
    text = (header % str(trap).encode()).ljust(180) + b"\n"
    fake = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + bytes(24)
    assert "header cannot be read" in only_fault(zipped([("a.npy", fake)]))
    (tmp_path / "p.npz").write_bytes(zipped([("a.npy", npy(objects, allow_pickle=True))]))
    with pytest.raises(DataError, match="would need pickle"):
        load_npz(tmp_path / "p.npz")
    with pytest.raises(SchemaError, match="would need pickle"):
        npz_bytes({"a": objects})
    assert not trap.exists()
    pickle.loads(pickle.dumps(Runs(trap)))  # the trap works
    assert trap.exists()


def test_each_fault_in_one_line() -> None:
    whole = zipped([("a.npy", npy(GOOD))], zipfile.ZIP_STORED)
    assert "array 'a' is missing; found 'b'" in collect_npz(zipped([("b.npy", npy(GOOD))]), SPECS, 10_000)[1][0]
    assert "dtype is float64; expected float32" in only_fault(zipped([("a.npy", npy(GOOD.astype(float)))]))
    assert "shape is (3, 2); expected (2, any)" in only_fault(zipped([("a.npy", npy(GOOD.T.copy()))]))
    assert "not a zip archive" in only_fault(npy(GOOD))
    assert "not a zip archive" in only_fault(b"")
    assert "truncated zip archive" in only_fault(whole[: len(whole) // 2])
    assert "truncated or padded" in only_fault(zipped([("a.npy", npy(GOOD)[:-1])]))
    assert "truncated or padded" in only_fault(zipped([("a.npy", npy(GOOD) + b"x")]))
    assert "holds nan at (1, 2)" in only_fault(zipped([("a.npy", npy(np.where(GOOD == 5, np.nan, GOOD).astype("f4")))]))
    assert "there twice" in only_fault(twice())
    flipped = bytearray(whole)
    flipped[whole.index(GOOD.tobytes()) + 5] ^= 1
    assert "truncated or damaged" in only_fault(bytes(flipped))


@pytest.mark.parametrize("header", [b"{'descr': '''", b"(" * 500, b"{'descr': (", b"{}", b"\xff", b"", b"0" * 5000])
def test_any_text_in_a_header_is_a_fault(header: bytes) -> None:
    text = header.ljust(117) + b"\n"
    for version, length in ((b"\x01\x00", "<H"), (b"\x02\x00", "<I"), (b"\x09\x00", "<H")):
        fake = b"\x93NUMPY" + version + struct.pack(length, len(text)) + text + bytes(24)
        assert "header cannot be read" in only_fault(zipped([("a.npy", fake)]))


def twice() -> bytes:
    with pytest.warns(UserWarning, match="Duplicate name"):
        return zipped([("a.npy", npy(GOOD)), ("a.npy", npy(GOOD))])


def test_infinity_is_let_pass_where_the_spec_says_so() -> None:
    data = npz_bytes({"a": np.full((2, 1), np.inf, np.float32)})
    assert np.isinf(read_npz(data, {"a": ArraySpec((2, 1), "float32", finite=False)}, 10_000)["a"]).all()
    assert "holds inf" in only_fault(data)


def test_size_is_refused_before_it_is_decompressed() -> None:
    bomb = zipped([("a.npy", npy(np.zeros((2, 5_000_000), np.float32)))])
    assert len(bomb) < 50_000
    _, faults = collect_npz(bomb, SPECS, max_bytes=1_000_000)
    assert faults == ["'a.npy': declares 40000128 bytes; the limit for one file is 1000000"]
    several = zipped([(f"{i}.npy", npy(GOOD)) for i in range(9)])
    assert collect_npz(several, SPECS, max_bytes=1000)[1] == ["files declare 1368 bytes together; the limit is 1000"]


def test_a_header_cannot_ask_for_memory_the_file_does_not_fill() -> None:
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 99999999999999)}"
    text = header.ljust(117) + b"\n"
    fake = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + bytes(24)
    assert "truncated or padded" in only_fault(zipped([("a.npy", fake)]))


def test_all_faults_are_listed_and_read_npz_raises_them_together(tmp_path: Path) -> None:
    specs = {"a": ArraySpec((1,), "uint8"), "b": ArraySpec((1,), "uint8"), "c": ArraySpec((1,), "uint8")}
    np.savez(tmp_path / "x.npz", a=np.zeros(2, np.uint8), b=np.zeros(1), d=np.zeros(1), c=np.zeros(1, np.uint8))
    with pytest.raises(DataError) as error:
        read_npz(tmp_path / "x.npz", specs, 10_000)
    lines = str(error.value).splitlines()
    assert len(lines) == 3
    assert all(line.startswith(str(tmp_path / "x.npz")) for line in lines)
    assert list(collect_npz(tmp_path / "x.npz", specs, 10_000)[0]) == ["c"]
    with pytest.raises(DataError, match="No such file"):
        read_npz(tmp_path / "none.npz", specs, 10_000)


@given(st.binary(max_size=300), st.integers(0, 400))
@settings(max_examples=200, deadline=None)
def test_any_damage_is_a_fault_or_the_truth(noise: bytes, at: int) -> None:
    whole = npz_bytes({"a": GOOD})
    damaged = whole[:at] + noise + whole[at + len(noise) :]
    arrays, faults = collect_npz(damaged, SPECS, 10_000)
    assert faults or np.array_equal(arrays["a"], GOOD)
