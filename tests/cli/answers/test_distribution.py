"""The commands that bound quantiles and values of a saved surrogate."""

import numpy as np
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app

TIME = np.linspace(0.0, 1.0, 5)


def decay(amplitude, rate):
    values = amplitude[:, None] * np.exp(-rate[:, None] * TIME)
    return xr.DataArray(
        np.stack([values, 2 * values], axis=1),
        dims=("sample", "output", "time"),
        coords={"output": ["u", "v"], "unit": ("output", ["m", "N"]), "time": TIME},
    )


def call(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_quantiles_and_range(tmp_path):
    inputs = {"amplitude": fb.Normal(1.5, 0.2), "rate": fb.Interval(0.1, 0.2)}
    fb.save_surrogate(fb.expand(decay, inputs, fb.PCCI(1, 3)), tmp_path / "surrogate.npz")
    result = call("distribution", tmp_path, "-p", 0.1, "-p", 0.9, "--samples", 128)
    assert result.exit_code == 0, result.output
    assert "lowest" in result.output
    assert (tmp_path / "quantiles.png").is_file()
    with xr.open_dataset(tmp_path / "quantiles.nc", engine="scipy") as quantiles:
        assert quantiles["quantiles"].dims == ("bound", "probability", "output", "time")
        upper = quantiles["quantiles"].sel(bound="upper", probability=0.9, output="v", time=0)
        assert abs(float(upper) - 2 * (1.5 + 1.28155 * 0.2)) < 0.04
    result = call("distribution", tmp_path / "surrogate.npz", "--kind", "range", "--json")
    assert result.exit_code == 0, result.output
    assert '"probability": "0.99"' in result.output
    assert (tmp_path / "range.png").is_file()
    result = call("distribution", tmp_path, "-p", 2)
    assert result.exit_code == 2
    assert "above 0 and below 1" in result.output
