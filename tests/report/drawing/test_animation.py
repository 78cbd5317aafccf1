"""Animations, read back from their files and compared with the simulation."""

import shutil
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

import flexband as fb
from flexband.report.drawing.recording import nearest_places
from tests.mechanics.models import rigid_slider_crank

MARGIN = 45
"""Pixels at each side of a picture that hold numbers of axes, and the time."""


def pictures(content):
    """Return the pictures of a GIF, shape (pictures, height, width, 3), and their durations [s]."""
    image = Image.open(BytesIO(content))
    frames = []
    durations = []
    for k in range(image.n_frames):
        image.seek(k)
        frames.append(np.asarray(image.convert("RGB"), dtype=int))
        durations.append(image.info["duration"] / 1000.0)
    return np.array(frames), np.array(durations)


def thrown(velocity=(1.0, 3.0), **sensors):
    return fb.Mechanism(
        bodies={"ball": fb.PointMass(mass=1.0, velocity=velocity)},
        loads={"gravity": fb.Gravity()},
        sensors=sensors,
    )


def middles_of(frames, is_color):
    """Return where pixels of a colour are on average, shape (pictures, 2)."""
    inner = frames[:, MARGIN:-MARGIN, MARGIN:-MARGIN]
    return np.array([np.argwhere(is_color(frame)).mean(axis=0)[::-1] for frame in inner])


def test_a_gif_shows_the_motion(tmp_path):
    file = tmp_path / "ball.gif"
    mechanism = thrown()
    made = fb.animate(mechanism, duration=0.6, step=1e-3, speed=0.5, file=file)
    frames, durations = pictures(file.read_bytes())
    assert file.read_bytes() == made.content
    assert len(frames) == len(made.times) == 30
    np.testing.assert_allclose(made.times, np.arange(30) * 0.02, atol=1e-9)
    np.testing.assert_allclose(durations, 0.04)
    assert (frames[1:] != frames[:-1]).any(axis=(1, 2, 3)).all()
    # Pixels are places to one scale, alike in both directions and in all pictures.
    x = 1.0 * made.times
    y = 3.0 * made.times - fb.Gravity().y * -0.5 * made.times**2
    places = middles_of(frames, lambda frame: frame.max(axis=-1) < 90)
    ones, zeros = np.ones_like(x), np.zeros_like(x)
    across = np.stack([ones, zeros, x], axis=1)
    down = np.stack([zeros, ones, -y], axis=1)
    system = np.concatenate([across, down])
    seen = np.concatenate([places[:, 0], places[:, 1]])
    fit, *_ = np.linalg.lstsq(system, seen, rcond=None)
    assert fit[2] > 200.0  # pixels per metre
    np.testing.assert_allclose(system @ fit, seen, atol=1.0)


def test_the_pace_is_kept_where_hundredths_of_a_second_are_too_coarse():
    made = fb.animate(thrown(), duration=1.0, step=1e-3, fps=30, dpi=40)
    frames, durations = pictures(made.content)
    assert len(frames) == 30
    assert set(np.round(durations, 3)) == {0.03, 0.04}
    assert durations.sum() == pytest.approx(1.0)


def test_a_picture_shows_a_time_of_the_simulation():
    made = fb.animate(thrown(), duration=0.3, step=0.05, fps=50, dpi=40)
    assert set(np.round(made.times, 9)) <= set(np.round(np.arange(7) * 0.05, 9))
    assert np.all(np.abs(made.times - np.arange(15) / 50) <= 0.025 + 1e-12)


def test_notebooks_show_it():
    made = fb.animate(thrown(), duration=0.2, step=1e-2, fps=10, dpi=40)
    assert made._repr_html_().startswith('<img alt="animation" src="data:image/gif;base64,R0lGOD')
    assert "content" not in repr(made)


def test_names_and_paths_are_drawn():
    model = rigid_slider_crank()
    plain = fb.animate(model, duration=0.5, step=1e-3, fps=10)
    named = fb.animate(model, duration=0.5, step=1e-3, fps=10, names=True)
    tracked = fb.animate(model, duration=0.5, step=1e-3, fps=10, points="crank.end")
    dark = [int((pictures(a.content)[0].sum(axis=-1) < 300).sum()) for a in (plain, named)]
    assert dark[1] > dark[0] + 500
    orange = [count_of(pictures(a.content)[0], (217, 95, 2)) for a in (plain, tracked)]
    assert orange[0].max() == 0
    assert orange[1].min() > 100


def count_of(frames, color):
    """Return how many pixels are nearly of a colour, shape (pictures,)."""
    return (np.abs(frames - color).max(axis=-1) < 40).sum(axis=(1, 2))


def test_other_samples_are_drawn_as_lines():
    model = rigid_slider_crank(crank_length=np.array([0.15, 0.2]))
    one = fb.animate(model, duration=0.5, step=1e-3, fps=10, samples=1)
    two = fb.animate(model, duration=0.5, step=1e-3, fps=10, samples=[1, 0])
    blue = [bluish(pictures(a.content)[0]) for a in (one, two)]
    assert blue[0].max() == 0
    assert blue[1].min() > 20


def bluish(frames):
    """Return how many pixels are bluer than red, shape (pictures,)."""
    return (frames[..., 2] > frames[..., 0] + 40).sum(axis=(1, 2))


