"""probe.json comes back as it was written, and whatever else a file holds is refused as a ProbeError that names it."""

import copy
import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from arlight.errors import OutputError, ProbeError
from arlight.probe.design import Probe
from arlight.probe.layout import design_probe
from arlight.probe.storage import load_probe, save_probe


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    path = tmp_path_factory.mktemp("probe") / "probe.json"
    save_probe(design_probe(1), path)
    return json.loads(path.read_text())


def written(folder, content):
    path = folder / "probe.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def paths_of(value, path=()):
    yield path
    for key, item in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from paths_of(item, (*path, key))


def replaced(content, path, value):
    if not path:
        return value
    changed = copy.deepcopy(content)
    parent = changed
    for key in path[:-1]:
        parent = parent[key]
    parent[path[-1]] = value
    return changed


@pytest.mark.parametrize("design", ["matched", "doubled"])
@pytest.mark.parametrize("order", [1, 3, 5, 8])
def test_round_trip_is_exact(tmp_path, order, design):
    probe = design_probe(order, design, glass_mm=2.44 / 3.0 * 2.9, paper_reflectance=0.87, film_transmittance=0.91)
    save_probe(probe, tmp_path / "probe.json")
    assert load_probe(tmp_path / "probe.json") == probe


def test_reads_the_layout_of_version_1(tmp_path):
    block = {"kind": "pattern", "frequency": [-1, 1], "phase_deg": 270, "center_mm": [0, 10], "size_mm": 9}
    content = {
        "format": "arlight-probe",
        "version": 1,
        "design": "matched",
        "order": 2,
        "sheet_mm": [60, 60.0],
        "pixels_per_mm": 20,
        "glass_mm": 2,
        "refractive_index": 1.5,
        "fiducials": {
            "dictionary": "DICT_4X4_50",
            "markers": [{"id": 7, "corners_mm": [[-20, -5], [-10, -5], [-10, -15], [-20, -15]]}],
        },
        "blocks": [
            block | {"window_mm": 3.5, "id": 4},
            {"kind": "wedge", "reflectance": 0.25, "center_mm": [20, 20], "size_mm": 5, "window_mm": 4, "id": 5},
        ],
        "author": "keys that version 1 does not know are left alone",
    }
    probe = load_probe(written(tmp_path, content))
    assert probe.blocks[0].frequency == (-1, 1)
    assert probe.blocks[0].phase_deg == 270.0
    assert probe.blocks[1].reflectance == 0.25
    assert probe.markers[0].corners_mm[2] == (-10.0, -15.0)
    assert (probe.paper_reflectance, probe.film_transmittance) == (0.9, 0.95)


REFUSED = [
    (("format",), "other", 'format: expected one of arlight-probe, found "other"'),
    (("version",), 2, "version: expected an integer from 1 to 1, found 2"),
    (("version",), "1", "version"),
    (("version",), True, "version"),
    (("design",), "woven", 'design: expected one of matched, doubled, found "woven"'),
    (("order",), 9, "order: expected an integer from 1 to 8, found 9"),
    (("order",), 1.5, "order"),
    (("sheet_mm",), [90.0], "sheet_mm: expected a list of 2"),
    (("sheet_mm",), [-90.0, 90.0], r"sheet_mm\[0\]: expected a number from .*, found -90.0"),
    (("glass_mm",), 0, "glass_mm"),
    (("glass_mm",), float("nan"), "glass_mm: expected a number .* found NaN"),
    (("glass_mm",), 10**400, "glass_mm"),
    (("refractive_index",), 0.9, "refractive_index"),
    (("pixels_per_mm",), float("inf"), "pixels_per_mm"),
    (("pixels_per_mm",), 390, "pixels_per_mm: expected a resolution that gives the sheet .* pixels a side, found 390"),
    (("paper_reflectance",), 1.5, "paper_reflectance"),
    (("film_transmittance",), "clear", 'film_transmittance: expected a number .*, found "clear"'),
    (("fiducials",), [], "fiducials: expected an object"),
    (("fiducials", "dictionary"), "DICT_9X9_50", "fiducials.dictionary: expected one of .*DICT_4X4_50"),
    (("fiducials", "markers"), [], "fiducials.markers: expected at least one marker"),
    (("fiducials", "markers", 0, "id"), 50, "DICT_4X4_50, which has 0 to 49, found 50"),
    (("fiducials", "markers", 0, "id"), 1, r"markers\[1\].id: expected a number used once"),
    (
        ("fiducials", "markers", 0, "corners_mm", 0),
        [0, 0],
        r"markers\[0\].corners_mm: expected the corners of a square",
    ),
    (("blocks",), {}, "blocks: expected a list"),
    (("blocks",), [], "blocks: expected at least one block of kind pattern"),
    (("blocks", 3, "kind"), "grey", r"blocks\[3\].kind: expected one of pattern, clear_white.*, found \"grey\""),
    (("blocks", 3, "size_mm"), -1, r"blocks\[3\].size_mm"),
    (("blocks", 3, "window_mm"), 99, r"blocks\[3\].window_mm"),
    (("blocks", 3, "center_mm"), [500, 0], r"blocks\[3\]: expected a place on the sheet of"),
    (("blocks", 3, "center_mm"), [0], r"blocks\[3\].center_mm: expected a list of 2"),
    (("blocks", 3, "id"), 2, r"blocks\[3\].id: expected a number used once, found 2, which blocks\[2\] has too"),
    (("blocks", 3, "id"), "three", r"blocks\[3\].id"),
]


