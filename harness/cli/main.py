"""The command `crosscheck`. What its exit codes mean stands in `harness.errors.ExitCode`."""

from __future__ import annotations

import os
import sys
from typing import Any

import click

from harness.cli.crash import ThreadFaults, attempt
from harness.cli.error_line import complain
from harness.cli.lazy import LazyGroup, Place
from harness.cli.output import Kept, Outputs
from harness.errors import ExitCode, InputError
from harness.version import __version__

# The first sentence of each command's docstring stands here too: `crosscheck --help` imports none of the commands.
COMMANDS = {
    "accept": Place(
        "harness.cli.accept", "accept",
        "Put the numbers of the last reports of these robots (none: all) on file, to be committed.",
    ),
    "completion": Place(
        "harness.cli.completion", "completion",
        'Print the completion script of a shell, e.g. for bash: eval "$(crosscheck completion bash)".',
    ),
    "derive-dh": Place(
        "harness.cli.derive", "derive_dh",
        "Find the DH table of a chain in a URDF, and prove that it is the same robot.",
    ),
    "diff": Place(
        "harness.cli.diff", "diff_command",
        "Compare two mechanisms from base to tip, and say why they differ.",
    ),
    "engines": Place(
        "harness.cli.engines", "engines",
        "Show which engines are installed, their versions, how to install the others, and their traits.",
    ),
    "export-urdf": Place(
        "harness.cli.export", "export_urdf_command",
        "Write a robot model's DH table as a URDF: kinematics only, one link for each DH frame.",
    ),
    "frames": Place(
        "harness.cli.frames", "frames",
        "Show the frame tree: joint types, axes, and what each frame is mapped to.",
    ),
    "identify": Place(
        "harness.cli.identify", "identify_command",
        "Which known DH table this mechanism is, modulo base, tool, joint signs and zero offsets; nearest first.",
    ),
    "mutate": Place(
        "harness.cli.mutate", "mutate",
        "Put faults into robot models on purpose, and see what the gate makes of them.",
    ),
    "render": Place(
        "harness.cli.render", "render",
        "Render HTML, Markdown and JUnit from a report's JSON again.",
    ),
    "run": Place(
        "harness.cli.run", "run",
        "Cross-check robot models (names, or folders with a model.toml; none: all) and write reports.",
    ),
    "view": Place(
        "harness.cli.view", "view",
        "Show a robot's sources side by side in a local page, with a slider for each joint.",
    ),
    "worker-check": Place(
        "harness.cli.worker_check", "worker_check",
        "Check that a program speaks the worker protocol, and say what is wrong.",
    ),
}  # fmt: skip


class _Carried(Exception):
    """Carries an exception past click, which has an answer of its own to it."""

    def __init__(self, error: BaseException) -> None:
        super().__init__()
        self.error = error


class _Group(LazyGroup):
    """A group that lets nothing but its own exceptions reach click."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command. A broken pipe would end with 1, which is a disagreement; an end of file as if by Ctrl-C."""
        try:
            return super().invoke(ctx)
        except (BrokenPipeError, EOFError) as error:
            raise _Carried(error) from None


@click.group(cls=_Group, places=COMMANDS, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="crosscheck")
def cli() -> None:
    """Cross-validate a robot's DH table against its URDF with every FK engine installed."""


def main() -> None:
    """Entry point: every error one line on stderr, no traceback. What is lost of the output does not change a verdict."""
    outputs, threads = Outputs(), ThreadFaults()
    try:
        code = attempt(_called)
        code = code if threads.code == ExitCode.AGREES else _combined(code, threads.code)
        outputs.flush()
        if why := outputs.loss():
            complain(InputError(f"cannot be written: {why}", where="standard output"))
            code = _combined(code, ExitCode.WRONG_INPUT)
        elif outputs.unread and code == ExitCode.AGREES and not isinstance(code, Kept):
            code = ExitCode.PIPE_CLOSED
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted: reports written before are unchanged", err=True)
        code = ExitCode.INTERRUPTED
    outputs.flush()
    sys.exit(int(code))


def _called() -> object:
    """Run the command that was asked for. Returns what it returns; usage errors are told here."""
    try:
        return cli.main(standalone_mode=False)
    except click.ClickException as error:
        complain(InputError(error.format_message()))
        return ExitCode.WRONG_INPUT
    except _Carried as carried:
        raise carried.error from None
    except SystemExit as error:
        if "_CROSSCHECK_COMPLETE" not in os.environ:
            raise
        return ExitCode.WRONG_INPUT if error.code else ExitCode.AGREES


def _combined(*codes: int) -> int:
    from harness.verdict.gate import combined  # noqa: PLC0415  (heavy, and seldom needed)

    return combined(codes)
