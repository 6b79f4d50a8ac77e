"""A command that there is not: what may have been meant, and in which group it stands."""

import click
import pytest
from click.testing import CliRunner

from rig.cli.commands import COMMANDS, GROUPS, cli, imported


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (("rig", "init"), "no such command 'init'; allowed: check, new"),
        (("gap", "diagnos"), "no such command 'diagnos'; did you mean 'diagnose'?"),
        (("diagnose",), "no such command 'diagnose'; did you mean 'gap diagnose'?"),
        (("export",), "no such command 'export'; did you mean 'log export'?"),
        (("validat",), "no such command 'validat'; did you mean 'validate'?"),
        (("nothing like it",), "no such command 'nothing like it'; allowed: arm, bench"),
    ],
)
def test_what_was_meant_is_said(call: tuple[str, ...], said: str) -> None:
    done = CliRunner().invoke(cli, call, standalone_mode=False)
    assert isinstance(done.exception, click.UsageError)
    assert said in done.exception.message


def test_every_group_is_looked_into() -> None:
    assert {name for name in COMMANDS if isinstance(imported(name), click.Group)} == set(GROUPS)
