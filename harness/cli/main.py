"""The command `crosscheck`. Exit codes: 0 agreement, 1 disagreement, 2 wrong input, 3 a required source missing, 130 Ctrl-C."""

from __future__ import annotations

import sys
from typing import Any

import click

from harness.cli.error_line import complain
from harness.cli.lazy import LazyGroup, Place
from harness.errors import CrosscheckError
from harness.report.text import plain
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


@click.group(cls=LazyGroup, places=COMMANDS, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="crosscheck")
def cli() -> None:
    """Cross-validate a robot's DH table against its URDF with every FK engine installed."""


def main() -> None:
    """Entry point: every error one line on stderr, no traceback for wrong input."""
    try:
        code: Any = cli.main(standalone_mode=False)
    except CrosscheckError as error:
        complain(error)
        code = error.exit_code
    except click.ClickException as error:
        click.echo(f"error: {plain(error.format_message())}", err=True)
        code = 2
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted: reports written before are unchanged", err=True)
        code = 130
    except BrokenPipeError:  # the reader, e.g. head, has gone; nothing more can be said
        sys.stdout = None
        code = 141
    sys.exit(code if isinstance(code, int) else 0)
