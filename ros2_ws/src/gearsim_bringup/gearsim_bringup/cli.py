"""The command line: one file per command in `commands/`, exit codes in one place.

0 done, 1 the job failed, 2 bad usage or bad input, 3 the environment lacks something, 130 interrupted.
Errors are one line on stderr; the traceback of an error nobody foresaw goes into a file.
"""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import FrameType

import click

from gearsim_io.errors import EnvironmentLackError, InputError

FAILED, BAD_INPUT, LACKS, INTERRUPTED = 1, 2, 3, 130

# Name on the command line -> module in commands/ that holds `command`; in the order a new user needs them.
COMMANDS = {
    "demo": "demo",
    "run": "run",
    "simulate": "simulate",
    "scenarios": "scenarios",
    "ensemble": "ensemble",
    "import": "import_files",
    "record": "record",
    "play": "play",
    "recover": "recover",
    "info": "info",
    "diagnose": "diagnose",
    "twin": "twin",
    "view": "view",
    "monitoring": "monitoring",
    "bench": "bench",
    "casing": "casing",
    "gallery": "gallery",
    "figures": "figures",
    "evaluate": "evaluate",
    "parameters": "parameters",
    "data": "data",
}
# Done by the entry script before this program starts; listed here so that --help is complete.
ENTRY_SCRIPT_COMMANDS = {
    "setup": "Set up what is missing, nothing else.",
    "test": "Set up what is missing, then run the whole test suite.",
    "doctor": "Check the environment and say how to mend it.",
}


class LazyGroup(click.Group):
    """A group that imports a command's module only when that command is asked for."""

    def list_commands(self, _ctx: click.Context) -> list[str]:
        """All names in the order of `COMMANDS`."""
        return list(COMMANDS)

    def get_command(self, _ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name, imported now."""
        if cmd_name not in COMMANDS:
            return None
        command = import_module(f"gearsim_bringup.commands.{COMMANDS[cmd_name]}").command
        assert isinstance(command, click.Command)
        return command

    def format_epilog(self, _ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Name the commands that the entry script runs itself."""
        with formatter.section("Set-up"):
            formatter.write_dl(list(ENTRY_SCRIPT_COMMANDS.items()))


@click.group(
    cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(package_name=None, version="0.1.0", prog_name="gearsim")
def app() -> None:
    """A virtual gearbox test rig for ROS 2, and the diagnosis of what it and real rigs measure."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        status = app.main(args=arguments, standalone_mode=False, prog_name="gearsim")
        return int(status or 0)
    except click.exceptions.NoArgsIsHelpError as help_page:
        help_page.show()
        return BAD_INPUT
    except click.ClickException as error:
        hint = error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else "gearsim"
        return _complain(f"{error.format_message()} (see `{hint} --help`)", BAD_INPUT)
    except InputError as error:
        return _complain(str(error), BAD_INPUT)
    except EnvironmentLackError as error:
        return _complain(str(error), LACKS)
    except (KeyboardInterrupt, click.Abort):
        return _complain("interrupted", INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output went away (as in `| head`): nothing is wrong, and nothing more can be said.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except Exception as error:
        return _report(error)


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _complain(line: str, code: int) -> int:
    print(f"gearsim: {line}", file=sys.stderr)
    return code


def _report(error: Exception) -> int:
    from gearsim_bringup.ui import JobFailedError
    from gearsim_io.bags import BagError

    if isinstance(error, OSError) and error.filename and error.strerror:
        return _complain(f"{error.filename}: {error.strerror}", FAILED)
    if isinstance(error, (JobFailedError, BagError, OSError)):
        return _complain(str(error), FAILED)
    folder = Path(os.environ.get("GEARSIM_STATE", ".gearsim")) / "log"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        crash = folder / "crash.txt"
        crash.write_text("".join(traceback.format_exception(error)))
        where = f"the traceback is in {crash}"
    except OSError:
        where = "no traceback could be written"
    return _complain(f"unexpected {type(error).__name__}: {error} ({where})", FAILED)


if __name__ == "__main__":
    sys.exit(main())
