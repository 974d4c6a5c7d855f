"""`arlight trace`: the validation suite's path-traced clips, or block means, from captured environments."""

from rich.console import Console

from arlight.commands.options.trace import TraceOptions
from arlight.errors import OutputError
from arlight.probe.design import DESIGNS
from arlight.validation.block_responses import save_responses, trace_proof_responses
from arlight.validation.suite import trace_proof


def run(options: TraceOptions) -> int:
    """Trace and write; returns the exit status.

    Raises:
        ArlightError: Mitsuba or an environment is missing, or a file cannot be written.
    """
    if options.output.exists():
        raise OutputError(f"{options.output}: is there already; choose another folder, or remove it first")
    console = Console(soft_wrap=True, highlight=False, markup=False)
    if options.what == "clips":
        trace_proof(options.output, options.captured, lambda name: console.print(f"{options.output / name}.mp4"))
        return 0
    for design in DESIGNS:
        responses = trace_proof_responses(design, options.captured)
        options.output.mkdir(parents=True, exist_ok=True)
        path = options.output / f"responses-{design}.npz"
        save_responses(responses, path)
        console.print(str(path))
    return 0
