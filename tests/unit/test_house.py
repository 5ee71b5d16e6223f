"""How the house is built: no file imports itself by way of others, and names are not given twice."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import grimp
import pytest

import fieldrl

ROOT = Path(fieldrl.__file__).parent
ROOMS = ("cli", "sweeps", "tracking", "runs", "parallel")


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    """Every import, those inside functions and those for types included."""
    return grimp.build_graph("fieldrl", "hydra_plugins.fieldrl_sweeps", "pipelines", cache_dir=None)


def circles(graph: grimp.ImportGraph) -> list[list[str]]:
    """For each import that closes a circle of files: the way back from what is imported."""
    found = []
    for module in sorted(graph.modules):
        for imported in graph.find_modules_directly_imported_by(module) - {module}:  # to be found by workers
            chain = graph.find_shortest_chain(imported, module, as_packages=False)
            if chain:
                found.append([module, *chain])
    return found


def test_no_file_imports_itself_by_way_of_others(graph):
    assert circles(graph) == []


def test_a_circle_would_be_seen(graph):
    assert graph.find_shortest_chain("fieldrl.cli.main", "fieldrl.runs.atomic")  # also through functions
    closed = grimp.ImportGraph()
    for name in ("a", "b", "c"):
        closed.add_module(name)
    for importer, imported in (("a", "b"), ("b", "c"), ("c", "a")):
        closed.add_import(importer=importer, imported=imported)
    assert ["a", "b", "c", "a"] in circles(closed)


def test_no_two_files_share_a_name():
    names = Counter(path.name for path in ROOT.rglob("*.py") if path.name != "__init__.py")
    ours = {path.name for room in ROOMS for path in (ROOT / room).glob("*.py")}
    assert {name for name, count in names.items() if count > 1} & ours == set()


COMPOSED = {
    "pde/double_gyre": "fieldrl.pde.advection_diffusion",
    "pde/reduced_double_gyre": "fieldrl.pde.reduced",
    "agent/informed_sarsa_lambda": "fieldrl.agent.sarsa_lambda",
    "agent/true_online_sarsa_lambda": "fieldrl.agent.sarsa_lambda",
}
"""Options that are no part of their own: a world with chosen flow and features, an agent's settings."""


@pytest.mark.parametrize(
    "option", sorted((ROOT.parent / "conf").glob("*/*.yaml")), ids=lambda path: path.stem
)
def test_an_option_of_a_group_is_a_file_of_its_room(option):
    group, name = option.parent.name, option.stem
    if group == "experiment":  # choices among the options
        return
    module = COMPOSED.get(f"{group}/{name}", f"fieldrl.{group}.{name}")
    assert (ROOT.parent / module.replace(".", "/")).with_suffix(".py").exists()
    targets = [line for line in option.read_text().splitlines() if line.startswith("_target_: ")]
    assert [line.rpartition(".")[0] for line in targets] == [f"_target_: {module}"]


PLACES = [
    found.partition(": ")
    for found in re.findall(
        r"`([\w/]+\.py(?:: \w+)?)`", (ROOT.parent / "docs" / "architecture.md").read_text()
    )
    if "NAME" not in found
]


def test_the_architecture_names_files_and_functions_that_there_are():
    assert len(PLACES) > 40
    for place, _, name in PLACES:
        files = [folder / place for folder in (ROOT, ROOT.parent) if (folder / place).exists()]
        files = files or [path for path in ROOT.rglob(Path(place).name) if str(path).endswith(place)]
        assert files, place
        defined = re.compile(rf"^ *(?:def |class )?{name}\b", re.MULTILINE)
        assert not name or any(defined.search(path.read_text()) for path in files), f"{place}: {name}"
