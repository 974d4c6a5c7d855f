import threading
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from arlight.effort import Effort
from arlight.errors import ProbeError
from arlight.rendering.default_object import default_object
from arlight.rendering.mesh import Mesh
from arlight.rendering.mesh_file import from_trimesh
from arlight.rendering.relight import Relighter
from arlight.rendering.settings import RelightSettings
from arlight.synthetic.captured import load_environment
from arlight.video.frame import Frame

pytestmark = pytest.mark.usefixtures("gl")

QUICK = RelightSettings(directions=96, shadow_texels=48)


def frame_of(value=128, size=(320, 240)):
    rng = np.random.default_rng(8)
    image = rng.integers(value - 20, value + 20, (size[1], size[0], 3)).astype(np.uint8)
    return Frame.from_rgb(image)


@pytest.fixture(scope="module")
def relighter(probe, camera):
    return Relighter(default_object(), probe, camera, QUICK)


@pytest.mark.parametrize("name", ["apartment", "bridge", "hall"])
def test_a_white_matte_card_has_the_radiance_of_the_paper(probe, camera, pose, lighting_of, name):
    """The paper's frame reflects 0.9/pi of the environment's own irradiance; the card is lit by coefficients only."""
    environment = load_environment(name).scaled(0.2)
    plate = from_trimesh(trimesh.creation.box(extents=(40.0, 40.0, 0.3)))
    white = replace(plate, base_colour=np.full_like(plate.base_colour, 0.9))
    settings = RelightSettings(size_mm=40.0, normal_reflectance=0.0, directions=96, shadow_texels=32)
    relighter = Relighter(white, probe, camera, settings)
    region, image = relighter.draw_object(pose, lighting_of(environment))
    x, y = np.rint(camera.project(pose, [[0.0, 0.0, 0.3]])[0]).astype(int)
    card = image[y - region.y0 - 4 : y - region.y0 + 5, x - region.x0 - 4 : x - region.x0 + 5]
    assert np.all(card[..., 3] == 1.0)
    paper = 0.9 / np.pi * environment.irradiance()
    assert np.allclose(card[..., :3].mean(axis=(0, 1)), paper, rtol=0.02)


def test_the_card_s_radiance_reaches_the_frame(probe, camera, pose, lighting_of):
    environment = load_environment("bridge")
    environment = environment.scaled(0.5 * np.pi / environment.irradiance().max())
    plate = from_trimesh(trimesh.creation.box(extents=(40.0, 40.0, 0.3)))
    white = replace(plate, base_colour=np.full_like(plate.base_colour, 0.9))
    settings = RelightSettings(size_mm=40.0, normal_reflectance=0.0, directions=96, shadow_texels=32)
    relighter = Relighter(white, probe, camera, settings)
    lighting = lighting_of(environment)
    relit = relighter.render(frame_of(), pose, lighting)
    _, image = relighter.draw_object(pose, lighting)
    x, y = np.rint(camera.project(pose, [[0.0, 0.0, 0.3]])[0]).astype(int)
    region, _ = relighter.draw_object(pose, lighting)
    # 8-bit sRGB: half a level is 0.4 % here
    assert np.allclose(relit.linear_rgb()[y, x], image[y - region.y0, x - region.x0, :3], rtol=0.006)


def test_only_the_object_and_its_shadow_change(relighter, pose, lighting_of, environment):
    frame = frame_of()
    lighting = lighting_of(environment)
    relit = relighter.render(frame, pose, lighting)
    assert relit.size == frame.size
    before, after = frame.linear_rgb(), relit.linear_rgb()
    region, image = relighter.draw_object(pose, lighting)
    covered = np.zeros(before.shape[:2], bool)
    covered[region.y0 : region.y1, region.x0 : region.x1] = image[..., 3] > 0
    assert np.all(after[~covered] <= before[~covered] + 1e-6)
    # far from the object nothing is touched, bit by bit
    far = np.zeros(before.shape[:2], bool)
    far[:10], far[:, :20], far[:, -20:] = True, True, True
    for mine, theirs in zip(relit.planes, frame.planes, strict=True):
        assert np.array_equal(mine[far], theirs[far])
    shaded = (after < before - 0.01).all(axis=2) & ~covered
    assert np.count_nonzero(shaded) > 200


def test_without_its_shadow_the_object_is_the_same(relighter, pose, lighting_of, environment):
    frame, lighting = frame_of(), lighting_of(environment)
    whole = relighter.render(frame, pose, lighting).encoded_rgb()
    bare = relighter.render(frame, pose, lighting, Effort(shadow=False)).encoded_rgb()
    region, drawn = relighter.draw_object(pose, lighting)
    inside = np.zeros(whole.shape[:2], bool)
    inside[region.y0 : region.y1, region.x0 : region.x1] = drawn[..., 3] == 1.0
    # chroma at the outline is shared with what lies beside it
    solid = inside & np.roll(inside, 4, 0) & np.roll(inside, -4, 0) & np.roll(inside, 4, 1) & np.roll(inside, -4, 1)
    assert np.count_nonzero(solid) > 100
    np.testing.assert_allclose(bare[solid], whole[solid], atol=1e-3)
    changed = np.any(bare != frame.encoded_rgb(), axis=2)
    assert not np.any(changed[: region.y0 - 2])
    assert np.count_nonzero(np.any(whole != frame.encoded_rgb(), axis=2)) > np.count_nonzero(changed)


