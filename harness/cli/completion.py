"""`crosscheck completion`: the script that makes a shell complete commands, options, robots and engines."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from harness.errors import InputError


@click.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(ctx: click.Context, shell: str) -> int:
    """Print the completion script of a shell, e.g. for bash: eval "$(crosscheck completion bash)"."""
    script = get_completion_class(shell)
    if script is None:
        raise InputError(f"no completion for {shell}")
    click.echo(script(ctx.find_root().command, {}, "crosscheck", "_CROSSCHECK_COMPLETE").source())
    return 0
