"""The files that belong to a clip: which sheet is in it, and which camera took it."""

from os import PathLike
from pathlib import Path
from typing import Literal

SidecarKind = Literal["probe", "camera", "calibration", "truth"]


def find_sidecar(clip: str | PathLike[str], kind: SidecarKind) -> Path | None:
    """The sidecar of a clip, None where there is none.

    `NAME.probe.json` beside `NAME.mp4` is for that clip alone; `probe.json` is for every clip in its folder.

    Args:
        clip: the video; it need not exist.
        kind: `probe`, `camera`, `calibration` or `truth`; a truth is only ever for one clip.
    """
    clip = Path(clip)
    own, shared = clip.with_name(f"{clip.stem}.{kind}.json"), clip.with_name(f"{kind}.json")
    candidates = [own] if kind == "truth" else [own, shared]
    return next((path for path in candidates if path.is_file()), None)
