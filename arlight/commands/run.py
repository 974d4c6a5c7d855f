"""`arlight run`: a recorded clip in, a relit clip and its lighting out."""

from pathlib import Path

from rich.console import Console

from arlight.budget import BudgetController
from arlight.commands.deadline import account, make_controller
from arlight.commands.footage import Footage, check_result, open_footage, shows_the_sheet
from arlight.commands.interruption import INTERRUPTED_EXIT_CODE
from arlight.commands.loop import Work, run_frames
from arlight.commands.options.run import RunOptions
from arlight.commands.outputs import Output, abandon, prepare_outputs
from arlight.commands.relighting import make_relighter
from arlight.commands.summary import print_summary
from arlight.errors import ArlightError, OutputError, ProbeError
from arlight.pipeline import Pipeline
from arlight.results.frame_loop import Sinks
from arlight.results.log import LightingLogWriter
from arlight.results.record import LogHeader
from arlight.results.report import ReportRecorder
from arlight.results.statistics import RunStatistics
from arlight.tracker_settings import Order
from arlight.video.writer import VideoWriter, check_output


def run(options: RunOptions) -> int:
    """Run the loop over a clip; returns the exit status.

    Raises:
        ArlightError: something the user can mend, in the clip, the probe, the camera, the object or an output.
    """
    with open_footage(options.clip, options.footage) as footage:
        _check_order(options.tracker.order, footage)
        budget = make_controller(options.budget)
        outputs = _prepare(options, footage)
        console = Console(soft_wrap=True, highlight=False, markup=False)
        for note in footage.notes:
            console.print(note)
        pipeline = _pipeline(options, footage, budget)
        statistics = RunStatistics()
        try:
            interrupted = _process(options, footage, pipeline, outputs, statistics)
            check_result(footage, statistics)
        except (ArlightError, KeyboardInterrupt):
            abandon(outputs.values(), worth_keeping=shows_the_sheet(statistics))
            raise
    written = {option.removeprefix("--"): output.keep() for option, output in outputs.items()}
    print_summary(statistics, written, interrupted, None if budget is None else account(budget))
    return INTERRUPTED_EXIT_CODE if interrupted else 0


def _check_order(order: Order, footage: Footage) -> None:
    if isinstance(order, int) and not 0 <= order <= footage.probe.order:
        raise ProbeError(
            f"--order {order}: {footage.probe_path} measures orders 0 to {footage.probe.order}; ask for one of those"
        )


def _prepare(options: RunOptions, footage: Footage) -> dict[str, Output]:
    """The outputs, checked before any work."""
    output, lighting = options.output, options.lighting
    if not options.render and output is not None:
        raise OutputError(f"{output}: --no-render draws nothing that --output could hold; leave one of them out")
    if options.render and output is None:
        output = Path(f"{options.clip.stem}-relit.mp4")
    if not options.render and lighting is None:
        lighting = Path(f"{options.clip.stem}.jsonl")
    if output is not None:
        check_output(output, [])
    inputs = [options.clip, footage.probe_path, footage.camera_path, footage.calibration_path]
    inputs.append(options.relighting.object)
    return prepare_outputs({"--output": output, "--lighting": lighting, "--report": options.report}, inputs)


def _pipeline(options: RunOptions, footage: Footage, budget: BudgetController | None) -> Pipeline:
    probe, camera, settings = footage.probe, footage.camera, options.tracker
    relighter = make_relighter(options.relighting, probe, camera, _told(settings.order)) if options.render else None
    return Pipeline(probe, camera, relighter, settings, footage.assembly, footage.fixed, budget)


def _told(order: Order) -> int | None:
    """Highest order that the outputs may have; None for the sheet's."""
    return order if isinstance(order, int) else None


def _process(
    options: RunOptions, footage: Footage, pipeline: Pipeline, outputs: dict[str, Output], statistics: RunStatistics
) -> bool:
    """Every frame of the clip into the outputs; returns whether it was interrupted."""
    header = LogHeader.of(
        footage.probe, footage.camera, str(options.clip), str(footage.probe_path), _told(options.tracker.order)
    )
    with Sinks() as sinks:
        if "--output" in outputs:
            growing = outputs["--output"].growing
            sinks.video = VideoWriter(
                growing, like=footage.reader, crf=options.encoding.crf, preset=options.encoding.encoder_preset
            )
        if "--lighting" in outputs:
            sinks.log = LightingLogWriter(outputs["--lighting"].growing, header)
        if "--report" in outputs:
            sinks.report = ReportRecorder(header)
        reader = footage.reader
        work = Work(options.clip.name, reader.frame_count, deadline=pipeline.has_deadline)
        interrupted = run_frames(reader, pipeline, sinks, statistics, work)
    if sinks.report is not None:
        sinks.report.write(outputs["--report"].growing, statistics)
    return interrupted
