"""The captured environments that come with arlight, by name."""

from pathlib import Path

from arlight.environment import Environment
from arlight.errors import EnvironmentMapError

_FOLDER = Path(__file__).parent / "environments"


def captured_names() -> tuple[str, ...]:
    """Names of the environments that come with arlight."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.hdr")))


def load_environment(name: str) -> Environment:
    """A captured environment.

    Args:
        name: a .hdr or .exr file, or a name from `captured_names`.

    Raises:
        EnvironmentMapError: there is neither such a file nor such a name, or the file cannot be used.
    """
    if name in captured_names():
        return Environment.load(_FOLDER / f"{name}.hdr")
    if not Path(name).is_file():
        raise EnvironmentMapError(
            f"{name}: no such environment; expected a latitude-longitude .hdr or .exr file, "
            f"or one of {', '.join(captured_names())}"
        )
    return Environment.load(name)
