"""The `arlight` command: one dataclass of options a subcommand, no logic."""

import sys
from argparse import ArgumentParser
from importlib import import_module
from inspect import cleandoc
from typing import Annotated, Any, Union

import tyro
from rich.console import Console

from arlight.commands.dispatch import run_command
from arlight.commands.interruption import INTERRUPTED_EXIT_CODE
from arlight.errors import ArlightError
from arlight.presets import PRESETS

COMMANDS = {
    "run": "RunOptions",
    "demo": "DemoOptions",
    "probe": "ProbeOptions",
    "calibrate": "CalibrateOptions",
    "ball": "BallOptions",
    "synthesize": "SynthesizeOptions",
    "evaluate": "EvaluateOptions",
    "table": "TableOptions",
    "figures": "FiguresOptions",
    "trace": "TraceOptions",
    "prove": "ProveOptions",
    "bench": "BenchOptions",
}
"""Module of `arlight.commands` and `arlight.commands.options`, and class of options of every subcommand."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0, 1 for what the user can mend, 2 for usage, 130 for Ctrl-C."""
    errors = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)
    try:
        options = _parsed(sys.argv[1:] if arguments is None else arguments)
        return run_command(options)
    except ArlightError as error:
        errors.print(f"arlight: {error}")
        return 1
    except KeyboardInterrupt:
        errors.print("arlight: interrupted")
        return INTERRUPTED_EXIT_CODE


def _parsed(arguments: list[str]) -> Any:
    """The options of the subcommand that is named, which alone is loaded; all are for the list of them."""
    if arguments and arguments[0] in COMMANDS:
        options = _options(arguments[0])
        return tyro.cli(
            options, prog=f"arlight {arguments[0]}", args=arguments[1:], default=_defaults(options, arguments[1:])
        )
    every: Any = Union[tuple(Annotated[_options(name), _listed(name)] for name in COMMANDS)]  # noqa: UP007
    return tyro.cli(
        every,
        prog="arlight",
        args=arguments,
        description="Light virtual objects in footage with the light that is really there, "
        "measured from a printed sheet.",
    )


def _defaults(options: Any, arguments: list[str]) -> Any:
    """Those of the preset that is asked for, where there are presets."""
    if not hasattr(options, "of_preset"):
        return None
    named = ArgumentParser(add_help=False, exit_on_error=False, allow_abbrev=False)
    named.add_argument("--preset", default="balanced", nargs="?")
    name = named.parse_known_args(arguments)[0].preset
    # what is no preset is refused with the others
    return options.of_preset(name if name in PRESETS else "balanced")


def _listed(name: str) -> Any:
    """The subcommand with the first paragraph of what it does."""
    return tyro.conf.subcommand(name, description=cleandoc(_options(name).__doc__).split("\n\n")[0])


def _options(name: str) -> Any:
    return getattr(import_module(f"arlight.commands.options.{name}"), COMMANDS[name])


if __name__ == "__main__":
    sys.exit(main())
