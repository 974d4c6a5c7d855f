"""The lit sheet on its table as a camera sees it, in linear radiance, drawn by OpenGL."""

from typing import Literal, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.environment import Environment
from arlight.gl import create_context, shader_source
from arlight.optics import Slab
from arlight.synthetic.sheet import SheetLayers, sharpen_for_bilinear
from arlight.synthetic.transport import IrradianceMap

Slot = Literal["first", "second"]

TABLE_REFLECTANCE = (0.36, 0.27, 0.2)

_UNITS = {
    "ray_map": 0,
    "first_environment": 1,
    "second_environment": 2,
    "film": 3,
    "paper": 4,
    "frame": 5,
    "first_irradiance": 6,
    "second_irradiance": 7,
}


class Sampling(NamedTuple):
    """How finely a pixel is sampled."""

    spacing_mm: float = 0.13
    """Largest distance of neighbouring samples on the sheet [mm]; well below the finest stripe."""
    least_per_side: int = 3
    """Samples along a pixel's side even where that is finer than needed: smoothness of edges."""


class SheetRenderer:
    """Draws one sheet for one camera. Belongs to the thread that makes it, as its OpenGL context does."""

    def __init__(self, layers: SheetLayers, slab: Slab, camera: Camera, sampling: Sampling | None = None) -> None:
        """
        Args:
            layers: the printed sheet.
            slab: the glass between film and paper.
            camera: image size, intrinsics and lens distortion.
            sampling: how finely a pixel is sampled.

        Raises:
            RenderingUnavailableError: there is no headless OpenGL.
        """
        self._camera = camera
        self._sampling = sampling or Sampling()
        self._size_mm = layers.size_mm
        self._texel_mm = 1.0 / layers.pixels_per_mm
        self._context = create_context()
        self._target = self._context.framebuffer([self._context.texture(camera.image_size, 4, dtype="f4")])
        self._textures = {"ray_map": self._texture(camera.ray_map, filtered=False)}
        self._upload_layers(layers)
        self._table, self._sheet = self._program("table.frag"), self._program("sheet.frag")
        self._vertices = self._context.buffer(reserve=8 * 256, dynamic=True)
        self._table_array, self._sheet_array = (
            self._context.vertex_array(program, [(self._vertices, "2f", "position_px")])
            for program in (self._table, self._sheet)
        )
        self._set(sheet_mm=self._size_mm, glass_mm=slab.glass_mm, refractive_index=slab.refractive_index)
        self._set(table_z_mm=-slab.glass_mm, table_reflectance=TABLE_REFLECTANCE, image_size_px=camera.image_size)
        self._open_irradiance: dict[Slot, NDArray[np.float64]] = {}

    def set_light(self, slot: Slot, environment: Environment, irradiance: IrradianceMap) -> None:
        """Put a light into one of the two slots between which `render` cross-fades.

        Args:
            slot: `first` or `second`; both must be set before the share is above 0.
            environment: what is mirrored and lights frame and table.
            irradiance: of the paper under that environment.
        """
        rows, columns = irradiance.irradiance.shape[:2]
        texel = irradiance.texel_mm
        corner = (irradiance.first_mm[0] - texel / 2, irradiance.first_mm[1] + texel / 2)
        self._replace(f"{slot}_environment", environment.radiance, repeat_x=True)
        self._replace(f"{slot}_irradiance", sharpen_for_bilinear(irradiance.irradiance))
        self._set(irradiance_first_mm=corner, irradiance_size_mm=(columns * texel, rows * texel))
        self._set(**{f"{slot}_yaw_rad": environment.yaw_rad})
        self._open_irradiance[slot] = environment.irradiance()

    def render(self, pose: Pose, share: float = 0.0) -> NDArray[np.float32]:
        """Linear radiance (h, w, 3), averaged over every pixel's square, no lens blur.

        Args:
            pose: camera_from_probe [mm]; the camera stands above the sheet.
            share: 0 for the first light, 1 for the second, their linear mixture between.
        """
        first = self._open_irradiance["first"]
        light = first if share == 0.0 else (1.0 - share) * first + share * self._open_irradiance["second"]
        samples, spacing_mm = self._samples(pose)
        self._set(
            share=share,
            open_irradiance=light,
            # columns of the uniform are rows of the array: this passes the transpose of camera_from_probe
            probe_from_camera=np.ascontiguousarray(pose.rotation).ravel(),
            camera_centre_mm=pose.camera_centre_mm,
            samples=samples,
            frame_level=max(0.0, float(np.log2(spacing_mm / self._texel_mm))),
        )
        for name, unit in _UNITS.items():
            if name in self._textures:
                self._textures[name].use(unit)
        self._target.use()
        self._context.disable(moderngl.BLEND)
        width, height = self._camera.image_size
        self._draw(self._table_array, [(-1, -1), (width, -1), (width, height), (-1, height)])
        self._context.enable(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        self._draw(self._sheet_array, self._outline_px(pose))
        pixels = np.frombuffer(self._target.read(components=3, dtype="f4"), np.float32)
        return pixels.reshape(height, width, 3)

    def release(self) -> None:
        """Free the OpenGL context and all that belongs to it."""
        self._context.release()

    def _draw(self, array: moderngl.VertexArray, polygon_px: object) -> None:
        vertices = np.ascontiguousarray(polygon_px, np.float32)
        self._vertices.write(vertices.tobytes())
        array.render(moderngl.TRIANGLE_FAN, vertices=len(vertices))

    def _border_mm(self) -> NDArray[np.float64]:
        """Points (n, 3) around the sheet's edge, close enough that a distorted edge is straight between them."""
        along = np.linspace(-0.5, 0.5, 16, endpoint=False)
        half = np.full_like(along, 0.5)
        sides = [(along, half), (half, -along), (-along, -half), (-half, along)]
        return np.concatenate([np.stack([x * self._size_mm[0], y * self._size_mm[1], 0 * x], -1) for x, y in sides])

    def _outline_px(self, pose: Pose) -> NDArray[np.float64]:
        outline = self._camera.project(pose, self._border_mm())
        outward = outline - outline.mean(axis=0)
        return outline + 3.0 * outward / np.linalg.norm(outward, axis=1, keepdims=True)

    def _samples(self, pose: Pose) -> tuple[tuple[int, int], float]:
        """Samples per pixel across and down, and their distance on the sheet [mm] where they lie farthest apart."""
        grid = np.stack(np.meshgrid([-0.5, 0.0, 0.5], [-0.5, 0.0, 0.5]), -1).reshape(-1, 2) * self._size_mm
        points = np.concatenate([grid, np.zeros((9, 1))], axis=1)
        step = 0.5
        centre = self._camera.project(pose, points)
        jacobian = np.stack(
            [(self._camera.project(pose, points + shift) - centre) / step for shift in np.eye(3)[:2] * step], axis=-1
        )
        mm_per_px = np.linalg.norm(np.linalg.inv(jacobian), axis=1).max(axis=0)
        least = self._sampling.least_per_side
        count = np.clip(np.ceil(mm_per_px / self._sampling.spacing_mm), least, 32).astype(int)
        return (int(count[0]), int(count[1])), float(np.max(mm_per_px / count))

    def _upload_layers(self, layers: SheetLayers) -> None:
        self._textures["film"] = self._texture(sharpen_for_bilinear(layers.film))
        self._textures["paper"] = self._texture(sharpen_for_bilinear(layers.paper))
        self._textures["frame"] = self._texture(np.stack([layers.frame, layers.opening], axis=-1))
        self._textures["frame"].build_mipmaps()
        self._textures["frame"].filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)

    def _replace(self, name: str, image: NDArray[np.float32], repeat_x: bool = False) -> None:
        if name in self._textures:
            self._textures[name].release()
        self._textures[name] = self._texture(image)
        self._textures[name].repeat_x = repeat_x

    def _texture(self, image: NDArray[np.float32], filtered: bool = True) -> moderngl.Texture:
        pixels = np.ascontiguousarray(image, np.float32)
        channels = 1 if pixels.ndim == 2 else pixels.shape[2]
        texture = self._context.texture(pixels.shape[1::-1], channels, pixels.tobytes(), dtype="f4", alignment=4)
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR) if filtered else (moderngl.NEAREST, moderngl.NEAREST)
        texture.repeat_x = texture.repeat_y = False
        return texture

    def _program(self, fragment: str) -> moderngl.Program:
        program = self._context.program(
            vertex_shader=shader_source("pixels.vert"),
            fragment_shader=shader_source("distant_light.glsl") + shader_source(fragment),
        )
        for name, unit in _UNITS.items():
            if name in program:
                program[name] = unit
        return program

    def _set(self, **uniforms: object) -> None:
        """Set uniforms in the programs that have them."""
        for name, value in uniforms.items():
            for program in (self._table, self._sheet):
                if name in program:
                    program[name] = tuple(value) if isinstance(value, np.ndarray) else value