def test_the_input_frame_stays_as_it_was(relighter, pose, lighting_of, environment):
    frame = frame_of()
    copies = [plane.copy() for plane in frame.planes]
    relighter.render(frame, pose, lighting_of(environment))
    assert all(np.array_equal(plane, copy) for plane, copy in zip(frame.planes, copies, strict=True))


def test_no_pose_or_no_light_leaves_the_frame(relighter, pose, lighting_of, environment):
    frame = frame_of()
    assert relighter.render(frame, None, lighting_of(environment)) is frame
    assert relighter.render(frame, pose, None) is frame


def test_a_sheet_out_of_the_picture_leaves_the_frame(relighter, pose, lighting_of, environment):
    frame = frame_of()
    aside = replace(pose, translation=pose.translation + [4000.0, 0.0, 0.0])
    assert relighter.render(frame, aside, lighting_of(environment)) is frame


@pytest.mark.parametrize("shift", [(110.0, 0.0), (0.0, 85.0), (-100.0, -80.0)])
def test_an_object_half_out_of_the_picture_is_cut_at_its_edge(relighter, camera, pose, lighting_of, environment, shift):
    frame, lighting = frame_of(), lighting_of(environment)
    aside = replace(pose, translation=pose.translation + [*shift, 0.0])
    region, image = relighter.draw_object(aside, lighting)
    assert region.clipped(camera.image_size) == region
    assert image[..., 3].max() == 1.0
    relit = relighter.render(frame, aside, lighting)
    drawn = relit.linear_rgb(region)
    solid = image[..., 3] == 1.0
    assert np.allclose(drawn[solid], np.clip(image[..., :3], 0, 1)[solid], atol=0.01)


def test_light_is_linear(relighter, pose, lighting_of):
    one, other = lighting_of(load_environment("apartment")), lighting_of(load_environment("bridge"))
    both = replace(one, coefficients=0.5 * one.coefficients + 2.0 * other.coefficients)
    images = [relighter.draw_object(pose, light)[1][..., :3] for light in (one, other, both)]
    difference = np.abs(images[2] - 0.5 * images[0] - 2.0 * images[1])
    # exact but where the reconstructed light is negative: there the drawing clamps it
    assert np.quantile(difference, 0.9) < 1e-5
    assert difference.max() < 0.03 * images[2].max()


def test_light_that_stays_or_returns_casts_the_shadow_it_cast(probe, camera, relighter, pose, lighting_of, environment):
    light, other = lighting_of(environment), lighting_of(load_environment("bridge").scaled(0.2))
    moved = replace(pose, translation=pose.translation * 1.1)
    for each, seen_from in ((light, pose), (light, moved), (other, moved), (light, moved)):
        found = relighter.render(frame_of(), seen_from, each)
        alone = Relighter(default_object(), probe, camera, QUICK).render(frame_of(), seen_from, each)
        assert all(np.array_equal(*planes) for planes in zip(found.planes, alone.planes, strict=True))


def test_a_lens_bends_object_and_shadow_alike(probe, lens_camera, pose, lighting_of, environment):
    relighter = Relighter(default_object(), probe, lens_camera, QUICK)
    relit = relighter.render(frame_of(), pose, lighting_of(environment))
    region, image = relighter.draw_object(pose, lighting_of(environment))
    pixels = lens_camera.project(pose, relighter.mesh.vertices_mm)
    y, x = np.nonzero(image[..., 3] == 1.0)
    assert abs((x + region.x0).max() - pixels[:, 0].max()) < 1.5
    assert abs((y + region.y0).min() - pixels[:, 1].min()) < 1.5
    assert relit is not None


def test_other_frequencies_and_sizes_are_refused(relighter, pose, lighting_of, environment):
    lighting = lighting_of(environment)
    others = replace(lighting, frequencies=lighting.frequencies[5:], coefficients=lighting.coefficients[5:])
    with pytest.raises(ValueError, match="frequencies"):
        relighter.render(frame_of(), pose, others)
    with pytest.raises(ValueError, match="pixels"):
        relighter.render(frame_of(size=(64, 48)), pose, lighting)


def test_made_in_one_thread_and_used_in_another(probe, camera, pose, lighting_of, environment):
    relighter = Relighter(default_object(), probe, camera, QUICK)
    results = []

    def work():
        results.append(relighter.draw_object(pose, lighting_of(environment)))
        relighter.release()

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    here = relighter.draw_object(pose, lighting_of(environment))
    assert np.allclose(results[0][1], here[1], atol=1e-6)


