"""Configuration: what is refused, what is built, and that every option of every group can be built."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from fieldrl.cli.compose import plain, unresolved
from fieldrl.core import checks
from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.runs import components, configuration, options


@dataclass(frozen=True)
class Inner:
    size: int = 1

    def __post_init__(self) -> None:
        checks.integer("size", self.size, 1)


@dataclass(frozen=True)
class Outer:
    needed: float
    inner: Inner = field(default_factory=Inner)
    many: tuple = ()


@pytest.fixture(autouse=True)
def these_tests_are_trusted(monkeypatch):
    monkeypatch.setenv("FIELDRL_PACKAGES", __name__.partition(".")[0])


OUTER, INNER = f"{__name__}.Outer", f"{__name__}.Inner"


def test_components_are_built_from_the_inside_out():
    node = {
        "_target_": OUTER,
        "needed": 2.0,
        "inner": {"_target_": INNER, "size": 3},
        "many": [{"_target_": INNER}],
    }
    assert components.build(node, "outer") == Outer(2.0, Inner(3), [Inner()])  # type: ignore[arg-type]


def test_a_refused_value_is_named_by_its_whole_path():
    node = {"_target_": OUTER, "needed": 2.0, "many": [{"_target_": INNER}, {"_target_": INNER, "size": 0}]}
    with pytest.raises(InvalidValue, match=r"outer\.many\.1\.size=0: must be >= 1"):
        components.build(node, "outer")


def test_an_unknown_key_is_answered_with_the_nearest():
    with pytest.raises(InvalidValue, match=r"outer\.neded=1: unknown key; did you mean needed\?"):
        components.build({"_target_": OUTER, "neded": 1}, "outer")


def test_a_needed_key_that_is_missing_is_named():
    with pytest.raises(FieldrlError, match=r"outer\.needed: is missing"):
        components.build({"_target_": OUTER}, "outer")


def test_a_key_that_yaml_does_not_read_as_text_is_named():
    with pytest.raises(FieldrlError, match="the key true must be written in quotes"):
        components.build({"_target_": OUTER, True: 1}, "outer")


def composed(*overrides: str) -> dict:
    return plain(unresolved(overrides))


NEEDED = {("parallel", "dask"): ["parallel.address=tcp://host:8786"]}  # what an option cannot do without
OPTIONS = [
    (group, option) for group in (*configuration.GROUPS, "experiment") for option in options.options(group)
]


@pytest.mark.parametrize(("group", "option"), OPTIONS, ids=[f"{group}={option}" for group, option in OPTIONS])
def test_every_option_of_every_group_composes_and_is_built(group, option):
    given = NEEDED.get((group, option), [])
    found = composed(f"{group}={option}", *given)
    configuration.check(found)
    if group in configuration.GROUPS:
        components.build(found[group], group)
    else:
        components.mission(found)


def test_every_yaml_file_says_at_its_top_what_it_is():
    for path in options.directory().rglob("*.yaml"):
        assert path.read_text().startswith("#"), path


def test_an_experiment_opens_with_its_command_line():
    for option in options.options("experiment"):
        text = (options.directory() / "experiment" / f"{option}.yaml").read_text()
        assert f"fieldrl experiment={option}" in "".join(text.splitlines(keepends=True)[:6])
