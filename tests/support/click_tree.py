"""Every command of a command line, and its parameters, by how it is called."""

from collections.abc import Iterator

import click


def commands(command: click.Command, name: str = "") -> Iterator[tuple[str, click.Command]]:
    """The command under that name, and those below it, in the order of the help."""
    yield name, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for item in command.list_commands(context):
            inner = command.get_command(context, item)
            assert inner is not None
            yield from commands(inner, f"{name} {item}".strip())


def parameters(command: click.Command, name: str = "") -> Iterator[tuple[str, click.Parameter]]:
    """Every option and argument of these, with the command that has it."""
    for called, one in commands(command, name):
        yield from ((called, param) for param in one.params)
