"""The object that is drawn, where it stands and what draws it."""

from dataclasses import dataclass
from typing import Literal

from arlight.camera import Camera
from arlight.commands.options import OptionalFile
from arlight.errors import OutputError
from arlight.pipeline import FrameRelighter
from arlight.probe.design import Probe
from arlight.rendering.default_object import default_object
from arlight.rendering.relight import Relighter, RelightSettings
