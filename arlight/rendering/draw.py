"""Draws the lit object's own box of the frame, anti-aliased, as linear premultiplied radiance and coverage."""

import threading

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray

from arlight.gl import create_context, shader_source
from arlight.rendering.gloss import GLOSS_SIDE
from arlight.rendering.mesh import Mesh
from arlight.rendering.projection import View
from arlight.rendering.transfer import Transfer

Image = NDArray[np.float32]


class ObjectRenderer:
    """OpenGL state of one object. It belongs to the thread that made it and refuses the others."""

    def __init__(
        self,
        mesh: Mesh,
        transfer: Transfer,
        gloss_rows: NDArray[np.float32],
        roughness: float,
        normal_reflectance: float,
        supersampling: int = 2,
    ) -> None:
        """Upload the mesh.

        Args:
            mesh: placed, probe frame [mm].
            transfer: the mesh's own.
            gloss_rows: (side * side, m) of the octahedral map of lobe-averaged radiance.
            roughness: of the gloss, in [0.05, 1].
            normal_reflectance: Fresnel reflectance at normal incidence, 0 for a matte object.
            supersampling: samples along a pixel's side.

        Raises:
            RenderingUnavailableError: no headless OpenGL.
        """
        self._transfer, self._gloss_rows = transfer, gloss_rows
        self._thread = threading.get_ident()
        self.supersampling = supersampling
        self._closed = mesh.closed
        self._context = create_context()
        # the viewport's rows run downward, which turns every triangle's winding round
        self._context.front_face = "cw"
        self._program = self._compiled(mesh.textures is not None)
        self._set("roughness", roughness)
        self._set("normal_reflectance", normal_reflectance)
        self._set("gloss", 0)
        self._gloss = self._context.texture((GLOSS_SIDE, GLOSS_SIDE), 3, dtype="f4")
        self._gloss.repeat_x = self._gloss.repeat_y = False
        self._textures = self._upload_textures(mesh.textures) if mesh.textures is not None else None
        self._clip = self._context.buffer(reserve=16 * len(mesh.vertices_mm), dynamic=True)
        self._diffuse = self._context.buffer(reserve=12 * len(mesh.vertices_mm), dynamic=True)
        self._triangles = self._vertex_array(mesh)
        self._target: moderngl.Framebuffer | None = None

    def draw(self, view: View, packed: NDArray[np.float32]) -> Image:
        """One picture of the object.

        Args:
            view: where the camera sees it.
            packed: (m, 3) real-packed coefficients.

        Returns:
            (h, w, 4) linear radiance times coverage, and coverage, of the view's region.

        Raises:
            RuntimeError: called from another thread than the one that made it.
        """
        if threading.get_ident() != self._thread:
            raise RuntimeError("an OpenGL context belongs to its thread: draw from the thread that made the renderer")
        size = view.region.size
        width, height = size[0] * self.supersampling, size[1] * self.supersampling
        # others may have made their own context current in this thread
        with self._context:
            self._clip.write(view.projected.clip_coordinates(view.region))
            self._diffuse.write(np.ascontiguousarray(self._transfer.vertex_rows @ packed))
            self._gloss.write(np.ascontiguousarray(self._gloss_rows @ packed))
            self._set("eye_mm", tuple(float(v) for v in view.camera_from_probe.camera_centre_mm))
            target = self._target_of(width, height)
            target.use()
            target.viewport = (0, 0, width, height)
            self._context.enable_only(moderngl.DEPTH_TEST | (moderngl.CULL_FACE if self._closed else 0))
            target.clear(viewport=(0, 0, width, height))
            self._gloss.use(0)
            if self._textures is not None:
                self._textures.use(1)
            self._triangles.render()
            pixels = np.frombuffer(target.read((0, 0, width, height), 4, dtype="f4"), np.float32)
        # over a whole number of samples this is their plain mean
        return np.asarray(cv2.resize(pixels.reshape(height, width, 4), size, interpolation=cv2.INTER_AREA))

    def release(self) -> None:
        """Give the context back; the renderer cannot be used after."""
        self._context.release()

    def _compiled(self, textured: bool) -> moderngl.Program:
        return self._context.program(
            vertex_shader=_variant("object.vert", textured), fragment_shader=_variant("object.frag", textured)
        )

    def _vertex_array(self, mesh: Mesh) -> moderngl.VertexArray:
        """What changes with the frame in two buffers of their own, the rest in one."""
        textured = mesh.textures is not None
        names = ["position_mm", "normal", "base_colour", "openness_0", "openness_1", "openness_2"]
        names += ["texture_place"] * textured
        static = self._context.buffer(_static_attributes(mesh, self._transfer.openness))
        return self._context.vertex_array(
            self._program,
            [
                (self._clip, "4f", "clip"),
                (self._diffuse, "3f", "diffuse_radiance"),
                (static, " ".join(["3f"] * len(names)), *names),
            ],
            self._context.buffer(np.ascontiguousarray(mesh.faces, np.int32)),
        )

    def _set(self, name: str, value: object) -> None:
        # a driver drops uniforms whose value cannot matter
        if name in self._program:
            self._program[name] = value

    def _target_of(self, width: int, height: int) -> moderngl.Framebuffer:
        held = self._target
        if held is None or held.width < width or held.height < height:
            size = (max(width, held.width if held else 0), max(height, held.height if held else 0))
            self._target = self._context.framebuffer(
                self._context.renderbuffer(size, 4, dtype="f4"), self._context.depth_renderbuffer(size)
            )
            return self._target
        return held

    def _upload_textures(self, images: NDArray[np.uint8]) -> moderngl.TextureArray:
        self._set("base_texture", 1)
        layers, height, width = images.shape[:3]
        # row 0 of an OpenGL texture is v = 0, its bottom
        data = np.ascontiguousarray(images[:, ::-1])
        textures = self._context.texture_array((width, height, layers), 3, data, alignment=1)
        textures.build_mipmaps()
        return textures


def _variant(name: str, textured: bool) -> str:
    """The shader, compiled with or without its textured part: the test alone would cost a sixth of the drawing."""
    source = shader_source(name)
    return source.replace("#version 330\n", "#version 330\n#define TEXTURED\n", 1) if textured else source


def _static_attributes(mesh: Mesh, openness: NDArray[np.float32]) -> NDArray[np.float32]:
    columns = [mesh.vertices_mm, mesh.normals, mesh.base_colour, openness]
    if mesh.uv is not None and mesh.layer is not None:
        columns += [mesh.uv, mesh.layer[:, None]]
    return np.concatenate([np.asarray(c, np.float32) for c in columns], axis=1)