def test_what_belongs_to_no_thread_is_made_once(probe, camera, pose, lighting_of, environment, monkeypatch):
    relighter = Relighter(default_object(), probe, camera, QUICK)
    monkeypatch.setattr("arlight.rendering.relight.gloss_rows", lambda *_: pytest.fail("prepared again"))
    before = relighter.draw_object(pose, lighting_of(environment))
    relighter.release()
    after = relighter.draw_object(pose, lighting_of(environment))
    assert np.array_equal(before[1], after[1])


def test_a_grey_frame_gets_a_coloured_object(relighter, pose, lighting_of, environment):
    colour = frame_of()
    from arlight.video.pixel_format import PixelFormat

    grey = Frame(0, 0.0, (colour.planes[0],), PixelFormat("gray", True, 8))
    relit = relighter.render(grey, pose, lighting_of(environment))
    assert len(relit.planes) == 3


@pytest.mark.parametrize("vertices", [3, 4])
def test_a_flat_or_tiny_object_can_be_lit(probe, camera, pose, lighting_of, environment, vertices):
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])[:vertices]
    faces = np.array([[0, 1, 2], [2, 1, 3]], np.int32)[: vertices - 2]
    mesh = Mesh(corners, np.tile([0.0, 0.0, 1.0], (vertices, 1)), faces, np.full((vertices, 3), 0.5, np.float32))
    relighter = Relighter(mesh, probe, camera, QUICK)
    relit = relighter.render(frame_of(), pose, lighting_of(environment))
    assert np.all(np.isfinite(relit.linear_rgb()))


def test_made_for_a_lower_order_it_takes_the_light_up_to_there(probe, camera, pose, lighting_of, environment):
    relighter = Relighter(default_object(), probe, camera, QUICK, order=2)
    whole = lighting_of(environment)
    _, image = relighter.draw_object(pose, whole.truncated(2))
    low = SimpleNamespace(slab=probe.slab, frequencies=whole.truncated(2).frequencies)
    _, expected = Relighter(default_object(), low, camera, QUICK).draw_object(pose, whole.truncated(2))
    assert np.allclose(image, expected, atol=1e-6)
    with pytest.raises(ValueError, match="frequencies"):
        relighter.draw_object(pose, whole)
    with pytest.raises(ProbeError, match="orders 0 to 5"):
        Relighter(default_object(), probe, camera, QUICK, order=6)


def test_a_budget_of_triangles_is_kept_whatever_the_mesh(probe, camera, pose, lighting_of, environment):
    fine = from_trimesh(trimesh.creation.icosphere(subdivisions=4))
    whole = Relighter(fine, probe, camera, QUICK)
    few = Relighter(fine, probe, camera, replace(QUICK, mesh_faces=1000))
    assert len(few.mesh.faces) <= 1000 < len(whole.mesh.faces)
    lighting = lighting_of(environment)
    (region, expected), (other, image) = (relighter.draw_object(pose, lighting) for relighter in (whole, few))
    assert max(abs(a - b) for a, b in zip(region, other, strict=True)) <= 2
    assert image[..., :3].sum() == pytest.approx(expected[..., :3].sum(), rel=0.03)


@pytest.mark.parametrize("order", [0, 1, 3])
def test_light_of_a_lower_order_gives_what_a_relighter_of_that_order_gives(
    relighter, probe, camera, pose, lighting_of, environment, order
):
    low = lighting_of(environment).truncated(order)
    own = Relighter(default_object(), probe, camera, QUICK, order=order)
    (_, image), (_, expected) = relighter.draw_object(pose, low), own.draw_object(pose, low)
    assert np.allclose(image, expected, atol=2e-3 * expected.max())
    frame = frame_of()
    given, wanted = (made.render(frame, pose, low).linear_rgb() for made in (relighter, own))
    assert np.abs(given - wanted).max() < 0.01


@pytest.mark.parametrize("renderer", ["moderngl", "pyrender"])
def test_the_other_renderers_take_light_of_a_lower_order_too(probe, camera, pose, lighting_of, environment, renderer):
    low = lighting_of(environment).truncated(2)
    settings = replace(QUICK, renderer=renderer)
    image = Relighter(default_object(), probe, camera, settings).draw_object(pose, low)[1]
    own = Relighter(default_object(), probe, camera, settings, order=2).draw_object(pose, low)[1]
    assert image[..., :3].sum() == pytest.approx(own[..., :3].sum(), rel=0.02)


def test_the_renderers_differ_in_the_object_alone(probe, camera, pose, lighting_of, environment):
    """The renderers differ in the object alone."""
    frame, lighting = frame_of(), lighting_of(environment)
    native = Relighter(default_object(4000), probe, camera, QUICK)
    opengl = Relighter(default_object(4000), probe, camera, replace(QUICK, renderer="moderngl"))
    region, image = opengl.draw_object(pose, lighting)
    aside = np.ones((240, 320), bool)
    aside[region.y0 : region.y1, region.x0 : region.x1] = False
    ours, theirs = (relighter.render(frame, pose, lighting).linear_rgb() for relighter in (native, opengl))
    assert np.array_equal(ours[aside], theirs[aside])
    assert np.abs(ours - theirs).mean() < 0.002
    assert image[..., 3].max() == 1.0
