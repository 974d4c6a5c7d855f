"""Builds the compiled parts: by itself, `python arlight/native/build.py`, or when the package is built."""

import os
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_FLAGS = [
    *["-std=gnu11", "-shared", "-fPIC", "-fvisibility=hidden", "-Wall", "-Wextra", "-O3"],
    # sums may be reordered and nothing asks for errno or traps; infinities and nan stay what they are
    *["-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-fassociative-math", "-ffp-contract=fast"],
    # vectors are passed between functions that are inlined, where no convention counts
    "-Wno-psabi",
]


class NativeBuildHook(BuildHookInterface[Any]):
    """Compiles every C file of the package beside itself and adds the libraries to the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Called by the builder before it collects files."""
        if self.target_name != "wheel":
            return
        build(Path(self.root) / "arlight")
        build_data["pure_python"] = False
        build_data["infer_tag"] = True
        build_data["artifacts"].append("arlight/**/lib*.so")


def build(package: Path) -> None:
    """Compile what is older than its source or than the shared headers.

    Raises:
        RuntimeError: there is no C compiler, or it refuses a source.
    """
    headers = max(header.stat().st_mtime for header in package.rglob("*.h"))
    for source in sorted(package.rglob("*.c")):
        library = source.with_name(f"lib{source.stem}.so")
        if library.exists() and library.stat().st_mtime > max(source.stat().st_mtime, headers):
            continue
        _compile(source, library, package / "native")


def _compile(source: Path, library: Path, headers: Path) -> None:
    # a library that is in use is replaced, never written into
    fresh = library.with_suffix(f".{os.getpid()}")
    command = [*shlex.split(os.environ.get("CC", "cc")), *_FLAGS, f"-I{headers}", str(source), "-o", str(fresh), "-lm"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        raise RuntimeError(f"{command[0]}: no C compiler ({error}); install gcc or name another in CC") from error
    if done.returncode != 0:
        raise RuntimeError(f"{source} does not compile:\n{done.stderr}")
    if done.stderr:
        sys.stderr.write(done.stderr)
    fresh.replace(library)


if __name__ == "__main__":
    build(Path(__file__).parents[1])
