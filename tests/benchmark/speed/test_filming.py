"""Filmed workloads: cycles without a jump, whose truth is theirs."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.benchmark.speed.filming import clip_folder, film
from arlight.benchmark.speed.playback import load_clip
from arlight.benchmark.speed.workloads import APRIL_TAGS, FULL, QUICK, Scene, Workload
from arlight.lighting_tracker import LightingTracker
from arlight.synthetic.sensor import Sensor


def test_a_cycle_goes_there_and_back(clip):
    poses = [true.pose for true in clip.truth]
    count = len(poses)
    assert count == clip.workload.cycle == len(clip.frames)
    for index in range(1, count):
        assert np.array_equal(poses[index].translation, poses[count - index].translation)
    steps = [np.linalg.norm(poses[(i + 1) % count].translation - poses[i].translation) for i in range(count)]
    # the step from the last frame to the first is the one from the first to the second: it can be played on
    assert steps[-1] == steps[0]
    assert min(steps) > 0.0


def test_playing_goes_on_with_running_times(clip):
    played = list(clip.played(2 * len(clip.frames) + 1))
    assert [frame.index for frame, _ in played] == list(range(2 * len(clip.frames) + 1))
    assert np.allclose(np.diff([frame.time_s for frame, _ in played]), 1.0 / 25.0)
    assert np.array_equal(played[-1][0].planes[0], clip.frames[0].planes[0])


def test_the_sheet_is_where_the_truth_says(clip):
    tracker = LightingTracker(clip.probe, clip.camera)
    for frame, true in clip.played(4):
        pose = tracker.update(frame).pose.camera_from_probe
        assert pose is not None
        away = clip.camera.project(pose, clip.probe.outline_mm) - clip.camera.project(true.pose, clip.probe.outline_mm)
        assert np.abs(away).max() < 0.3


def test_noise_differs_on_the_way_back(clip):
    assert not np.array_equal(clip.frames[1].planes[0], clip.frames[-1].planes[0])


def test_what_is_there_is_not_filmed_again(frames_folder, tiny):
    told = []
    film([tiny], frames_folder, told.append)
    assert told == []


def test_workloads_of_a_scene_differ_by_their_sensor_alone(tmp_path, tiny):
    plain = replace(tiny, name="plain", crf=0, half_cycle=1)
    blurred = replace(plain, name="blurred", sensor=Sensor(blur_px=2.0))
    film([plain, blurred], tmp_path, lambda _name: None)
    sharp, soft = (load_clip(tmp_path, workload) for workload in (plain, blurred))
    assert np.array_equal(sharp.truth[0].coefficients, soft.truth[0].coefficients)

    def contrast(clip):
        return np.abs(np.diff(clip.frames[0].planes[0].astype(float))).mean()

    assert contrast(soft) < 0.7 * contrast(sharp)


def test_a_turning_light_turns(tmp_path):
    workload = Workload("turning", Scene(1, (320, 240), "still", script="turn", sheet_width_px=230.0), half_cycle=2)
    film([workload], tmp_path, lambda _name: None)
    truth = load_clip(tmp_path, workload).truth
    assert np.array_equal(truth[0].pose.translation, truth[2].pose.translation)
    assert np.abs(truth[0].coefficients - truth[2].coefficients).max() > 1e-3
    assert np.array_equal(truth[1].coefficients, truth[3].coefficients)


def test_names_tell_workloads_apart_and_so_do_their_folders(tmp_path):
    every = [*FULL, APRIL_TAGS]
    assert len({workload.name for workload in every}) == len(every)
    assert len({clip_folder(tmp_path, workload) for workload in every}) == len(every)
    assert set(QUICK) <= set(FULL)


@pytest.mark.parametrize("change", [{"crf": 30}, {"half_cycle": 4}, {"sensor": Sensor(blur_px=1.0)}])
def test_a_workload_that_is_changed_is_filmed_anew(change, tiny, tmp_path):
    assert clip_folder(tmp_path, replace(tiny, **change)) != clip_folder(tmp_path, tiny)
