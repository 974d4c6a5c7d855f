"""The parts of the benchmark, in order: what each measures, on which workloads, how often."""

from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from arlight.benchmark.speed import growth_part
from arlight.benchmark.speed.bound_part import measure_bound
from arlight.benchmark.speed.budget_part import measure_budgets
from arlight.benchmark.speed.coding_part import measure_coding
from arlight.benchmark.speed.drawing_part import measure_drawing
from arlight.benchmark.speed.filming import film
from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.front import measure_front
from arlight.benchmark.speed.front_settings import front_settings
from arlight.benchmark.speed.loop_part import measure_loop
from arlight.benchmark.speed.memory_part import measure_memory
from arlight.benchmark.speed.order_part import measure_order
from arlight.benchmark.speed.playback import FilmedClip, load_clip
from arlight.benchmark.speed.relighters import FINEST, Relighters
from arlight.benchmark.speed.start_part import measure_start
from arlight.benchmark.speed.tracking_part import measure_tracking
from arlight.benchmark.speed.workloads import APRIL_TAGS, FULL, HEADLINE, LARGE, QUICK, Workload
from arlight.benchmark.speed.yardsticks import AprilTagPose, ArucoPose
from arlight.errors import RenderingUnavailableError
from arlight.presets import PRESETS

_FRONT_CLIPS = (
    HEADLINE,
    "720p order 5, turning light",
    "720p order 5, switched light",
    "720p order 5, apartment",
    "720p order 5, bridge",
    "720p order 5, studio",
)
_SHORT_S, _DEADLINE_S = 10.0, 40.0


@dataclass(frozen=True, slots=True)
class Part:
    """A piece of the benchmark that can be measured again by itself."""

    name: str
    """In words."""
    measure: Callable[[], Findings]
    """Measures it."""


