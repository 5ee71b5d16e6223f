import multiprocessing
import os
import pickle
from dataclasses import dataclass

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.pde.solutions import Solutions, key


@dataclass(frozen=True)
class Part:
    size: float = 1.0


@dataclass(frozen=True)
class Other:
    size: float = 1.0


def counted(value, size=100):
    """A solve, and how often it was asked for."""
    calls = []

    def compute():
        calls.append(1)
        return np.full(size, float(value))

    return compute, calls


def test_a_solve_is_computed_once():
    store, (compute, calls) = Solutions(), counted(3)
    first, second = store.get("a", compute), store.get("a", compute)
    assert len(calls) == store.solves == 1
    np.testing.assert_array_equal(first, second)


def test_what_is_kept_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        Solutions().get("a", counted(3)[0])[0] = 1


def test_memory_stays_under_its_limit_and_the_least_used_go_first():
    store = Solutions(memory=3 * 800 / 2**20)
    for name in "abc":
        store.get(name, counted(1)[0])
    store.get("a", counted(1)[0])
    store.get("d", counted(1)[0])
    again = {name: counted(1) for name in "adb"}
    for name, (compute, _) in again.items():
        store.get(name, compute)
    assert [len(calls) for _, calls in again.values()] == [0, 0, 1]
    assert store.size <= 3 * 800


def test_a_store_without_memory_still_computes():
    store, (compute, calls) = Solutions(memory=0.0), counted(3)
    np.testing.assert_array_equal(store.get("a", compute), store.get("a", compute))
    assert len(calls) == 2


def test_disk_serves_another_store_bit_for_bit(tmp_path):
    values = np.random.default_rng(1).normal(size=(3, 4, 5))
    Solutions(directory=str(tmp_path)).get("a", lambda: values)
    store, (compute, calls) = Solutions(directory=str(tmp_path)), counted(3)
    assert store.get("a", compute).tobytes() == values.tobytes()
    assert not calls
    assert store.solves == 0


@pytest.mark.parametrize(
    "damage", [lambda d: d[:-1], lambda d: b"", lambda d: d[:20] + b"x" + d[21:], lambda d: b"x" * 9]
)
def test_damaged_entry_is_computed_again(tmp_path, damage):
    Solutions(directory=str(tmp_path)).get("a", counted(3)[0])
    (entry,) = tmp_path.iterdir()
    entry.write_bytes(damage(entry.read_bytes()))
    store, (compute, calls) = Solutions(directory=str(tmp_path)), counted(3)
    assert store.get("a", compute)[0] == 3.0
    assert len(calls) == 1
    assert Solutions(directory=str(tmp_path)).get("a", counted(4)[0])[0] == 3.0


def test_disk_stays_under_its_limit_and_drops_the_oldest(tmp_path):
    store = Solutions(directory=str(tmp_path), disk=3 * 1000 / 2**20)
    for age, name in enumerate("abcdef"):
        store.get(name, counted(1)[0])
        os.utime(tmp_path / f"{name}.solution", (age, age))
    assert sum(entry.stat().st_size for entry in tmp_path.iterdir()) <= 3000
    assert {entry.stem for entry in tmp_path.iterdir()} == {"d", "e", "f"}


def test_unusable_folder_only_warns(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.warns(UserWarning, match="not kept"):
        assert Solutions(directory=str(tmp_path / "file")).get("a", counted(3)[0])[0] == 3.0


def _write_and_check(folder):
    store = Solutions(directory=folder, memory=0.0, disk=0.1)
    return all(
        (store.get(f"{k}", lambda k=k: np.full(1000, float(k))) == k).all()
        for _ in range(20)
        for k in range(30)
    )


def test_several_processes_share_a_folder(tmp_path):
    with multiprocessing.get_context("spawn").Pool(3) as pool:
        assert all(pool.map(_write_and_check, [str(tmp_path)] * 6))
    assert not list(tmp_path.glob("*.part"))


def test_pickled_store_keeps_settings_and_forgets_contents():
    store = Solutions(memory=7.0)
    store.get("a", counted(3)[0])
    copy = pickle.loads(pickle.dumps(store))
    assert copy == store
    assert copy.size == copy.solves == 0


def test_keys_tell_everything_apart():
    parts = [
        (Part(),), (Part(2.0),), (Other(),), (1.0,), (1,), ("1.0",), (True,), (None,),
        ((1.0, 2.0),), ((1.0,), 2.0),
        (np.array([1.0, 2.0]),), (np.array([1, 2]),), (np.array([[1.0, 2.0]]),), (Part((1.0,)),), (b"1.0",),
    ]  # fmt: skip
    assert len({key(*part) for part in parts}) == len(parts)


def test_equal_parts_have_equal_keys():
    assert key(Part(1.5), np.arange(3), (1, "x")) == key(Part(1.5), np.arange(3), (1, "x"))


def test_what_cannot_be_described_is_never_taken_for_something_else():
    assert key(lambda x: x) != key(lambda x: x)


@pytest.mark.parametrize("bad", [{"memory": -1}, {"disk": "much"}, {"directory": 3}])
def test_impossible_settings_are_refused(bad):
    with pytest.raises(InvalidValue, match=next(iter(bad))):
        Solutions(**bad)
