"""The `arlight` command: one dataclass of options a subcommand, no logic."""

import sys
from collections.abc import Callable
from typing import Annotated, Any

import tyro
from rich.console import Console

from arlight.commands import demo, evaluate, probe, run, synthesize, table
from arlight.commands.interruption import INTERRUPTED_EXIT_CODE
from arlight.errors import ArlightError

Command = (
    Annotated[run.RunOptions, tyro.conf.subcommand("run")]
    | Annotated[demo.DemoOptions, tyro.conf.subcommand("demo")]
    | Annotated[probe.ProbeOptions, tyro.conf.subcommand("probe")]
    | Annotated[synthesize.SynthesizeOptions, tyro.conf.subcommand("synthesize")]
    | Annotated[evaluate.EvaluateOptions, tyro.conf.subcommand("evaluate")]
    | Annotated[table.TableOptions, tyro.conf.subcommand("table")]
)

_RUN: dict[type, Callable[[Any], int]] = {
    run.RunOptions: run.run,
    demo.DemoOptions: demo.run,
    probe.ProbeOptions: probe.run,
    synthesize.SynthesizeOptions: synthesize.run,
    evaluate.EvaluateOptions: evaluate.run,
    table.TableOptions: table.run,
}


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0, 1 for what the user can mend, 2 for usage, 130 for Ctrl-C."""
    errors = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)
    try:
        options: Any = tyro.cli(
            Command,  # type: ignore[arg-type]
            prog="arlight",
            args=arguments,
            description="Light virtual objects in footage with the light that is really there, "
            "measured from a printed sheet.",
        )
        return _RUN[type(options)](options)
    except ArlightError as error:
        errors.print(f"arlight: {error}")
        return 1
    except KeyboardInterrupt:
        errors.print("arlight: interrupted")
        return INTERRUPTED_EXIT_CODE


if __name__ == "__main__":
    sys.exit(main())