@dataclass(slots=True)
class Suite:
    """Everything that a run of the benchmark measures."""

    frames_folder: Path
    """Where the filmed clips are or will be."""
    scratch: Path
    """Empty folder for what is written while measuring."""
    quick: bool = False
    """Only the small subset."""
    length_s: float = 60.0
    """Length of the long clip on which memory is measured [s]."""
    relighters: Relighters = field(default_factory=Relighters)
    """Objects that were prepared."""
    _found: dict[str, Findings] = field(default_factory=dict)

    @property
    def workloads(self) -> tuple[Workload, ...]:
        """Everything that must be filmed."""
        return QUICK if self.quick else (*FULL, APRIL_TAGS, *growth_part.growth_workloads())

    @property
    def steps(self) -> int:
        """How often `run` calls its `watch`, unless clips are there already."""
        return len(self.workloads) + len(self.parts())

    def run(self, watch: Callable[[str], None]) -> Findings:
        """Film what is missing, then measure part after part.

        Args:
            watch: called with the name of what begins.

        Raises:
            RenderingUnavailableError: there is no headless OpenGL and not all clips are there.
            OutputError: the folder of the clips cannot be written to.
        """
        film(self.workloads, self.frames_folder, watch)
        return self._measure(self.parts(), watch)

    def again(self, names: set[str], watch: Callable[[str], None]) -> Findings:
        """Measure the parts anew that found something by one of these names."""
        parts = [
            part
            for part in self.parts()
            if part.name in self._found
            and names & (self._found[part.name].ratios.keys() | self._found[part.name].errors.keys())
        ]
        return self._measure(parts, watch)

    def _measure(self, parts: Iterable[Part], watch: Callable[[str], None]) -> Findings:
        together = Findings()
        for part in parts:
            watch(part.name)
            try:
                self._found[part.name] = part.measure()
            except RenderingUnavailableError as error:
                self._found[part.name] = Findings(notes=[f"{part.name} was left out: {error}"])
            together.merge(self._found[part.name])
        return together

    def parts(self) -> list[Part]:
        """What is measured, in order."""
        names = [workload.name for workload in (QUICK if self.quick else FULL)]
        parts = [Part(f"tracking, {name}", partial(self._tracking, name)) for name in names]
        sizes = (HEADLINE,) if self.quick else (HEADLINE, LARGE)
        parts += [Part(f"drawing, {name}", partial(self._drawing, name)) for name in sizes]
        parts += [Part(f"coding, {name}", partial(self._coding, name)) for name in sizes]
        parts += [Part(f"loop, {name}", partial(self._loop, name)) for name in (HEADLINE, LARGE)]
        parts += [Part("first result", self._start), Part("bound", self._bound), Part("front", self._front)]
        if not self.quick:
            parts += [Part(f"order, {name}", partial(self._order, name)) for name in names if name != LARGE]
            parts.append(Part("deadlines", self._budgets))
            parts.append(Part("AprilTags", self._april_tags))
            parts += [Part(f"growth with {axis}", partial(grow, self)) for axis, grow in _GROWTH.items()]
            parts.append(Part("memory", self._memory))
        return parts

    def clip(self, name: str) -> FilmedClip:
        """A filmed workload by its name."""
        return load_clip(self.frames_folder, next(each for each in self.workloads if each.name == name))

    def _tracking(self, name: str) -> Findings:
        clip = self.clip(name)
        relighter = None
        found = Findings()
        if name != LARGE:
            try:
                relighter = self.relighters.of(clip.probe, clip.camera)
            except RenderingUnavailableError as error:
                found.notes.append(f"the lit object's error was left out: {error}")
        found.merge(measure_tracking(clip, self._count(48, 96), ArucoPose(clip.probe, clip.camera), relighter))
        return found

    def _drawing(self, name: str) -> Findings:
        clip = self.clip(name)
        return measure_drawing(clip, self._count(13, 48), self.relighters.of(clip.probe, clip.camera))

    def _coding(self, name: str) -> Findings:
        return measure_coding(self.clip(name), self._count(3, 9), PRESETS["balanced"].encoding, self.scratch)

    def _loop(self, name: str) -> Findings:
        clip, preset = self.clip(name), PRESETS["balanced"]
        relighter = self.relighters.of(clip.probe, clip.camera, preset.relight)
        frames, repeats = self._count(48, 240), self._count(3, 5)
        return measure_loop(clip, frames, repeats, preset, relighter, self.scratch)

    def _start(self) -> Findings:
        return measure_start(self.clip(HEADLINE), self._count(2, 5), self.scratch)

    def _bound(self) -> Findings:
        return measure_bound(self.clip(HEADLINE), self._count(60, 240))

    def _front(self) -> Findings:
        clips = [self.clip(name) for name in (_FRONT_CLIPS[:1] if self.quick else _FRONT_CLIPS)]
        return measure_front(front_settings(self.quick), clips, self._count(24, 72), self.relighters)

    def _budgets(self) -> Findings:
        clip = self.clip(HEADLINE)
        relighter, finest = (
            self.relighters.of(clip.probe, clip.camera, settings) for settings in (PRESETS["balanced"].relight, FINEST)
        )
        return measure_budgets(clip, _DEADLINE_S, relighter, finest, self.scratch)

    def _order(self, name: str) -> Findings:
        return measure_order(self.clip(name), 72, self.relighters)

    def _april_tags(self) -> Findings:
        # in a process of its own: the library may damage the memory of the one it runs in
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            measured = pool.submit(_measure_april_tags, self.clip(APRIL_TAGS.name), self._count(48, 96))
            try:
                return measured.result()
            except ImportError:
                return Findings(notes=["AprilTags were left out: install pupil-apriltags, as in arlight[bench]"])
            except BrokenProcessPool:
                return Findings(notes=["AprilTags were left out: pupil-apriltags ended its process"])

    def _memory(self) -> Findings:
        return measure_memory(self.clip(HEADLINE), (_SHORT_S, self.length_s), self.scratch)

    def _count(self, quick: int, full: int) -> int:
        return quick if self.quick else full


def _measure_april_tags(clip: FilmedClip, frames: int) -> Findings:
    return measure_tracking(clip, frames, AprilTagPose(clip.probe, clip.camera))


_GROWTH: dict[str, Callable[[Suite], Findings]] = {
    "the sheet's order": lambda suite: growth_part.grow_with_sheet_order(
        [suite.clip(f"720p order {order}") for order in range(1, 6)], 24, suite.relighters
    ),
    "the order asked for": lambda suite: growth_part.grow_with_order_setting(
        suite.clip(HEADLINE), 24, suite.relighters
    ),
    "the sheet's width": lambda suite: growth_part.grow_with_sheet_width(suite.frames_folder, 24, suite.relighters),
    "the picture's size": lambda suite: growth_part.grow_with_size(suite.frames_folder, 24, suite.relighters),
    "the object's faces": lambda suite: growth_part.grow_with_mesh(suite.clip(HEADLINE), 24, suite.relighters),
}
