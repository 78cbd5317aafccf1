"""Animate the motion of a mechanism: a GIF or MP4 file, or moving pictures in a notebook."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from os import PathLike

import numpy as np
import xarray as xr

from flexband.analysis.selection import AnySurrogate
from flexband.basics.checks import (
    check_affordable,
    check_flag,
    check_function,
    check_instance,
    check_integer,
    check_numbers,
    check_positive,
)
from flexband.basics.progress import Progress, run_counter
from flexband.basics.response import Response
from flexband.basics.warning import without_warnings
from flexband.basics.words import number_of, value_text
from flexband.errors import InputError
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.simulate import TimeGrid, simulate_system, whole_steps
from flexband.report.drawing.animation import (
    MOST_PICTURES_PER_SECOND,
    Animation,
    checked_file,
    gif,
    mp4,
)
from flexband.report.drawing.film import film_of
from flexband.report.drawing.points import checked_names, places_of, regions_of
from flexband.report.drawing.recording import record

MOST_PICTURES = 20_000
"""Of an animation."""


def animate(
    mechanism: Mechanism,
    *,
    duration: float,
    step: float,
    file: str | PathLike[str] | None = None,
    fps: float = 25.0,
    speed: float = 1.0,
    samples: int | Sequence[int] = 0,
    points: str | Sequence[str] = (),
    surrogate: AnySurrogate | None = None,
    sigmas: float = 1.0,
    magnification: float = 1.0,
    names: bool = False,
    dpi: float = 100.0,
    substeps: int = 1,
    start: str | xr.DataArray = "assembled",
    period: float | None = None,
    integrator: GeneralizedAlpha | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Animation:
    """Simulate a mechanism and animate its motion as a GIF or MP4 file, or in a notebook.

    Bodies, joints and loads look as `draw` draws them. The axes are the same in all pictures. A
    picture shows the motion at the time of the simulation that is nearest to its own, so that
    `step` should be shorter than ``speed / fps``. The animation takes ``duration / speed`` and
    repeats itself, without a picture of the end: a periodic motion runs on.

    Parameters
    ----------
    duration, step : simulated time and step [s], as for `simulate`; the duration is a whole
        multiple of the step.
    file : a path that ends in .gif or .mp4; MP4 files are made by ffmpeg, which must be installed.
        None for a GIF that notebooks show.
    fps : pictures per second, at most 50 in a GIF.
    speed : simulated seconds in a second of the animation; 0.1 shows the motion ten times slower.
    samples : number of the sample to draw if parameters are arrays, or several: of all but the
        first, the bodies are drawn as thin lines.
    points : points whose paths are drawn: names of `Position` sensors, or of points of bodies, such
        as "crank.end".
    surrogate : that of a study whose outputs are the coordinates of `points`, which are then names
        of sensors; without `points`, of all `Position` sensors that are outputs. The path is then
        the nominal one, and the region of the point at each time is drawn, as
        `fb.analysis.path` computes it.
    sigmas : k of μ ± kσ of the region.
    magnification : how many times larger the region is drawn about the nominal path.
    names : whether to write the names of bodies, joints and loads. They keep the distances from
        what they belong to that are free at the start.
    dpi : pixels per inch of pictures of at most 8 by 6 inches.
    substeps, start, period, integrator, threads : as for `simulate`.
    progress : called as ``progress(done, total)`` when pictures are drawn.

    Returns
    -------
    The animation, which a notebook shows. Its `times` [s], shape (pictures,), are those of the
    simulation that the pictures show; ``save(file)`` writes it.

    Raises
    ------
    InputError
        If the mechanism is none, a number is out of its range, the suffix of the file is unknown,
        ffmpeg is missing, a sample or a point does not exist, or a point's coordinates are not
        outputs of the surrogate.
    AssemblyError, SimulationError
        As `simulate` does.

    Examples
    --------
    >>> crank = fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=7800.0)
    >>> mechanism = fb.Mechanism(
    ...     bodies={"crank": crank},
    ...     joints={
    ...         "A": fb.Revolute("crank.start", (0.0, 0.0)),
    ...         "motor": fb.PrescribedRotation("crank", lambda t: 6.0 * t),
    ...     },
    ... )
    >>> animation = fb.animate(mechanism, duration=0.5, step=1e-3, points="crank.end", fps=10)
    >>> animation.times
    array([0. , 0.1, 0.2, 0.3, 0.4])

    >>> fb.animate(mechanism, duration=1.0, step=1e-3, file="crank.gif")  # doctest: +SKIP
    """
    # Check the arguments.
    output_file = None if file is None else checked_file(file)
    suffix = ".gif" if output_file is None else output_file.suffix.lower()
    check_flag("names", names)
    if progress is not None:
        check_function("progress", progress)
    pixels = _checked_between("dpi", dpi, 20.0, 600.0)
    rate = _checked_between("fps", fps, 0.1, MOST_PICTURES_PER_SECOND[suffix])
    gap = float(check_positive("speed", check_numbers("speed", speed))) / rate
    factor = float(check_positive("magnification", check_numbers("magnification", magnification)))
    times = _picture_times(duration, step, gap, pixels)
    numbers = _checked_samples(mechanism, samples)
    places = places_of(mechanism, checked_names(points), surrogate)
    # Simulate, and draw the pictures.
    simulated = partial(
        _simulate, grid=TimeGrid(duration, step, substeps), gap=gap, start=start, period=period,
        integrator=integrator, threads=threads,
    )  # fmt: skip
    recording = record(mechanism, numbers, places, times, simulated)
    regions = {}
    if surrogate is not None:
        regions = regions_of(
            surrogate, places, recording.times, sigmas=sigmas, magnification=factor
        )
    film = film_of(recording, regions, pixels, names=names)
    pictures = _counted(film.pictures(), len(times), progress)
    content = gif(pictures, len(times), rate) if suffix == ".gif" else mp4(pictures, rate)
    animation = Animation(content, suffix, recording.times)
    if output_file is not None:
        animation.save(output_file)
    return animation


def _checked_between(name: str, value: object, low: float, high: float) -> float:
    number = float(check_numbers(name, value))  # type: ignore[arg-type]
    if not low <= number <= high:
        raise InputError(f"{name} must be between {low:g} and {high:g}; got {number:g}")
    return number


def _picture_times(duration: float, step: float, gap: float, dpi: float) -> np.ndarray:
    """Return the times of pictures [s] from the start on, `gap` seconds apart."""
    whole_steps(duration, step)
    count = max(1.0, np.ceil(float(duration) / gap - 1e-9))
    if count > MOST_PICTURES:
        raise InputError(
            f"duration, fps and speed make {count:.3g} pictures; at most {MOST_PICTURES} are drawn"
        )
    check_affordable(f"{number_of(int(count), 'picture')} of {dpi:g} dpi", 6.0 * dpi**2 * count)
    return gap * np.arange(int(count))


def _checked_samples(mechanism: Mechanism, samples: int | Sequence[int]) -> list[int]:
    """Return numbers of samples; raise `InputError` if there are none, or one does not exist."""
    if isinstance(mechanism, Response) or (callable(mechanism) and not isinstance(mechanism, type)):
        raise InputError(
            f"mechanism must be a Mechanism; got {value_text(mechanism)}: call the function that "
            "builds it with numbers, and animate what it returns"
        )
    check_instance("mechanism", mechanism, Mechanism)
    numbers = list(samples) if isinstance(samples, list | tuple | range) else [samples]
    if not numbers:
        raise InputError("samples must be the number of a sample, or several; got none")
    with without_warnings():
        last = assemble(mechanism).samples - 1
    return [check_integer("samples", number, 0, last) for number in numbers]


def _simulate(
    mechanism: Mechanism,
    grid: TimeGrid,
    gap: float,
    *,
    start: str | xr.DataArray,
    period: float | None,
    integrator: GeneralizedAlpha | None,
    threads: int | None,
) -> xr.DataArray:
    """Return the outputs at no more times than pictures need, which are `gap` seconds apart."""
    count = whole_steps(grid.duration, grid.step)
    # Four times per picture are exact enough, and several hundreds make a path smooth.
    stride = max(1, min(int(gap / float(grid.step) / 4), count // 500))
    if period is not None:  # a whole multiple of the step
        stride = 1
    substeps = check_integer("substeps", grid.substeps, 1, 1_000_000)
    step = stride * float(grid.step)
    motion, _ = simulate_system(
        mechanism,
        TimeGrid(count // stride * step, step, stride * substeps),
        start=start,
        period=period,
        integrator=integrator,
        threads=threads,
    )
    return motion


def _counted(
    pictures: Iterator[np.ndarray], count: int, progress: Progress | None
) -> Iterator[np.ndarray]:
    """Give pictures, and tell how many of them are drawn."""
    advance = run_counter(progress, count)
    for picture in pictures:
        yield picture
        advance(1)
