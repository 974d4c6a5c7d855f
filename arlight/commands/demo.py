"""`arlight demo`: frames synthesised on the fly, tracked, relit and written, without any file to start from."""

from collections.abc import Iterator
from pathlib import Path

from arlight.commands.deadline import account, make_controller
from arlight.commands.interruption import INTERRUPTED_EXIT_CODE
from arlight.commands.loop import Work, run_frames
from arlight.commands.options.demo import DemoOptions
from arlight.commands.outputs import Output, abandon, prepare_outputs
from arlight.commands.relighting import make_relighter
from arlight.commands.summary import print_summary
from arlight.errors import ArlightError
from arlight.pipeline import Pipeline
from arlight.presets import PRESETS
from arlight.probe.design import Probe
from arlight.probe.layout import design_probe
from arlight.results.frame_loop import Sinks
from arlight.results.log import LightingLogWriter
from arlight.results.record import LogHeader
from arlight.results.statistics import RunStatistics
from arlight.synthetic.captured import load_environment
from arlight.synthetic.settings import SynthesisSettings
from arlight.synthetic.synthesis import synthesize
from arlight.video.frame import Frame
from arlight.video.writer import VideoWriter, check_output


def run(options: DemoOptions) -> int:
    """Run the loop over synthetic frames; returns the exit status.

    Raises:
        ArlightError: something the user can mend, in the environment, the object or an output.
    """
    check_output(options.output, [])
    outputs = prepare_outputs(
        {"--output": options.output, "--lighting": options.lighting},
        [options.relighting.object, Path(options.environment)],
    )
    settings = SynthesisSettings(
        environment=options.environment, light=options.light, path=options.path, duration_s=options.seconds
    )
    # refused before the object is prepared, which takes seconds
    load_environment(options.environment)
    probe = design_probe(options.order)
    budget = make_controller(options.budget)
    relighter = make_relighter(options.relighting, probe, settings.filming_camera)
    tracker = PRESETS[options.preset].tracker
    pipeline = Pipeline(probe, settings.filming_camera, relighter, tracker, budget=budget)
    statistics = RunStatistics()
    try:
        interrupted = _process(options, settings, probe, pipeline, outputs, statistics)
    except (ArlightError, KeyboardInterrupt):
        abandon(outputs.values(), worth_keeping=statistics.tracked > 0)
        raise
    written = {option.removeprefix("--"): output.keep() for option, output in outputs.items()}
    print_summary(statistics, written, interrupted, None if budget is None else account(budget))
    return INTERRUPTED_EXIT_CODE if interrupted else 0


def _process(
    options: DemoOptions,
    settings: SynthesisSettings,
    probe: Probe,
    pipeline: Pipeline,
    outputs: dict[str, Output],
    statistics: RunStatistics,
) -> bool:
    """Every frame into the outputs; returns whether it was interrupted."""
    header = LogHeader.of(probe, settings.filming_camera, f"synthetic, {options.environment}", "designed on the fly")
    with Sinks() as sinks:
        sinks.video = VideoWriter(
            outputs["--output"].growing,
            frame_rate=settings.frame_rate,
            crf=options.encoding.crf,
            preset=options.encoding.encoder_preset,
        )
        if "--lighting" in outputs:
            sinks.log = LightingLogWriter(outputs["--lighting"].growing, header)
        work = Work("demo", settings.frame_count, source="synthesise", deadline=pipeline.has_deadline)
        return run_frames(_frames(settings, probe), pipeline, sinks, statistics, work)


def _frames(settings: SynthesisSettings, probe: Probe) -> Iterator[Frame]:
    for synthetic in synthesize(settings, probe):
        yield synthetic.frame
