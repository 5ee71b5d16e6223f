"""The first word of the command line may be a verb."""

import pytest

from fieldrl.cli import help as help_text
from fieldrl.cli import main as command
from fieldrl.core.checks import InvalidValue

given = []


def greet(arguments):
    """A verb that keeps what it is given."""
    given[:] = arguments


def refuse(arguments):
    """A verb that is refused."""
    raise InvalidValue("count", -1, "must be >= 0")


@pytest.fixture(autouse=True)
def verbs(monkeypatch):
    """Two verbs beside those that there are."""
    for name in ("greet", "refuse"):
        monkeypatch.setitem(command.VERBS, name, f"{__name__}:{name}")


def test_a_verb_is_given_what_follows_it():
    assert command.main(["greet", "file.csv", "seed=1", "--help"]) == 0
    assert given == ["file.csv", "seed=1", "--help"]


def test_what_a_verb_refuses_is_one_line(capsys):
    assert command.main(["refuse"]) == 1
    assert capsys.readouterr().err == "count=-1: must be >= 0\n"


def test_the_help_names_every_verb():
    assert set(help_text.VERBS) == set(command.VERBS) - {"greet", "refuse"}
    for usage, what in help_text.VERBS.values():
        assert usage in help_text.text()
        assert what in help_text.text()


@pytest.mark.parametrize("verb", sorted(help_text.VERBS))
@pytest.mark.parametrize("flag", ["-h", "--help"])
def test_every_verb_has_a_help(verb, flag, capsys):
    assert command.main([verb, flag]) == 0
    assert f"usage: fieldrl {help_text.VERBS[verb][0]}" in capsys.readouterr().out