@pytest.mark.parametrize(("path", "value", "message"), REFUSED)
def test_impossible_values_are_refused(tmp_path, content, path, value, message):
    file = written(tmp_path, replaced(content, path, value))
    with pytest.raises(ProbeError, match=message) as refusal:
        load_probe(file)
    assert str(file) in str(refusal.value)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("frequency", [1, 1], "at most the sheet's order 1"),
        ("frequency", [0, -1], "v > 0, or v = 0 and u > 0"),
        ("frequency", [0, 0], "v > 0"),
        ("frequency", [0.5, 1], "an integer"),
        ("frequency", None, "a list of 2"),
        ("phase_deg", "90", "a number"),
        ("phase_deg", [90], "a number"),
        ("phase_deg", 1e9, "a number"),
    ],
)
def test_impossible_patterns_are_refused(tmp_path, content, key, value, message):
    index = next(i for i, block in enumerate(content["blocks"]) if block["kind"] == "pattern")
    with pytest.raises(ProbeError, match=message) as refusal:
        load_probe(written(tmp_path, replaced(content, ("blocks", index, key), value)))
    assert f"blocks[{index}].{key}" in str(refusal.value)


def test_missing_keys_are_named(tmp_path, content):
    for key in ("format", "version", "design", "order", "sheet_mm", "glass_mm", "fiducials", "blocks"):
        without = {name: value for name, value in content.items() if name != key}
        with pytest.raises(ProbeError, match=f"{key}: expected a value, found no such key"):
            load_probe(written(tmp_path, without))


def test_overlapping_blocks_are_refused(tmp_path, content):
    moved = replaced(content, ("blocks", 1, "center_mm"), content["blocks"][0]["center_mm"])
    with pytest.raises(
        ProbeError, match=r"blocks\[1\]: expected a place of its own, found an overlap with blocks\[0\]"
    ):
        load_probe(written(tmp_path, moved))


def test_mirrored_markers_are_refused(tmp_path, content):
    corners = content["fiducials"]["markers"][2]["corners_mm"][::-1]
    with pytest.raises(ProbeError, match="clockwise"):
        load_probe(written(tmp_path, replaced(content, ("fiducials", "markers", 2, "corners_mm"), corners)))


@pytest.mark.parametrize("text", ["", "{", "null", "[]", "3", '"arlight-probe"', "[" * 100_000, "\x00", "{]}"])
def test_what_is_no_probe_is_refused(tmp_path, text):
    with pytest.raises(ProbeError, match=r"probe\.json"):
        load_probe(written(tmp_path, text))


def test_missing_files_folders_and_other_encodings_are_refused(tmp_path):
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00\x80")
    for path in (tmp_path / "absent.json", tmp_path, tmp_path / "binary.json"):
        with pytest.raises(ProbeError, match=str(path)):
            load_probe(path)


def test_unwritable_place_is_an_output_error(tmp_path):
    with pytest.raises(OutputError, match=r"absent/probe\.json"):
        save_probe(design_probe(1), tmp_path / "absent" / "probe.json")


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=6),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=6), inner, max_size=3),
    max_leaves=6,
)


@settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_any_change_is_read_or_refused(tmp_path, content, data):
    path = data.draw(st.sampled_from(list(paths_of(content))))
    file = written(tmp_path, replaced(content, path, data.draw(JSON)))
    try:
        outcome: object = load_probe(file)
    except ProbeError as refusal:
        outcome = str(refusal)
    # any other exception fails the test
    assert isinstance(outcome, Probe) or str(file) in str(outcome)


@settings(
    max_examples=100, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(noise=st.binary(max_size=60))
def test_any_bytes_are_refused(tmp_path, noise):
    file = tmp_path / "noise.json"
    file.write_bytes(noise)
    with pytest.raises(ProbeError, match=r"noise\.json"):
        load_probe(file)
