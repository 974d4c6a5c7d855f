"""Shared by the tests that draw: a headless OpenGL context, or the reason why there is none."""

import pytest

from arlight.errors import RenderingUnavailableError
from arlight.gl import create_context


@pytest.fixture(scope="session")
def needs_opengl():
    try:
        create_context().release()
    except RenderingUnavailableError as error:
        pytest.skip(f"no headless OpenGL through EGL: {error}")
