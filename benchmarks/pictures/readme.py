"""Draw the picture of the README: a mechanism and its bands (`make gallery`)."""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

import flexband as fb

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs" / "images"
ENLARGED = 10
"""How many times the region is drawn as large as it is."""


def main() -> None:
    """Draw a mechanism, the region of a point, and the bands of a deflection."""
    example = runpy.run_path(str(ROOT / "examples" / "four_bar.py"))

    def with_sensors(**values):
        mechanism = example["four_bar"](**values)
        sensors = {"bend": fb.Deflection("coupler"), "C": fb.Position("coupler.0.5")}
        return replace(mechanism, sensors=sensors)

    response = fb.dynamic_response(with_sensors, duration=0.34, step=2.5e-4, output_step=1e-3)
    surrogate = fb.expand(response, example["inputs"], fb.AdaptivePCCI(tolerance=0.01))
    with fb.plot.style(2):
        figure = Figure(figsize=(7.0, 2.6), dpi=200)
        drawing, band = figure.subplots(1, 2)
        fb.plot.path(enlarge_path(fb.analysis.path(surrogate, "C_X", "C_Y", sigmas=3)), ax=drawing)
        fb.plot.mechanism(example["four_bar"](example["COUPLER"], 2.8e9), ax=drawing)
        drawing.set(title=f"where the middle of the coupler can be, {ENLARGED} times enlarged")
        bands = surrogate.bands()
        scaled = bands.assign({k: 1e3 * bands[k] for k in ("mean", "error_bar")})
        fb.plot.bands(scaled.assign_coords(unit=("output", ["mm", "m", "m"])), "bend", ax=band)
        figure.savefig(IMAGES / "four_bar.png")


def enlarge_path(path: xr.Dataset) -> xr.Dataset:
    """Return a path with larger regions."""
    return path.assign(
        {
            name: path[f"{name}_nominal"] + ENLARGED * (path[name] - path[f"{name}_nominal"])
            for name in "xy"
        }
    ).assign_attrs(path.attrs)


if __name__ == "__main__":
    main()
