import threading

import cv2
import numpy as np
import pytest
import trimesh
from PIL import Image

from arlight.gl import create_context
from arlight.rendering.draw import ObjectRenderer
from arlight.rendering.gloss import GLOSS_SIDE
from arlight.rendering.mesh import Mesh
from arlight.rendering.mesh_file import from_trimesh
from arlight.rendering.projection import View, project
from arlight.rendering.raster import RasterRenderer
from arlight.rendering.shadow import PlaneGrid, PlaneShadow
from arlight.rendering.transfer import Transfer

pytestmark = pytest.mark.usefixtures("gl")


def plain_transfer(mesh, radiance=1.0):
    """One coefficient: every vertex reflects `radiance` times it, and sees freely."""
    n = len(mesh.vertices_mm)
    openness = np.zeros((n, 9), np.float32)
    openness[:, 0] = 1.0 / 0.282095
    shadow = PlaneShadow(
        PlaneGrid((0.0, 0.0), 1.0, 2), np.zeros((4, 1), np.float32), np.ones(1, np.float32), np.ones((2, 2), np.float32)
    )
    return Transfer(np.full((n, 1), radiance, np.float32), openness, shadow)


def card(size_mm=60.0, colour=(0.9, 0.5, 0.2), height_mm=0.0):
    quad = trimesh.Trimesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    mesh = from_trimesh(quad)
    return Mesh(
        mesh.vertices_mm * size_mm / 2 + [0.0, 0.0, height_mm],
        mesh.normals,
        mesh.faces,
        np.tile(np.array(colour, np.float32), (4, 1)),
    )


@pytest.fixture(params=[RasterRenderer, ObjectRenderer])
def renderer_of(request):
    """Makes either renderer: what follows holds for both."""

    def make(mesh, mirrored=0.0, reflectance=0.0, supersampling=2, roughness=0.4):
        gloss = np.full((GLOSS_SIDE**2, 1), mirrored, np.float32)
        return request.param(mesh, plain_transfer(mesh), gloss, roughness, reflectance, supersampling)

    return make


def opengl_renderer_of(mesh):
    return ObjectRenderer(mesh, plain_transfer(mesh), np.zeros((GLOSS_SIDE**2, 1), np.float32), 0.4, 0.0)


def drawn(renderer, mesh, camera, pose, light=(1.0, 1.0, 1.0)):
    projected = project(camera, pose, mesh.vertices_mm)
    view = View(pose, projected, projected.region())
    return view.region, renderer.draw(view, np.array([light], np.float32)).copy()


def test_radiance_is_reflectance_times_light_and_covers_what_the_camera_sees(renderer_of, camera, pose):
    mesh = card()
    region, image = drawn(renderer_of(mesh), mesh, camera, pose, (1.0, 2.0, 4.0))
    assert image.shape == (region.size[1], region.size[0], 4)
    inside = image[..., 3] == 1.0
    assert np.allclose(image[inside][:, :3], [0.9, 1.0, 0.8], rtol=1e-5)
    area = cv2.contourArea(camera.project(pose, mesh.vertices_mm).astype(np.float32))
    assert image[..., 3].sum() == pytest.approx(area, rel=5e-3)
    # premultiplied: at the edge too, radiance is coverage times the colour
    assert np.allclose(image[..., :3], image[..., 3:] * [0.9, 1.0, 0.8], atol=1e-5)
    edge = (image[..., 3] > 0) & ~inside
    assert edge.any()


@pytest.mark.parametrize("which", ["camera", "lens_camera"])
def test_the_picture_lies_where_the_camera_model_puts_it(renderer_of, request, which, pose):
    camera = request.getfixturevalue(which)
    small = card(3.0)
    for place in ([0.0, 0.0, 0.0], [45.0, 25.0, 5.0], [-50.0, -30.0, 0.0]):
        mesh = Mesh(small.vertices_mm + place, small.normals, small.faces, small.base_colour)
        region, image = drawn(renderer_of(mesh, supersampling=8), mesh, camera, pose)
        weight = image[..., 3] / image[..., 3].sum()
        y, x = np.mgrid[region.y0 : region.y1, region.x0 : region.x1]
        middle = [np.sum(x * weight), np.sum(y * weight)]
        assert np.allclose(middle, camera.project(pose, [place])[0], atol=0.1)


