"""The motion of a study's mechanism, nominal and of samples of its inputs, for its animation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flexband.basics.warning import without_warnings
from flexband.basics.words import are
from flexband.errors import RunError
from flexband.mechanics.configuration import assembled_configuration
from flexband.mechanics.response import DynamicResponse
from flexband.mechanics.simulate import TimeGrid, simulate_system
from flexband.mechanics.static_response import StaticResponse
from flexband.report.page.arrays import JsonRecord, pack
from flexband.report.page.motion.record import force_arrows, record_shapes, traces_of
from flexband.report.shapes.mechanism import extent, sketch_mechanism
from flexband.report.shapes.motion import sketch_in_motion, unit_directions
from flexband.report.shapes.scene import Scene
from flexband.report.shapes.sketch import Outline
from flexband.report.shapes.tracks import Tracks
from flexband.uncertainty.inputs.sampling import nested_points
from flexband.uncertainty.inputs.space import Space

if TYPE_CHECKING:
    from flexband.basics.response import ResponseFunction
    from flexband.mechanics.model.mechanism import Mechanism

    Course = tuple[np.ndarray, np.ndarray] | tuple[()]

SAMPLES = 23
"""Samples of the inputs, which are simulated together with the nominal motion."""


def motion_data(
    response: ResponseFunction, space: Space, *, samples: int = SAMPLES, course: Course = ()
) -> tuple[JsonRecord | None, list[str]]:
    """Simulate a mechanism and return what an animation of it draws.

    Half of the samples besides the nominal one are at corners of the intervals; those that fail are
    left out. `course` has times [s] and their places on the axis of the charts.

    The result is a tree that JSON can hold, or None, and sentences on what is missing. `times` [s],
    (times,), with `places`; `position` [m], `direction` and `force` [N] of the nominal motion,
    (tracks, 2, times); its `box` [m]; `names` of parts; `shapes`, `forces` and `traces`, which name
    tracks by numbers; and `samples`: the `outlines` of bodies, and deviations of their points from
    the nominal motion [m], (samples, points, 2, times).
    """
    if not isinstance(response, DynamicResponse | StaticResponse):
        return None, ["The response is not a mechanism of flexband, so that there is no animation."]
    try:
        motion, remarks = _of_mechanism(response, space, samples, course)
    except Exception as error:  # whatever a builder raises
        reason = " ".join(str(error).split())
        if not samples:
            return None, [f"The motion could not be simulated: {reason}"]
        motion, remarks = motion_data(response, space, samples=0, course=course)
        remarks = [f"Samples of the inputs could not be simulated: {reason}", *remarks]
    return motion, remarks


def _of_mechanism(
    response: DynamicResponse | StaticResponse, space: Space, samples: int, course: Course
) -> tuple[JsonRecord, list[str]]:
    # Width and height of a mechanism in a page [pt], which numbers of teeth and coils are for
    picture = (550.0, 320.0)
    with without_warnings():
        mechanism = response.builder(**space.arguments_at(*_points(space, samples)))
        if response.element_parts > 1:
            mechanism = mechanism.refined(response.element_parts)
        scene = Scene(mechanism, assembled_configuration(mechanism))
        tracks = Tracks(mechanism)
        sketch = sketch_mechanism(scene, tracks)
        forces = force_arrows(mechanism, tracks)
        traces = traces_of(mechanism, tracks)
        times, outputs = _record_runs(response, replace(mechanism, sensors=tracks.sensors))
    finite_samples = np.asarray(np.isfinite(outputs).all(axis=(1, 2)))
    if not finite_samples[0]:
        raise RunError("the nominal motion fails", {})
    parts = tracks.split(outputs[finite_samples])
    parts["direction"] = unit_directions(parts["direction"])
    position = parts["position"][0]
    direction = parts["direction"][0]
    box = extent(sketch, position, direction)
    unit = float(((box[1] - box[0]) / picture).max()) or 1.0
    in_motion = sketch_in_motion(sketch, position, direction, unit)
    motion = {
        "times": pack(times),
        **({"places": pack(np.interp(times, *course))} if course else {}),
        **{kind: _pack(kind, values[0]) for kind, values in parts.items()},
        "box": box.tolist(),
        "names": {
            "bodies": list(mechanism.bodies),
            "joints": list(mechanism.joints),
            "loads": list(mechanism.loads),
        },
        **record_shapes(in_motion),
        "forces": forces,
        "traces": traces,
        "samples": _samples(sketch.outlines, parts["position"]),
    }
    failed = int((~finite_samples).sum())
    few = f"{are(failed, 'sample')} not drawn, of {samples}, since their motion fails."
    return motion, [few] if failed else []


def _points(space: Space, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Return ξ and η of the nominal motion and of samples, the first half of them at corners."""
    seed = 17
    xi, eta = nested_points(samples, space.interval_dimension, space.families, seed)
    eta[: (samples + 1) // 2] = np.sign(eta[: (samples + 1) // 2])
    nominal = space.nominal()
    return np.concatenate([nominal[0], xi]), np.concatenate([nominal[1], eta])


def _record_runs(
    response: DynamicResponse | StaticResponse, mechanism: Mechanism
) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and outputs (samples, outputs, times), NaN for samples that fail."""
    frames = 250  # most instants that are kept of a motion
    if isinstance(response, StaticResponse):
        at_rest = response.outputs(mechanism, {})
        values = at_rest.values.reshape(-1, at_rest.shape[-1], 1)
        return np.array([response.time]), values
    outputs = round(response.duration / response.output_step)
    stride = -(-outputs // frames)
    frame_step = stride * response.output_step
    try:
        motion, _ = simulate_system(
            mechanism,
            TimeGrid(outputs // stride * frame_step, frame_step, stride * response.step_parts),
            start=response.start,
            period=response.period,
            integrator=response.integrator,
            threads=response.threads,
        )
    except RunError as error:
        if error.results is None:
            raise
        motion = error.results
    return motion["time"].values, motion.values.reshape(-1, *motion.shape[-2:])


def _samples(outlines: Sequence[Outline], positions: np.ndarray) -> JsonRecord:
    """Return outlines of bodies and their deviations from the nominal motion."""
    # Of the positions of all samples; if there are more, samples are left out
    max_numbers = 250_000
    points = list(dict.fromkeys(point for outline in outlines for point in outline.points))
    deviations = positions[1:, points] - positions[:1, points]
    max_samples = max(1, max_numbers // deviations[:1].size) if deviations.size else 0
    return {
        "points": points,
        "outlines": [
            {**line._asdict(), "points": [points.index(point) for point in line.points]}
            for line in outlines
        ],
        "deviation": _pack("deviation", deviations[:max_samples]),
    }


def _pack(kind: str, values: np.ndarray) -> JsonRecord:
    """Return an array packed in steps as fine as its kind needs."""
    # Largest values over the steps that they are rounded to
    levels = {"position": 30_000, "direction": 1_000, "force": 10_000, "deviation": 2_000}
    return pack(values, float(np.abs(values).max(initial=0.0)) / levels[kind] or 1.0)
