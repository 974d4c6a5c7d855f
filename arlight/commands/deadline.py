"""A deadline on the command line: the controller that holds it, and what it gave up."""

from arlight.budget import BudgetController, Rung
from arlight.commands.options.budget import BudgetOptions
from arlight.effort import Effort
from arlight.errors import OutputError
from arlight.presets import LADDER


def make_controller(options: BudgetOptions) -> BudgetController | None:
    """The controller that holds the deadline asked for; None where none is.

    Raises:
        OutputError: the deadline means nothing, or there are two.
    """
    if options.budget_ms is not None and options.fps is not None:
        raise OutputError("--budget-ms and --fps are two names of one deadline; give one of them")
    if options.budget_ms is not None:
        return BudgetController(_positive("--budget-ms", options.budget_ms) / 1000.0, LADDER)
    if options.fps is not None:
        return BudgetController(1.0 / _positive("--fps", options.fps), LADDER)
    return None


def account(controller: BudgetController) -> str:
    """How well the deadline was held, and what was given up for it."""
    made = int(controller.frames_at.sum())
    text = (
        f"{controller.budget_s * 1e3:.3g} ms held by {100.0 * (1.0 - controller.late / max(made, 1)):.1f} % of {made}"
    )
    given_up = [
        f"{count} with {_described(rung)}"
        for rung, count in zip(controller.ladder, controller.frames_at, strict=True)
        if count and rung.effort != controller.ladder[0].effort
    ]
    text += f" frames ({controller.late} late)"
    if given_up:
        text += "; " + ", ".join(given_up)
    return text + (f"; {controller.left_out} left out" if controller.left_out else "")


def _described(rung: Rung) -> str:
    """The limits of a rung in words."""
    effort: Effort = rung.effort
    words = [
        f"light up to order {effort.order}" if effort.order is not None else "",
        f"{effort.samples_per_block} samples a block" if effort.samples_per_block is not None else "",
        f"light every {effort.estimate_every} frames" if effort.estimate_every is not None else "",
        f"{effort.supersampling}x{effort.supersampling} samples a pixel" if effort.supersampling is not None else "",
        "" if effort.shadow else "no shadow",
    ]
    return " and ".join(word for word in words if word) or "everything"


def _positive(option: str, value: float) -> float:
    if not 0.0 < value < float("inf"):
        raise OutputError(f"{option} {value:g}: a positive number was expected")
    return value
