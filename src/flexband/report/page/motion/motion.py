"""The motion of a study's mechanism, nominal and of samples of its inputs, for its animation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from flexband.errors import RunError, without_warnings
from flexband.mechanics.assembly.mechanism import Mechanism
from flexband.mechanics.configuration import assembled
from flexband.mechanics.response import DynamicResponse
from flexband.mechanics.sensors.motion import Acceleration, Position, Velocity
from flexband.mechanics.simulate import simulated
from flexband.mechanics.static_response import StaticResponse
from flexband.report.drawing.scene import Scene
from flexband.report.page.arrays import packed
from flexband.report.page.motion.bodies import body_item, outline
from flexband.report.page.motion.joints import joint_item, reaction_item, supports
from flexband.report.page.motion.loads import load_item
from flexband.report.page.motion.tracks import Tracks
from flexband.uncertainty.inputs.sampling import nested_points
from flexband.uncertainty.inputs.space import Space
from flexband.words import are

FRAMES = 250
"""Most instants that are kept of a motion."""

SAMPLES = 23
"""Samples of the inputs, which are simulated together with the nominal motion."""

MAX_NUMBERS = 250_000
"""Of the positions of all samples; if there are more, samples are left out."""

LEVELS = {"position": 30_000, "direction": 1_000, "force": 10_000, "deviation": 2_000}
"""Largest values over the steps that they are rounded to."""

SEED = 17


def motion_data(
    response: object, space: Space, *, samples: int = SAMPLES
) -> tuple[dict[str, Any] | None, list[str]]:
    """Simulate a mechanism and return what an animation of it draws.

    Parameters
    ----------
    response : of `dynamic_response` or `static_response`, on the discretization to use. Of any
        other there is no animation.
    space : its inputs. A choice must be one of its options.
    samples : number of samples of the inputs besides the nominal one. Half of them are at corners
        of the intervals. Those that fail are left out.

    Returns
    -------
    A tree that JSON can hold, or None, and sentences that tell what is missing and why.
    `times` [s], shape (times,); `position` [m], `direction` and `force` [N] of the nominal motion,
    shape (tracks, 2, times); items of `bodies`, `joints`, `supports`, `loads` and `forces`, which
    name tracks by their numbers; `traces`, the points of sensors; and `samples`: the `outlines` of
    bodies by numbers of their own points, and their deviations from the nominal motion [m], shape
    (samples, points, 2, times).
    """
    if not isinstance(response, DynamicResponse | StaticResponse):
        return None, ["The response is not a mechanism of flexband, so that there is no animation."]
    try:
        motion, remarks = _of_mechanism(response, space, samples)
    except Exception as error:  # whatever a builder raises
        reason = " ".join(str(error).split())
        if not samples:
            return None, [f"The motion could not be simulated: {reason}"]
        motion, remarks = motion_data(response, space, samples=0)
        remarks = [f"Samples of the inputs could not be simulated: {reason}", *remarks]
    return motion, remarks


def _of_mechanism(
    response: DynamicResponse | StaticResponse, space: Space, samples: int
) -> tuple[dict[str, Any], list[str]]:
    with without_warnings():
        mechanism = response.builder(**space.arguments_at(*_points(space, samples)))
        if response.element_parts > 1:
            mechanism = mechanism.refined(response.element_parts)
        scene, tracks = Scene(mechanism, assembled(mechanism)), Tracks(mechanism)
        items = _items(scene, tracks)
        times, outputs = _recorded(response, replace(mechanism, sensors=tracks.sensors))
    good = np.asarray(np.isfinite(outputs).all(axis=(1, 2)))
    if not good[0]:
        raise RunError("the nominal motion fails", {})
    parts = tracks.split(outputs[good])
    lengths = np.hypot(*np.moveaxis(parts["direction"][0], 1, 0))[:, None]
    parts["direction"] = parts["direction"] / np.where(lengths > 0, lengths, 1.0)
    nominal = {kind: _packed(kind, values[0]) for kind, values in parts.items()}
    motion = {"times": packed(times), **nominal, **items}
    motion["samples"] = _samples(items["bodies"], parts["position"])
    failed = int((~good).sum())
    few = f"{are(failed, 'sample')} not drawn, of {samples}, since their motion fails."
    return motion, [few] if failed else []


def _points(space: Space, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Return ξ and η of the nominal motion and of samples, the first half of them at corners."""
    xi, eta = nested_points(samples, space.interval_dimension, space.families, SEED)
    eta[: (samples + 1) // 2] = np.sign(eta[: (samples + 1) // 2])
    nominal = space.nominal()
    return np.concatenate([nominal[0], xi]), np.concatenate([nominal[1], eta])


def _recorded(
    response: DynamicResponse | StaticResponse, mechanism: Mechanism
) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and outputs (samples, outputs, times), NaN for samples that fail."""
    if isinstance(response, StaticResponse):
        at_rest = response.outputs(mechanism, {})
        values = at_rest.values.reshape(-1, at_rest.shape[-1], 1)
        return np.array([response.time]), values
    outputs = round(response.duration / response.output_step)
    every = -(-outputs // FRAMES)
    between = every * response.output_step
    try:
        motion, _ = simulated(
            mechanism,
            duration=outputs // every * between,
            step=between,
            substeps=every * response.step_parts,
            integrator=response.integrator,
            threads=response.threads,
        )
    except RunError as error:
        if error.results is None:
            raise
        motion = error.results
    return motion["time"].values, motion.values.reshape(-1, *motion.shape[-2:])


def _items(scene: Scene, tracks: Tracks) -> dict[str, Any]:
    """Return everything that is drawn of the nominal motion."""
    mechanism = scene.mechanism
    loads = [load_item(scene, tracks, name) for name in mechanism.loads]
    reactions = [reaction_item(scene, tracks, name) for name in mechanism.joints]
    moving = Position, Velocity, Acceleration  # whose paths tell something, unlike that of an Angle
    points = {
        name: sensor.point
        for name, sensor in mechanism.sensors.items()
        if isinstance(sensor, moving)
    }
    return {
        "bodies": [body_item(scene, tracks, name) for name in mechanism.bodies],
        "joints": [joint_item(scene, tracks, name) for name in mechanism.joints],
        "supports": [
            support for name in mechanism.joints for support in supports(scene, tracks, name)
        ],
        "loads": [load for load in loads if load["kind"] != "force"],
        "forces": [symbol for symbol in (*reactions, *loads) if symbol and "force" in symbol],
        "traces": [
            {"name": name, "at": tracks.point(point)}
            for name, point in points.items()
            if isinstance(point, str)
        ],
    }


def _samples(bodies: list[dict[str, Any]], positions: np.ndarray) -> dict[str, Any]:
    """Return outlines of bodies and their deviations from the nominal motion."""
    outlines = [outline(body) for body in bodies]
    points = list(dict.fromkeys(point for line in outlines for point in line["points"]))
    for line in outlines:
        line["points"] = [points.index(point) for point in line["points"]]
    apart = positions[1:, points] - positions[:1, points]
    most = max(1, MAX_NUMBERS // apart[:1].size) if apart.size else 0
    return {
        "points": points,
        "outlines": outlines,
        "deviation": _packed("deviation", apart[:most]),
    }


def _packed(kind: str, values: np.ndarray) -> dict[str, Any]:
    """Return an array packed in steps as fine as its kind needs."""
    return packed(values, float(np.abs(values).max(initial=0.0)) / LEVELS[kind] or 1.0)
