"""What can be wrong with what the program was given.

Every message says what was expected, what was found, what to do.
"""


class ArlightError(Exception):
    """Base of every error that a user can mend; the command line prints its message and exits with status 1."""


class ProbeError(ArlightError):
    """A probe file or a probe design that cannot be used."""


class CameraError(ArlightError):
    """A camera file that cannot be used, or that does not fit the footage."""


class EnvironmentMapError(ArlightError):
    """A captured environment that cannot be used."""


class VideoError(ArlightError):
    """A video that cannot be read or written."""


class CalibrationError(ArlightError):
    """Footage that does not tell what was to be calibrated."""


class MeshError(ArlightError):
    """An object that cannot be lit."""


class OutputError(ArlightError):
    """An output that cannot be written, or that would destroy an input."""


class RenderingUnavailableError(ArlightError):
    """No headless OpenGL on this machine; estimation still works."""


class InstallationError(ArlightError):
    """A part of the program itself is missing."""
