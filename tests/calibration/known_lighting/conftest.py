"""A misassembled sheet of order 2 under procedural lights, drawn from warped rasters: no closed form of ours in it."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.calibration.layers.view_measurement import SeenSheet
from arlight.camera import Camera, Pose
from arlight.environment import Environment
from arlight.errors import RenderingUnavailableError
from arlight.probe.assembly import Assembly, Print, Registration
from arlight.probe.design import Block, Probe
from arlight.probe.layout import design_probe
from arlight.probe.patterns import block_pixels
from arlight.probe.rasters import Rasters, render_rasters
from arlight.synthetic.renderer import Sampling, SheetRenderer
from arlight.synthetic.sensor import Sensor
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.transport import LightTransport
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.pose import ProbePose
from arlight.video.frame import Frame

ASSEMBLY = Assembly(
    Print(Registration((0.15, -0.12), 0.25), 0.05, 0.05, 0.01),
    Print(Registration((-0.1, 0.2), -0.2), 0.08, 0.08, 0.03),
    1.015,
)
GAIN, PHASE_DEG, MODULATION = 0.92, 12.0, 0.85
LIGHTINGS = 3
VIEWS = ((28.0, -100.0), (45.0, -60.0))
"""Tilt and azimuth of the camera [deg]."""
OFFSETS_DEG = (5.0, 20.0)
"""How far the further views of the first lighting lie beside the first view."""


@dataclass(frozen=True)
class LitSheet:
    """Frames of one sheet under known lights, and its truth."""

    probe: Probe
    camera: Camera
    assembly: Assembly
    lights: list[KnownLight]
    seen: list[SeenSheet]
    beside: list[SeenSheet]
    spoilt: dict[str, tuple[int, float]]
    """Place in the field and true correction of the blocks that were spoilt."""


def environment(seed: int) -> Environment:
    """Coloured sky with a few broad lamps."""
    generator = np.random.default_rng(seed)
    rows, columns = 32, 64
    theta = (np.arange(rows)[:, None] + 0.5) * np.pi / rows
    phi = (np.arange(columns)[None] + 0.5) * 2 * np.pi / columns
    w = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1)
    radiance = np.full((rows, columns, 3), 0.05) * generator.uniform(0.7, 1.3, 3)
    for _ in range(3):
        cosine, azimuth = generator.uniform(0.3, 0.95), generator.uniform(0, 2 * np.pi)
        sine = np.sqrt(1 - cosine**2)
        toward = np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])
        lamp = np.exp((w @ toward - 1) * generator.uniform(12, 40))
        radiance += lamp[..., None] * generator.uniform(0.4, 1.5) * generator.uniform(0.85, 1.15, 3)
    made = Environment(radiance.astype(np.float32))
    return made.scaled(0.55 * np.pi / 0.9 / made.irradiance().max())


def laid(raster: np.ndarray, made: Print, pixels_per_mm: float) -> np.ndarray:
    """A raster as printed and laid: dot gain, blur, then the pixels moved."""
    printed = gaussian_filter(made.tone(raster), made.blur_mm * pixels_per_mm, mode="nearest").astype(np.float32)
    rows, columns = raster.shape
    x, y = np.meshgrid(np.arange(columns) - (columns - 1) / 2, (rows - 1) / 2 - np.arange(rows))
    design = made.registration.design_points(np.stack([x, y], axis=-1) / pixels_per_mm) * pixels_per_mm
    across, down = design[..., 0] + (columns - 1) / 2, (rows - 1) / 2 - design[..., 1]
    warped = cv2.remap(
        printed, across.astype(np.float32), down.astype(np.float32), cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    return np.clip(warped, 0, 1)


def spoilt_blocks(probe: Probe) -> tuple[Block, Block, Block]:
    """Patterned blocks whose gain, phase and modulation are wrong."""
    patterned = [block for block in probe.blocks if block.kind == "pattern"]
    return patterned[3], patterned[9], patterned[14]


def layers_of(probe: Probe) -> SheetLayers:
    """The assembled layers, three blocks of the paper spoilt."""
    dimmed, shifted, faded = spoilt_blocks(probe)
    blocks = [
        replace(block, phase_deg=block.phase_deg + PHASE_DEG) if block is shifted else block for block in probe.blocks
    ]
    rasters = render_rasters(replace(probe, blocks=tuple(blocks)))
    paper = rasters.paper.copy()
    paper[block_pixels(probe, dimmed)] *= GAIN
    place = block_pixels(probe, faded)
    paper[place] = 0.5 + MODULATION * (paper[place] - 0.5)
    scale = probe.pixels_per_mm
    film, paper = laid(rasters.film, ASSEMBLY.film, scale), laid(paper, ASSEMBLY.paper, scale)
    return SheetLayers.from_rasters(probe, Rasters(film, paper, rasters.frame, rasters.window))


def pose_from(tilt_deg: float, azimuth_deg: float) -> Pose:
    """A camera that looks at the sheet's centre from 230 mm."""
    tilt, azimuth = np.deg2rad([tilt_deg, azimuth_deg])
    toward = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    return Pose(np.stack([right, np.cross(-toward, right), -toward]), np.array([0.0, 0.0, 230.0]))


@pytest.fixture(scope="session")
def lit_sheet() -> LitSheet:
    probe = design_probe(order=2, pixels_per_mm=12)
    camera = Camera((460, 440), np.array([[660.0, 0, 229.5], [0, 660.0, 219.5], [0, 0, 1]]), np.zeros(5))
    layers, slab = layers_of(probe), ASSEMBLY.slab(probe)
    transport = LightTransport(layers, slab)
    sensor, generator = Sensor(blur_px=0.6, read_noise=0.0008, gain=1e-5), np.random.default_rng(5)
    try:
        renderer = SheetRenderer(layers, slab, camera, Sampling(0.2, 3))
    except RenderingUnavailableError as error:
        pytest.skip(f"no headless OpenGL through EGL: {error}")
    lights, seen, beside = [], [], []

    def shot(pose: Pose, light: int) -> SeenSheet:
        image = sensor.expose(renderer.render(pose), camera, generator)
        return SeenSheet(Frame.from_rgb(image), ProbePose(pose, 0.1, "tracked", 0.6, 4), light)

    for light in range(LIGHTINGS):
        known = environment(20 + light)
        lights.append(KnownLight(f"light{light}", known, probe.refractive_index))
        renderer.set_light("first", known, transport.irradiance(known))
        seen += [shot(pose_from(*view), light) for view in VIEWS]
        if light == 0:
            tilt, azimuth = VIEWS[0]
            beside += [shot(pose_from(tilt + offset, azimuth), light) for offset in OFFSETS_DEG]
    renderer.release()
    place = {block.id: number for number, block in enumerate(field_blocks(probe))}
    kinds = (("gain", GAIN), ("phase_deg", PHASE_DEG), ("modulation", MODULATION))
    spoilt = {kind: (place[block.id], value) for block, (kind, value) in zip(spoilt_blocks(probe), kinds, strict=True)}
    return LitSheet(probe, camera, ASSEMBLY, lights, seen, beside, spoilt)
