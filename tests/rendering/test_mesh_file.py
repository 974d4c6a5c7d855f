import numpy as np
import pytest
import trimesh
from PIL import Image

from arlight.errors import MeshError
from arlight.rendering.mesh_file import load_mesh


def written(folder, name, mesh):
    mesh.export(folder / name)
    return folder / name


def textured_quad(image):
    quad = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    uv = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    quad.visual = trimesh.visual.TextureVisuals(uv=uv, image=image)
    return quad


@pytest.mark.parametrize("name", ["box.stl", "box.ply", "box.obj", "box.glb", "box.off"])
def test_every_format_gives_the_same_box(tmp_path, name):
    mesh = load_mesh(written(tmp_path, name, trimesh.creation.box(extents=(1.0, 2.0, 3.0))), up="z")
    assert np.allclose(mesh.extent_mm, [1.0, 2.0, 3.0])
    assert mesh.closed
    assert mesh.textures is None
    # a box has six flat sides: nothing is smoothed across its edges
    assert np.allclose(np.abs(mesh.normals).max(axis=1), 1.0)


def test_axis_that_is_up_follows_the_format_or_the_caller(tmp_path):
    tall = trimesh.creation.box(extents=(1.0, 5.0, 1.0))
    assert np.argmax(load_mesh(written(tmp_path, "a.glb", tall)).extent_mm) == 2
    assert np.argmax(load_mesh(written(tmp_path, "a.stl", tall)).extent_mm) == 1
    assert np.argmax(load_mesh(written(tmp_path, "a.stl", tall), up="y").extent_mm) == 2


def test_a_sphere_is_smooth_though_its_file_has_separate_faces(tmp_path):
    mesh = load_mesh(written(tmp_path, "ball.stl", trimesh.creation.icosphere(subdivisions=3)))
    outward = mesh.vertices_mm / np.linalg.norm(mesh.vertices_mm, axis=1, keepdims=True)
    assert np.sum(mesh.normals * outward, axis=1).min() > np.cos(np.radians(2.0))


def test_coarse_faces_are_divided_and_fine_ones_merged(tmp_path):
    coarse = load_mesh(written(tmp_path, "box.ply", trimesh.creation.box()))
    assert 1000 < len(coarse.vertices_mm) <= 20_000
    fine = load_mesh(written(tmp_path, "ball.ply", trimesh.creation.icosphere(subdivisions=5)), max_vertices=2000)
    assert 1000 < len(fine.vertices_mm) <= 2000
    radius = np.linalg.norm(fine.vertices_mm, axis=1)
    assert radius.min() > 0.98
    assert np.sum(fine.normals * fine.vertices_mm / radius[:, None], axis=1).min() > 0.98


def test_vertex_colours_are_kept_in_linear_light(tmp_path):
    box = trimesh.creation.box()
    box.visual.vertex_colors = np.tile(np.array([188, 55, 0, 255], np.uint8), (8, 1))
    mesh = load_mesh(written(tmp_path, "box.ply", box))
    # sRGB 188 is half of full scale in linear light, 55 a twenty-fifth
    assert np.allclose(mesh.base_colour, [0.503, 0.038, 0.0], atol=2e-3)


def test_textures_keep_their_place_through_a_file(tmp_path):
    image = np.zeros((8, 8, 3), np.uint8)
    image[:4, :, 0] = 255
    mesh = load_mesh(written(tmp_path, "quad.glb", textured_quad(Image.fromarray(image))), up="z")
    assert mesh.textures.shape[0] == 1
    top = mesh.vertices_mm[:, 1] > 0.99
    # v is up and row 0 of the image is its top
    rows = ((1.0 - mesh.uv[top, 1]) * (mesh.textures.shape[1] - 1)).round().astype(int)
    assert np.all(mesh.textures[0, rows, 100, 0] == 255)


def test_a_scene_becomes_one_mesh_with_a_layer_per_picture(tmp_path):
    scene = trimesh.Scene()
    for i, colour in enumerate(((255, 0, 0), (0, 255, 0), (255, 0, 0))):
        part = textured_quad(Image.new("RGB", (4, 4), colour))
        scene.add_geometry(part, transform=trimesh.transformations.translation_matrix([2.0 * i, 0, 0]))
    plain = trimesh.creation.box()
    scene.add_geometry(plain, transform=trimesh.transformations.translation_matrix([0, 5, 0]))
    scene.export(tmp_path / "scene.glb")
    mesh = load_mesh(tmp_path / "scene.glb", up="z")
    assert np.allclose(mesh.extent_mm[:2], [5.5, 5.5])
    left = mesh.vertices_mm[:, 0] < mesh.vertices_mm[:, 0].min() + 1.4
    seen = {tuple(mesh.textures[int(layer), 2, 2]) for layer in mesh.layer[left & (mesh.vertices_mm[:, 1] < 1.1)]}
    assert seen == {(255, 0, 0)}
    assert len(mesh.textures) == 3


BROKEN = {
    "junk.glb": (b"glTFjunk", "could not be read"),
    "empty.stl": (b"", "no faces|could not be read"),
    "nan.obj": (b"v 0 0 0\nv nan 0 1\nv 1 1 0\nf 1 2 3\n", "not finite"),
    "flat.obj": (b"v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n", "degenerate"),
    "outside.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "could not be read|damaged"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces|could not be read"),
    "object.xyzzy": (b"hello", "unknown format"),
    "object": (b"hello", "unknown format"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_are_refused_by_name(tmp_path, name):
    content, said = BROKEN[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeshError, match=said) as caught:
        load_mesh(tmp_path / name)
    assert name in str(caught.value)


def test_missing_file_and_folder_are_refused(tmp_path):
    for path in (tmp_path / "none.glb", tmp_path):
        with pytest.raises(MeshError, match="no such file"):
            load_mesh(path)


def test_a_mesh_cut_short_is_refused(tmp_path):
    path = written(tmp_path, "ball.glb", trimesh.creation.icosphere())
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(MeshError, match="could not be read"):
        load_mesh(path)
