"""Light virtual objects in footage with the light that is really there, measured from a printed sheet."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from arlight.camera import Camera as Camera
    from arlight.camera import Pose as Pose
    from arlight.environment import Environment as Environment
    from arlight.errors import ArlightError as ArlightError
    from arlight.estimation.lighting import Lighting as Lighting
    from arlight.lighting_tracker import FrameEstimate as FrameEstimate
    from arlight.lighting_tracker import LightingTracker as LightingTracker
    from arlight.lighting_tracker import TrackerSettings as TrackerSettings
    from arlight.pipeline import FrameResult as FrameResult
    from arlight.pipeline import Pipeline as Pipeline
    from arlight.probe.design import Probe as Probe
    from arlight.probe.storage import load_probe as load_probe
    from arlight.rendering.relight import Relighter as Relighter
    from arlight.rendering.settings import RelightSettings as RelightSettings
    from arlight.results.log import read_log as read_log
    from arlight.video.frame import Frame as Frame
    from arlight.video.reader import VideoReader as VideoReader
    from arlight.video.writer import VideoWriter as VideoWriter

# what the package offers, and the module each name lives in: loaded when first asked for, so that a program which
# only estimates loads no renderer
_PUBLIC = {
    "ArlightError": "arlight.errors",
    "Camera": "arlight.camera",
    "Environment": "arlight.environment",
    "Frame": "arlight.video.frame",
    "FrameEstimate": "arlight.lighting_tracker",
    "FrameResult": "arlight.pipeline",
    "Lighting": "arlight.estimation.lighting",
    "LightingTracker": "arlight.lighting_tracker",
    "Pipeline": "arlight.pipeline",
    "Pose": "arlight.camera",
    "Probe": "arlight.probe.design",
    "RelightSettings": "arlight.rendering.settings",
    "Relighter": "arlight.rendering.relight",
    "TrackerSettings": "arlight.lighting_tracker",
    "VideoReader": "arlight.video.reader",
    "VideoWriter": "arlight.video.writer",
    "load_probe": "arlight.probe.storage",
    "read_log": "arlight.results.log",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> object:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'arlight' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_PUBLIC])
