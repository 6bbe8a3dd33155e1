"""The ``hsbench`` command. Commands are imported when called, so that ``--help`` is quick.

Exit codes: 0 success, 2 the user's mistake, 3 a submission that fails its check, 130 stopped by Ctrl-C.
"""

from __future__ import annotations

import os
import sys
import warnings
from importlib import import_module

import click

from hsbench import __version__
from hsbench.errors import HsbenchError

COMMANDS = {
    "demo": "generate, predict, check, score and report at small size",
    "doctor": "what this machine has and lacks",
    "generate": "make a data set from a recipe",
    "merge": "join data sets made with generate --shard",
    "verify": "check a data set's files and contents",
    "info": "what a data set holds",
    "view": "an episode as a contact sheet and a clip",
    "import": "bring a real capture or a 3D scene into the schema",
    "annotate": "labels, boxes and plans drawn by hand as truth of a capture",
    "export": "a scene as GLB, JSON or plan drawing",
    "pack": "divide a test set into inputs to publish and hidden truth",
    "tasks": "list the tasks",
    "task": "one task, exactly",
    "train": "train a baseline that is a network",
    "predict": "run a baseline over a data set",
    "check": "check a submission, without truth",
    "score": "score a submission into a report",
    "compare": "is the difference between two reports real?",
    "tables": "reports and data sets in the forms of published tables",
    "board": "add entries to a board, show and build it",
}

INTERRUPTED = 130
USER_MISTAKE = 2


class LazyGroup(click.Group):
    """Commands named by file, imported when one of them is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names, in the order of a session's work."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of a name, None where there is none."""
        if cmd_name not in COMMANDS:
            return None
        module = import_module(f"hsbench.cli.{cmd_name}_command")
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The table of commands, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Start with: hsbench demo --out demo",
)
@click.version_option(__version__, prog_name="hsbench")
def cli() -> None:
    """Measure what watching people reveals about a room."""


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit."""
    sys.exit(run(arguments))


def run(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    warnings.showwarning = _note
    try:
        code = cli.main(args=arguments, prog_name="hsbench", standalone_mode=False)
    except HsbenchError as error:
        for line in str(error).splitlines():
            click.echo(f"error: {line}", err=True)
        return error.exit_code
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        error.show()
        return USER_MISTAKE
    except (KeyboardInterrupt, click.Abort):
        click.echo("stopped; what was written is whole, and the same command goes on or begins again", err=True)
        return INTERRUPTED
    except (BrokenPipeError, SystemExit):  # the reader of our output went away: `hsbench tasks | head -1`; click exits
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:  # a full disk, a read-only place, a file where a folder should be
        click.echo(f"error: {error.filename or 'output'}: {error.strerror or error}", err=True)
        return USER_MISTAKE
    return code if isinstance(code, int) else 0  # click gives back what a command handed to context.exit


def _note(message: Warning | str, *_: object, **__: object) -> None:
    """A warning in one line, without the place in our code it came from."""
    click.echo(f"note: {message}", err=True)


if __name__ == "__main__":
    main()
