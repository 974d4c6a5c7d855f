"""`arlight figures`: the paper's figures on synthesised pictures, and the comparison with mirrored and matte balls."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from arlight.benchmark.comparison import METHODS, ComparedLight, Comparison
from arlight.benchmark.comparison_page import draw_comparison
from arlight.benchmark.figures import FigureError, LightFigure, measure_figures
from arlight.benchmark.figures_page import draw_figures
from arlight.benchmark.probe_scene import ProbeScene, turned
from arlight.benchmark.relit_objects import MATERIALS
from arlight.commands.options.figures import FiguresOptions
from arlight.commands.outputs import Output, abandon, prepare_outputs
from arlight.environment import Environment
from arlight.errors import ArlightError, OutputError
from arlight.probe.layout import design_probe
from arlight.synthetic.captured import captured_names, load_environment
from arlight.synthetic.settings import default_camera

_SUFFIXES = (".png", ".pdf", ".svg")
_FIGURE_LIGHTS = ("hall", "bridge")
_DPI = 150
_TABLE_WIDTH = 125


def run(options: FiguresOptions) -> int:
    """Draw the page; returns the exit status.

    Raises:
        ArlightError: a light or the sheet cannot be used, the page cannot be written, or there is no headless OpenGL.
    """
    names = options.environments or (captured_names() if options.compare else _FIGURE_LIGHTS)
    outputs = _prepare(options, names)
    lights = [(Path(name).stem, load_environment(name)) for name in names]
    if options.turns < 1:
        raise FigureError(f"--turns must be at least 1, found {options.turns}")
    scene = ProbeScene(design_probe(options.order), default_camera(options.size), seed=options.seed)
    try:
        page, numbers, table = (_compared if options.compare else _figures)(options, scene, lights)
    except (ArlightError, KeyboardInterrupt):
        abandon(outputs.values(), worth_keeping=False)
        raise
    finally:
        scene.close()
    console = Console(soft_wrap=True, highlight=False, markup=False)
    # a row is one line, also where the output is a file
    Console(width=max(console.width, _TABLE_WIDTH), highlight=False, markup=False).print(table)
    for path in _write(outputs, page, numbers):
        console.print(f"  {path}")
    return 0


def _prepare(options: FiguresOptions, names: Sequence[str]) -> dict[str, Output]:
    if options.output.suffix.lower() not in _SUFFIXES:
        raise OutputError(f"{options.output}: --output must end in {', '.join(_SUFFIXES)}")
    return prepare_outputs({"--output": options.output, "--json": options.json}, [Path(name) for name in names])


def _figures(
    options: FiguresOptions, scene: ProbeScene, lights: Sequence[tuple[str, Environment]]
) -> tuple[Figure, object, Table]:
    figures: list[LightFigure] = []
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("lights", total=len(lights))
        for figure in measure_figures(scene, lights):
            figures.append(figure)
            progress.advance(task)
    table = Table(title="error / |L_0| in %: sheet, one picture / mirrored ball, bracketed")
    table.add_column("light")
    for order in range(options.order + 1):
        table.add_column(str(order), justify="right")
    for figure in figures:
        sheet, ball = figure.errors(figure.estimate.coefficients), figure.errors(figure.ball)
        cells = [f"{100.0 * s:.2f} / {100.0 * b:.2f}" for s, b in zip(sheet, ball, strict=True)]
        table.add_row(figure.name, *cells)
    return draw_figures(figures), [_figure_numbers(figure) for figure in figures], table


def _figure_numbers(figure: LightFigure) -> dict[str, object]:
    coefficients = {"sheet": figure.estimate.coefficients, "ball": figure.ball, "true": figure.truth}
    return {
        "light": figure.name,
        "frequencies": figure.estimate.frequencies.tolist(),
        **{f"{source}_re": values.real.tolist() for source, values in coefficients.items()},
        **{f"{source}_im": values.imag.tolist() for source, values in coefficients.items()},
        "sheet_stddev": figure.estimate.stddev.tolist(),
        "sheet_error": figure.errors(figure.estimate.coefficients).tolist(),
        "ball_error": figure.errors(figure.ball).tolist(),
        "ball_pictures": figure.pictures,
    }


def _compared(
    options: FiguresOptions, scene: ProbeScene, lights: Sequence[tuple[str, Environment]]
) -> tuple[Figure, object, Table]:
    compared: list[ComparedLight] = []
    all_lights = turned(lights, options.turns)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("lights", total=len(all_lights))
        for light in Comparison(scene).compare(all_lights):
            compared.append(light)
            progress.advance(task)
    table = Table(title=f"relighting error in %, median / 90th percentile over {len(compared)} lights")
    table.add_column("measured with")
    for material in MATERIALS:
        table.add_column(material.name, justify="right")
    for method in METHODS:
        errors = 100.0 * np.array([light.errors[method] for light in compared])
        high = np.percentile(errors, 90.0, axis=0)
        cells = [f"{m:.1f} / {h:.1f}" for m, h in zip(np.median(errors, axis=0), high, strict=True)]
        table.add_row(method, *cells)
    numbers = {
        "materials": [material.name for material in MATERIALS],
        "lights": [
            {
                "light": light.name,
                "ball_clipped": light.clipped_share,
                "errors": {method: light.errors[method].tolist() for method in METHODS},
            }
            for light in compared
        ],
    }
    return draw_comparison(compared, scene.pose), numbers, table


def _write(outputs: dict[str, Output], page: Figure, numbers: object) -> list[Path]:
    """Page and numbers, each in its place.

    Raises:
        OutputError: one cannot be written.
    """
    try:
        page.savefig(outputs["--output"].growing, dpi=_DPI)
        if "--json" in outputs:
            outputs["--json"].growing.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        abandon(outputs.values(), worth_keeping=False)
        raise OutputError(f"{error.filename}: cannot be written ({error.strerror}); choose another file") from error
    return [output.keep() for output in outputs.values()]
