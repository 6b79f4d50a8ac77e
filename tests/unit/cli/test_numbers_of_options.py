"""Every number of every command is finite and within bounds: nan and inf are refused in one line that names them."""

import click
import pytest
from support.click_tree import parameters

from rig.cli.commands import cli
from rig.cli.common import Number

ALL = [(name, param) for name, param in parameters(cli, "pamrig") if isinstance(param.type, click.types.FloatParamType)]
"""Every parameter that takes a number with a point."""


def test_there_are_such_options() -> None:
    assert len(ALL) > 20


@pytest.mark.parametrize(("name", "param"), ALL, ids=[f"{name} {param.opts[0]}" for name, param in ALL])
def test_only_finite_numbers_are_taken(name: str, param: click.Parameter) -> None:
    assert isinstance(param.type, Number), name
    for text in ("nan", "inf", "-inf", "NaN", "1e999"):
        with pytest.raises(click.BadParameter, match=r"is no finite number; allowed|is not in the range"):
            param.type.convert(text, param, None)


def test_what_is_refused_says_what_is_allowed() -> None:
    with pytest.raises(click.BadParameter, match=r"^nan is no finite number; allowed: 0\.5 to 2$"):
        Number(0.5, 2.0).convert("nan", None, None)
    with pytest.raises(click.BadParameter, match=r"^inf is no finite number; allowed: 0 or more$"):
        Number(0.0).convert("inf", None, None)
    assert Number(0.0).convert("1e3", None, None) == 1000.0
