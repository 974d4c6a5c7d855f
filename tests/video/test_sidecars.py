import pytest

from arlight.video.sidecars import find_sidecar


@pytest.mark.parametrize("kind", ["probe", "camera"])
def test_a_clips_own_sidecar_comes_before_the_folders(tmp_path, kind):
    clip = tmp_path / "walk.v2.mp4"
    assert find_sidecar(clip, kind) is None
    shared, own = tmp_path / f"{kind}.json", tmp_path / f"walk.v2.{kind}.json"
    shared.touch()
    assert find_sidecar(str(clip), kind) == shared
    own.touch()
    assert find_sidecar(clip, kind) == own


def test_a_truth_is_never_shared_between_clips(tmp_path):
    (tmp_path / "truth.json").touch()
    assert find_sidecar(tmp_path / "a.mp4", "truth") is None


def test_a_folder_is_no_sidecar(tmp_path):
    (tmp_path / "probe.json").mkdir()
    assert find_sidecar(tmp_path / "a.mp4", "probe") is None
