from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import moderngl
import numpy as np
import pytest

from arlight.errors import RenderingUnavailableError
from arlight.gl import create_context, shader_source

SHADERS = Path(__file__).parent.parent / "shaders"


def colour_drawn(colour):
    """Clears a small buffer with a colour in a context of its own and reads it back."""
    try:
        context = create_context()
    except RenderingUnavailableError as error:
        pytest.skip(str(error))
    with context:
        buffer = context.framebuffer([context.renderbuffer((4, 3), 3, dtype="f4")])
        buffer.clear(*colour)
        drawn = np.frombuffer(buffer.read(components=3, dtype="f4"), np.float32).reshape(3, 4, 3)
    context.release()
    return drawn


def test_a_context_draws():
    np.testing.assert_allclose(colour_drawn((0.25, 0.5, 2.0)), np.broadcast_to([0.25, 0.5, 2.0], (3, 4, 3)))


def test_every_thread_has_a_context_of_its_own():
    colours = [(0.1 * i, 0.5, 1.0 - 0.1 * i) for i in range(6)]
    with ThreadPoolExecutor(3) as threads:
        for colour, drawn in zip(colours, threads.map(colour_drawn, colours), strict=True):
            np.testing.assert_allclose(drawn[1, 2], colour, rtol=1e-6)


def test_without_a_driver_the_message_says_what_to_install(monkeypatch):
    def fail(**_):
        raise Exception("libEGL.so.1 not loaded")

    monkeypatch.setattr(moderngl, "create_standalone_context", fail)
    with pytest.raises(
        RenderingUnavailableError, match=r"libEGL.so.1 not loaded.*apt-get install libegl1.*--renderer native"
    ):
        create_context()


@pytest.mark.parametrize("name", sorted(path.name for path in SHADERS.iterdir()))
def test_shaders_are_found(name):
    assert shader_source(name) == (SHADERS / name).read_text()


def test_a_missing_shader_is_named():
    with pytest.raises(RenderingUnavailableError, match=r"nothing\.frag is missing"):
        shader_source("nothing.frag")
