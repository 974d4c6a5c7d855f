"""Headless OpenGL: one context to a thread, and the shaders that are shipped beside the package."""

from functools import cache
from pathlib import Path

import moderngl

from arlight.errors import RenderingUnavailableError

_PACKAGES = "libegl1 libgl1-mesa-dri"


def create_context() -> moderngl.Context:
    """A new headless context that belongs to the calling thread.

    Raises:
        RenderingUnavailableError: there is no EGL driver; says which packages to install.
    """
    try:
        return moderngl.create_standalone_context(require=330, backend="egl")  # type: ignore[arg-type]
    # moderngl and glcontext raise bare Exception when the library or a driver is missing
    except Exception as error:
        raise RenderingUnavailableError(
            f"headless OpenGL 3.3 through EGL is needed here and was not found ({error}); on Debian: apt-get install "
            f"{_PACKAGES}; relighting works without it by `--renderer native`"
        ) from error


@cache
def shader_source(name: str) -> str:
    """Text of a shader, such as "object.frag", from the installed package or the source tree."""
    for folder in (Path(__file__).parent / "shaders", Path(__file__).parent.parent / "shaders"):
        path = folder / name
        if path.is_file():
            return path.read_text()
    raise RenderingUnavailableError(f"the shader {name} is missing from this installation; reinstall arlight")
