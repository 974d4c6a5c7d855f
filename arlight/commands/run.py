"""`arlight run`: a recorded clip in, a relit clip and its lighting out."""

from pathlib import Path

from rich.console import Console

from arlight.commands.footage import Footage, check_result, open_footage, shows_the_sheet
from arlight.commands.interruption import INTERRUPTED_EXIT_CODE
from arlight.commands.loop import Work, run_frames
from arlight.commands.options.run import RunOptions
from arlight.commands.outputs import Output, abandon, prepare_outputs
from arlight.commands.relighting import make_relighter
from arlight.commands.summary import print_summary
from arlight.errors import ArlightError, OutputError, ProbeError
from arlight.lighting_tracker import TrackerSettings
from arlight.pipeline import Pipeline
from arlight.results.frame_loop import Sinks
from arlight.results.log import LightingLogWriter
from arlight.results.record import LogHeader
from arlight.results.report import ReportRecorder
from arlight.results.statistics import RunStatistics
from arlight.video.writer import VideoWriter, check_output


def run(options: RunOptions) -> int:
    """Run the loop over a clip; returns the exit status.

    Raises:
        ArlightError: something the user can mend, in the clip, the probe, the camera, the object or an output.
    """
    with open_footage(options.clip, options.footage) as footage:
        _check_order(options.order, footage)
        outputs = _prepare(options, footage)
        console = Console(soft_wrap=True, highlight=False, markup=False)
        for note in footage.notes:
            console.print(note)
        pipeline = _pipeline(options, footage)
        statistics = RunStatistics()
        try:
            interrupted = _process(options, footage, pipeline, outputs, statistics)
            check_result(footage, statistics)
        except (ArlightError, KeyboardInterrupt):
            abandon(outputs.values(), worth_keeping=shows_the_sheet(statistics))
            raise
    written = {option.removeprefix("--"): output.keep() for option, output in outputs.items()}
    print_summary(statistics, written, interrupted)
    return INTERRUPTED_EXIT_CODE if interrupted else 0


def _check_order(order: int | None, footage: Footage) -> None:
    if order is not None and not 0 <= order <= footage.probe.order:
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


def _pipeline(options: RunOptions, footage: Footage) -> Pipeline:
    probe, camera, order = footage.probe, footage.camera, options.order
    relighter = make_relighter(options.relighting, probe, camera, order) if options.render else None
    settings = TrackerSettings() if order is None else TrackerSettings(order=order)
    return Pipeline(probe, camera, relighter, settings, footage.assembly, footage.fixed)


def _process(
    options: RunOptions, footage: Footage, pipeline: Pipeline, outputs: dict[str, Output], statistics: RunStatistics
) -> bool:
    """Every frame of the clip into the outputs; returns whether it was interrupted."""
    header = LogHeader.of(footage.probe, footage.camera, str(options.clip), str(footage.probe_path), options.order)
    with Sinks() as sinks:
        if "--output" in outputs:
            growing = outputs["--output"].growing
            sinks.video = VideoWriter(
                growing, like=footage.reader, crf=options.encoding.crf, preset=options.encoding.preset
            )
        if "--lighting" in outputs:
            sinks.log = LightingLogWriter(outputs["--lighting"].growing, header)
        if "--report" in outputs:
            sinks.report = ReportRecorder(header)
        reader = footage.reader
        interrupted = run_frames(reader, pipeline, sinks, statistics, Work(options.clip.name, reader.frame_count))
    if sinks.report is not None:
        sinks.report.write(outputs["--report"].growing, statistics)
    return interrupted