@pytest.fixture(scope="module")
def surrogate():
    def build(along, up):
        return thrown((along, up), ball=fb.Position("ball"), pace=fb.Velocity("ball"))

    response = fb.dynamic_response(build, duration=0.6, step=0.02)
    inputs = {"along": fb.Interval(0.9, 1.1), "up": fb.Interval(2.9, 3.1)}
    return fb.expand(response, inputs, fb.PCCI(1, 1))


def test_the_region_of_a_point_is_drawn(surrogate):
    mechanism = thrown(ball=fb.Position("ball"), pace=fb.Velocity("ball"))
    made = fb.animate(mechanism, duration=0.6, step=0.02, surrogate=surrogate, magnification=2.0)
    frames, _ = pictures(made.content)
    pink = (np.abs(frames - (240, 191, 153)).max(axis=-1) < 30).sum(axis=(1, 2))
    assert pink[-1] > 3 * pink[3]  # it grows with time, as speed times time


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"duration": None}, r"duration \[s\] must be"),
        ({"step": 0.07}, "whole multiple"),
        ({"fps": 0}, "fps must be between 0.1 and 50; got 0"),
        ({"fps": 60}, "fps must be between 0.1 and 50; got 60"),
        ({"speed": -1.0}, "speed must be positive"),
        ({"speed": 1e-9}, "make 5e[+]09 pictures; at most 20000"),
        ({"file": "ball.avi"}, r"must end in \.gif or \.mp4; got 'ball\.avi'"),
        ({"file": 3}, "file must be a path"),
        ({"samples": 1}, "samples must be"),
        ({"samples": []}, "got none"),
        ({"dpi": 5}, "dpi must be between 20 and 600"),
        ({"points": "pace"}, "'pace' is a sensor of the kind Velocity, which is no point"),
        ({"points": "bal"}, "points: .*bal"),
        ({"points": 3}, "points must be names"),
        ({"mechanism": thrown}, "mechanism must be a Mechanism; got .*thrown.*call the function"),
        ({"mechanism": 3}, "mechanism must be a Mechanism; got 3"),
        ({"surrogate": 3}, "surrogate must be a Surrogate"),
        ({"magnification": 0.0}, "magnification must be positive"),
        ({"progress": 3}, "progress must be a function"),
    ],
)
def test_bad_arguments_are_refused_by_name(options, message):
    usual = {"mechanism": thrown(pace=fb.Velocity("ball")), "duration": 0.2, "step": 0.01}
    arguments = usual | options
    with pytest.raises(fb.errors.InputError, match=message):
        fb.animate(arguments.pop("mechanism"), **arguments)


def test_a_response_and_a_point_that_is_no_output_are_refused(surrogate):
    response = fb.dynamic_response(thrown, duration=0.2, step=0.01)
    with pytest.raises(fb.errors.InputError, match="mechanism must be a Mechanism"):
        fb.animate(response, duration=0.2, step=0.01)
    other = thrown(elsewhere=fb.Position("ball"), ball=fb.Position("ball"))
    with pytest.raises(fb.errors.InputError, match="elsewhere_X and elsewhere_Y must be outputs"):
        fb.animate(other, duration=0.2, step=0.01, points="elsewhere", surrogate=surrogate)
    with pytest.raises(fb.errors.InputError, match="no region to draw"):
        fb.animate(thrown(), duration=0.2, step=0.01, surrogate=surrogate)


def test_no_file_is_left_where_the_drawing_is_interrupted(tmp_path):
    def interrupt(done, total):
        assert total == 5
        if done == 3:
            raise KeyboardInterrupt

    file = tmp_path / "ball.gif"
    with pytest.raises(KeyboardInterrupt):
        fb.animate(thrown(), duration=0.2, step=0.01, file=file, dpi=40, progress=interrupt)
    assert not list(tmp_path.iterdir())


def test_an_mp4_needs_ffmpeg(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(fb.errors.InputError, match=r"ffmpeg, which is not installed.*\.gif file"):
        fb.animate(thrown(), duration=0.2, step=0.01, file=tmp_path / "ball.mp4")


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_an_mp4_is_made_by_ffmpeg(tmp_path):
    file = tmp_path / "ball.mp4"
    made = fb.animate(thrown(), duration=0.4, step=0.01, file=file, dpi=40)
    assert file.read_bytes()[4:8] == b"ftyp"
    assert "<video" in made._repr_html_()
    with pytest.raises(fb.errors.InputError, match=r"must end in \.mp4"):
        made.save(tmp_path / "ball.gif")


def test_a_failure_of_ffmpeg_is_told(tmp_path, monkeypatch):
    command = tmp_path / "ffmpeg"
    command.write_text("#!/bin/sh\necho no encoder >&2\nexit 1\n")
    command.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/bin:/usr/bin")
    with pytest.raises(fb.errors.InputError, match="no encoder"):
        fb.animate(thrown(), duration=0.2, step=0.01, file=tmp_path / "ball.mp4", dpi=40)


SECONDS = st.floats(-5.0, 5.0)


@given(st.lists(SECONDS, min_size=1, max_size=20, unique=True), st.lists(SECONDS, max_size=20))
def test_the_nearest_instants_are_those_at_the_least_distances(instants, times):
    """As the distances to all instants tell, whose table takes gigabytes for long motions."""
    instants = np.sort(instants)
    times = np.array(times)
    distances = np.abs(instants[:, None] - times)
    chosen = distances[nearest_places(instants, times), np.arange(len(times))]
    np.testing.assert_array_equal(chosen, distances.min(axis=0, initial=np.inf))
