"""The part of the proof that travels with the code: a clip of each path, and known lights with their views."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

from arlight.errors import OutputError
from arlight.validation.proof_lights import KNOWN_LIGHTS

SHIPPED_CLIPS = ("orbit-hall", "dive-sunset", "hand-forest")
"""One of each path, each under another light."""
_SHARED = ("coefficients_re", "coefficients_im", "exposure")


def ship(folder: Path, target: Path, clips: Sequence[str] = SHIPPED_CLIPS) -> list[Path]:
    """Copy clips, the known-light set, its lights and the block means; truths say once what holds for all frames.

    Args:
        folder: where `trace_proof` wrote, or block means lie.
        target: made where it does not exist.
        clips: names beside those of the known lights.

    Returns:
        What was written.

    Raises:
        OutputError: something is missing or cannot be written.
    """
    known = [f"known-{name}" for name in KNOWN_LIGHTS]
    names = ["probe.json", "camera.json", "assembly.json"]
    names += [f"{clip}.mp4" for clip in (*clips, *known)] + [f"lights/{name}.hdr" for name in KNOWN_LIGHTS]
    try:
        (target / "lights").mkdir(parents=True, exist_ok=True)
        written = [Path(shutil.copyfile(folder / name, target / name)) for name in names]
        for responses in sorted(folder.glob("responses-*.npz")):
            written.append(Path(shutil.copyfile(responses, target / responses.name)))
        for clip in (*clips, *known):
            written.append(target / f"{clip}.truth.json")
            _copy_truth(folder / f"{clip}.truth.json", written[-1])
    except OSError as error:
        raise OutputError(f"{error.filename}: cannot be copied ({error.strerror}); trace the clips first") from error
    return written


def _copy_truth(source: Path, target: Path) -> None:
    """Move what is the same in all frames to the top, where readers look for it too."""
    content = json.loads(source.read_text(encoding="utf-8"))
    frames = content["frames"]
    for key in _SHARED:
        if all(frame[key] == frames[0][key] for frame in frames):
            content[key] = frames[0][key]
            for frame in frames[1:]:
                del frame[key]
            del frames[0][key]
    target.write_text(json.dumps(content) + "\n", encoding="utf-8")
