"""Printers' resolutions."""

from typing import Literal, get_args

Dpi = Literal[300, 360, 600, 720, 1200]

RESOLUTIONS: tuple[Dpi, ...] = get_args(Dpi)
"""[dots per inch]."""
