"""The error of a motion that is due to the step and to the elements, from finer runs."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from flexband.basics.rounding import Units
from flexband.basics.warning import without_warnings
from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha
from flexband.mechanics.engine.step_check import StepCheck
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.simulate import simulate


def discretization_error(
    mechanism: Mechanism,
    *,
    duration: float,
    step: float,
    integrator: GeneralizedAlpha | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Estimate the error of `simulate` that is due to its step and to the elements of the members.

    The motion is computed at the step h with n elements, at h/2 with n, and at h/2 with 2n, which
    takes seven times as long as the motion itself. Samples that diverge and are completed with half
    the step are compared with a quarter of it. The error of a second-order method is 4/3 of
    what changes (Richardson). Order two is that of the integrator and of continuum elements. The
    other elements have order four, for which this is 1.25 times the error of the mesh.

    Where samples choose their steps, see `GeneralizedAlpha`, the finer runs have a tenth of the
    tolerance instead of half the step, and the error is what changes.

    Errors of vibrations have zeros, which say nothing about the accuracy. Each error is therefore a
    root mean square over a window of a twentieth of the duration about each time. If it is as large
    as the output's own variation, the step or the mesh does not resolve the output at all.

    Parameters
    ----------
    mechanism, duration, step, integrator, threads : as in `simulate`.

    Returns
    -------
    Estimates with the dims and coordinates of `simulate`: `step_error`, `mesh_error` and `error`,
    that of both together, in the unit of each output; and, without times, `relative_error`, the
    root mean square of the error over the whole motion, relative to the standard deviation of the
    output in time. ``attrs["relative_error"]`` is the largest of them, that of
    ``attrs["worst_output"]``, whose two parts are ``attrs["relative_step_error"]`` and
    ``attrs["relative_mesh_error"]``. ``attrs["window"]`` is the length of the window [s].
    ``attrs["few_steps"]`` is that of `simulate`.

    Raises
    ------
    InputError, AssemblyError, SimulationError
        As `simulate` does, also if one of the finer runs fails.
    """
    run = partial(simulate, duration=duration, step=step, integrator=integrator, threads=threads)
    coarse = run(mechanism)
    fine_mechanism = mechanism.refined()

    def run_meshes(substeps: int) -> list[xr.DataArray]:
        half = run(mechanism, substeps=substeps)
        return [
            half,
            half if fine_mechanism is mechanism else run(fine_mechanism, substeps=substeps),
        ]

    # With half the step, and then with twice the elements as well.
    order_factor = 4 / 3  # at second order
    tenth = _with_tenth(mechanism, integrator)
    if tenth:
        run = partial(run, integrator=tenth)
        order_factor = 1.0
    with without_warnings():
        half, fine = run_meshes(1 if tenth else 2)
        if "halved_step" in coarse.attrs:
            samples = np.arange(coarse.sizes.get("sample", 1))
            halved_mask = np.isin(samples, coarse.attrs["halved_step"])
            halved_mask = halved_mask.reshape(-1, *[1] * (coarse.ndim - 1))
            half, fine = (
                at_half.copy(data=np.where(halved_mask, at_quarter, at_half))
                for at_half, at_quarter in zip((half, fine), run_meshes(4), strict=True)
            )
    # Errors over the whole motion and in windows.
    parts = {"step_error": coarse - half, "mesh_error": half - fine, "error": coarse - fine}
    parts = {name: order_factor * part for name, part in parts.items()}
    scale = _scale(fine)
    relative = {name: (part**2).mean("time") ** 0.5 / scale for name, part in parts.items()}
    width = max(1, round(0.05 / 2 * (coarse.sizes["time"] - 1)))
    result = xr.Dataset({name: _smooth(part, width) for name, part in parts.items()})
    result["relative_error"] = relative["error"]
    worst = np.unravel_index(np.argmax(relative["error"].values), relative["error"].shape)
    result.attrs["worst_output"] = str(coarse["output"].values[worst[-1]])
    for name, part in relative.items():
        result.attrs[f"relative_{name}"] = float(part.values[worst])
    if "few_steps" in coarse.attrs:
        result.attrs["few_steps"] = coarse.attrs["few_steps"]
    result.attrs["window"] = 2 * width * float(coarse.time[1])
    return result


def _with_tenth(
    mechanism: Mechanism, integrator: GeneralizedAlpha | None
) -> GeneralizedAlpha | None:
    """Return the integrator with a tenth of the tolerance of steps that samples choose, or None."""
    integrator = integrator or GeneralizedAlpha()
    limits = integrator.step_limits(mechanism.model.state, 1.0)
    return replace(integrator, step_tolerance=0.1 * limits.tolerance) if limits else None


def _scale(motion: xr.DataArray) -> xr.DataArray:
    """Return the standard deviation of each output in time, as far as it is above rounding.

    An output that is constant, up to rounding, is compared with the largest of the same unit, and
    an angle with one radian.
    """
    size = abs(motion).max("time")
    units = Units.along(motion, ("output",))
    angle = size["unit"].values == "rad"
    sizes = np.maximum(size.values, angle).reshape(-1, len(angle))
    smallest_scales = [
        units.least_variation(sample_sizes, StepCheck().min_scale) for sample_sizes in sizes
    ]
    scale = np.maximum(motion.std("time").values, np.reshape(smallest_scales, size.shape))
    return size.copy(data=np.where(scale > 0, scale, 1.0))


def _smooth(error: xr.DataArray, width: int) -> xr.DataArray:
    """Return the root mean square over `width` times before and after each time."""
    count = error.sizes["time"]
    total = np.cumsum(error.values**2, axis=-1)
    total = np.concatenate([np.zeros_like(total[..., :1]), total], axis=-1)
    first = np.maximum(np.arange(count) - width, 0)
    after = np.minimum(np.arange(count) + width + 1, count)
    mean = (total[..., after] - total[..., first]) / (after - first)
    return error.copy(data=np.sqrt(np.maximum(mean, 0.0)))
