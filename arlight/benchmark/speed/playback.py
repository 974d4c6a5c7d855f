"""A filmed workload in memory, to be played for as long as it takes."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from arlight.benchmark.speed.filming import CLIP_NAME, TRUTH_NAME, clip_folder
from arlight.benchmark.speed.workloads import FRAME_RATE, Workload
from arlight.camera import Camera
from arlight.probe.design import Probe
from arlight.probe.storage import load_probe
from arlight.synthetic.truth import FrameTruth, load_truth
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader

TURN = 8
"""Frames that each of those compared has in a row. Short, so that all see the same machine; frame by frame they would
throw each other's code and memory out of the processor's caches, which neither does to itself when it runs alone."""


@dataclass(frozen=True, slots=True, eq=False)
class FilmedClip:
    """The decoded frames of a workload and what is true of them."""

    workload: Workload
    """What was filmed."""
    path: Path
    """The clip; its sheet and camera are beside it."""
    probe: Probe
    """The sheet."""
    camera: Camera
    """The camera."""
    frames: tuple[Frame, ...]
    """One cycle, as decoded."""
    truth: tuple[FrameTruth, ...]
    """What is true of each frame of the cycle."""

    def played(self, count: int) -> Iterator[tuple[Frame, FrameTruth]]:
        """Frames in order with running numbers and times, cycle after cycle."""
        for index in range(count):
            place = index % len(self.frames)
            time_s = float(index / FRAME_RATE)
            yield replace(self.frames[place], index=index, time_s=time_s), self.truth[place]

    def turns(self, count: int) -> Iterator[list[tuple[Frame, FrameTruth]]]:
        """The same, `TURN` frames at a time."""
        frames = self.played(count)
        while turn := list(islice(frames, TURN)):
            yield turn


def load_clip(folder: Path, workload: Workload) -> FilmedClip:
    """Decode a workload that was filmed into the folder.

    Raises:
        ArlightError: the clip or what belongs to it is not there or damaged.
    """
    own = clip_folder(folder, workload)
    with VideoReader(own / CLIP_NAME) as reader:
        frames = tuple(reader)
    truth = load_truth(own / TRUTH_NAME)
    camera = Camera.load(own / "camera.json")
    return FilmedClip(workload, own / CLIP_NAME, load_probe(own / "probe.json"), camera, frames, truth.frames)