def test_nearer_surfaces_cover_farther_ones(renderer_of, camera, pose):
    low, high = card(60.0, (1.0, 0.0, 0.0)), card(20.0, (0.0, 1.0, 0.0), 10.0)
    mesh = Mesh(
        np.concatenate([high.vertices_mm, low.vertices_mm]),
        np.concatenate([high.normals, low.normals]),
        np.concatenate([high.faces, low.faces + 4]),
        np.concatenate([high.base_colour, low.base_colour]),
    )
    region, image = drawn(renderer_of(mesh), mesh, camera, pose)
    x, y = np.rint(camera.project(pose, [[0.0, 0.0, 10.0]])[0]).astype(int)
    assert np.allclose(image[y - region.y0, x - region.x0], [0.0, 1.0, 0.0, 1.0])


def test_closed_and_open_meshes_show_the_same_outside(renderer_of, camera, pose):
    box = from_trimesh(trimesh.creation.box(extents=(30.0, 20.0, 10.0)))
    opened = Mesh(box.vertices_mm, box.normals, box.faces, box.base_colour, closed=False)
    assert box.closed
    images = [drawn(renderer_of(mesh), mesh, camera, pose)[1] for mesh in (box, opened)]
    assert images[0][..., 3].max() == 1.0
    assert np.allclose(images[0], images[1], atol=1e-6)


def test_gloss_keeps_the_energy_of_uniform_light(renderer_of, camera, pose):
    """A white varnished card in a white world stays white: what the varnish mirrors, the body does not get."""
    mesh = card(colour=(1.0, 1.0, 1.0))
    _, image = drawn(renderer_of(mesh, mirrored=1.0, reflectance=0.04), mesh, camera, pose)
    assert np.allclose(image[image[..., 3] == 1.0], 1.0, atol=1e-4)


def test_gloss_grows_toward_grazing_views(renderer_of, camera, looking_down):
    mesh = card(colour=(0.0, 0.0, 0.0))
    renderer = renderer_of(mesh, mirrored=1.0, reflectance=0.04)
    shares = []
    for angle in (20.0, 50.0, 70.0, 80.0):
        _, image = drawn(renderer, mesh, camera, looking_down(angle, 300.0))
        shares.append(image[image[..., 3] == 1.0][:, 0].mean())
    assert shares[0] == pytest.approx(0.04, abs=0.015)
    assert np.all(np.diff(shares) > 0)


def test_texture_is_upright_and_decoded(renderer_of, camera, looking_down):
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:4, 4:] = [188, 0, 0]
    pixels[4:, :4] = [0, 188, 0]
    quad = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    uv = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    quad.visual = trimesh.visual.TextureVisuals(uv=uv, image=Image.fromarray(pixels))
    mesh = from_trimesh(quad).placed(80.0)
    pose = looking_down(30.0, 300.0)
    region, image = drawn(renderer_of(mesh), mesh, camera, pose)
    for place, expected in (([20, 20, 0], [0.503, 0, 0]), ([-20, -20, 0], [0, 0.503, 0]), ([20, -20, 0], [0, 0, 0])):
        x, y = np.rint(camera.project(pose, [place])[0]).astype(int)
        assert np.allclose(image[y - region.y0, x - region.x0, :3], expected, atol=0.02)


def test_another_thread_is_refused(camera, pose):
    mesh = card()
    renderer = opengl_renderer_of(mesh)
    caught = []

    def attempt():
        try:
            drawn(renderer, mesh, camera, pose)
        except RuntimeError as error:
            caught.append(str(error))

    thread = threading.Thread(target=attempt)
    thread.start()
    thread.join()
    assert len(caught) == 1
    assert "thread" in caught[0]


def test_another_context_in_between_does_no_harm(camera, pose):
    mesh = card()
    renderer = opengl_renderer_of(mesh)
    _, before = drawn(renderer, mesh, camera, pose)
    other = create_context()
    _, after = drawn(renderer, mesh, camera, pose)
    other.release()
    assert np.array_equal(before, after)


def test_viewports_of_changing_size(renderer_of, camera, looking_down):
    mesh = card()
    renderer = renderer_of(mesh)
    for distance in (300.0, 150.0, 600.0):
        _, image = drawn(renderer, mesh, camera, looking_down(40.0, distance))
        expected = cv2.contourArea(camera.project(looking_down(40.0, distance), mesh.vertices_mm).astype(np.float32))
        assert image[..., 3].sum() == pytest.approx(expected, rel=0.01)
