"""The text of ``fieldrl --help``, made from the files in conf/ without importing Hydra."""

from __future__ import annotations

from fieldrl.runs.options import directory, options

VERBS: dict[str, tuple[str, str]] = {
    "list": ("list", "finished and unfinished runs"),
    "show": ("show RUN ...", "the result of finished runs"),
    "report": ("report RUN ...", "a page about a run, several runs, or a sweep"),
    "clean": ("clean [RUN ...]", "remove unfinished runs, or those named; asks first"),
    "estimate": ("estimate FILE experiment=NAME [KEY=VALUE ...]", "fit the unknowns to samples in a file"),
    "suggest": (
        "suggest FILE experiment=NAME [KEY=VALUE ...]",
        "where to sample next, after such an estimate",
    ),
}
"""How each verb is used, and what it does: what follows ``fieldrl`` of its line in the help."""

_TEXT = """\
fieldrl: estimate drifting fields from the few samples that a learning vehicle chooses to take

usage: fieldrl [KEY=VALUE ...] [GROUP=OPTION ...]          one run
       fieldrl -m KEY=VALUE,VALUE ... [GROUP=OPTION,...]   every combination
{verbs}
groups
{groups}

keys
{keys}

A key inside a group is given by its path: agent.step_size=0.5, vehicle.start=[30,40].
The keys of each option are explained in its file, {conf}/GROUP/OPTION.yaml

options
  -m, --multirun     run every combination; hydra/launcher=joblib runs them in parallel
  --cfg job          print the composed configuration and run nothing
  --version          print the version
  --hydra-help       Hydra's own options

examples
  fieldrl
  fieldrl experiment=advection agent=lawnmower
  fieldrl -m agent.trace_decay=0.1,0.5,0.9 'seed=range(8)' hydra/launcher=joblib

A finished run is not computed again. HYDRA_FULL_ERROR=1 shows the traceback of an error."""


_OPTIONS = {"clean": "output_dir=FOLDER, --yes (does not ask)"}  # of the others output_dir alone


def of_verb(verb: str) -> str:
    """The help of a verb that has none of its own."""
    usage, what = VERBS[verb]
    options = _OPTIONS.get(verb, "output_dir=FOLDER")
    return f"usage: fieldrl {usage}\n\n{what}; options: {options}"


def text() -> str:
    """The help."""
    return _TEXT.format(verbs=_verbs(), groups=_groups(), keys=_keys(), conf=directory())


def _verbs() -> str:
    return "".join(f"       fieldrl {usage:<43} {what}\n" for usage, what in VERBS.values())


def _groups() -> str:
    found = {str(path.parent.relative_to(directory())) for path in directory().glob("*/**/*.yaml")}
    names = sorted(name for name in found if not name.startswith("hydra"))
    names.sort(key=lambda name: name != "experiment")
    return "\n".join(f"  {name:<12} {', '.join(options(name))}" for name in names)


def _keys() -> str:
    """The lines of config.yaml that hold the keys of the top level, with their comments."""
    lines = (directory() / "config.yaml").read_text().splitlines()
    keys = (line.partition("#") for line in lines if line[:1].isalpha() and "#" in line)
    return "\n".join(f"  {key.strip():<24} {comment.strip()}" for key, _, comment in keys)
