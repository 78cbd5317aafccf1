"""Floating-point rate of a Newton iteration, compared with the peak of one core.

Operations are counted by running the engine's formulas, uncompiled, on numbers that count the
operations on them; a multiply-add counts as two. The peak is measured in the same run, by
multiply-adds on lanes in twelve independent chains.
"""

from __future__ import annotations

import runpy
from contextlib import contextmanager
from types import ModuleType

import numpy as np

from benchmarks.harness import ROOT, alternate, medians, options, report
from benchmarks.speed.kernels import kernel_cases, kernel_time
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.engine.batch import begin
from flexband.mechanics.kernels import (
    angles,
    equations,
    factorization,
    lanes,
    laws,
    springs,
)
from flexband.mechanics.kernels.elements import (
    beams,
    cables,
    centre_line,
    continuum,
    continuum_strains,
    elastic,
)
from flexband.mechanics.kernels.lane_arrays import WIDTH, zeros
from flexband.mechanics.kernels.lanes import cached, load, store

CHAINS = 12
MODULES = (
    lanes, continuum_strains, continuum, centre_line, beams, cables, elastic, angles, springs,
    laws, equations, factorization,
)  # fmt: skip


@cached
def multiply_adds(count, array):
    """Compute 12 × `count` multiply-adds."""
    x = load(array, 0)
    y = load(array, 1)
    a = x
    b = y
    c = x
    d = y
    e = x
    f = y
    g = y
    h = x
    i = y
    j = x
    k = y
    m = x
    for _ in range(count):
        a = a * x + y
        b = b * x + y
        c = c * x + y
        d = d * x + y
        e = e * x + y
        f = f * x + y
        g = g * x + y
        h = h * x + y
        i = i * x + y
        j = j * x + y
        k = k * x + y
        m = m * x + y
    store(array, 2, a + b + c + d + e + f + g + h + i + j + k + m)


class CountingNumber(float):
    """A number that counts the operations on it."""

    count = 0

    @staticmethod
    def _counting(name: str):
        plain = getattr(float, name)

        def operation(*numbers):
            CountingNumber.count += 1
            return CountingNumber(plain(*numbers))

        return operation


for _name in ("add", "radd", "sub", "rsub", "mul", "rmul", "truediv", "rtruediv", "neg"):
    setattr(CountingNumber, f"__{_name}__", CountingNumber._counting(f"__{_name}__"))


@contextmanager
def counting():
    """Run the engine as plain Python on counting numbers, for one sample in lane 0."""
    plain = {
        "load": lambda array, row: CountingNumber(array[row, 0]),
        "load_rows": lambda array, row, count: tuple(
            CountingNumber(number) for number in array[row : row + count, 0]
        ),
        "store": lambda array, row, value: array.__setitem__((row, 0), value),
        "store_rows": lambda array, row, values: array.__setitem__(
            (slice(row, row + len(values)), 0), values
        ),
        "load_each": lambda arrays, row: tuple(CountingNumber(array[row, 0]) for array in arrays),
        "store_each": lambda arrays, row, values: [
            array.__setitem__((row, 0), value) for array, value in zip(arrays, values, strict=True)
        ],
        "plus": lambda a, factor, b: tuple(x + factor * y for x, y in zip(a, b, strict=True)),
        "times": lambda factor, a: tuple(factor * x for x in a),
        "add_to": lambda array, row, value: array.__setitem__(
            (row, 0), CountingNumber(array[row, 0]) + value
        ),
        "splat": CountingNumber,
        "less": lambda a, b: CountingNumber(float.__lt__(a, b)),
        "where": lambda mask, a, b: a if mask else b,
        "magnitude": lambda a: CountingNumber(abs(float(a))),
        "maximum": lambda a, b: CountingNumber(max(float(a), float(b))),
    }
    originals: list[tuple[ModuleType, str, object]] = []
    for module in MODULES:
        for name, value in list(vars(module).items()):
            new = plain.get(name, getattr(value, "py_func", None))
            if new is not None and callable(value):
                originals.append((module, name, value))
                setattr(module, name, new)
    try:
        yield
    finally:
        for module, name, value in originals:
            setattr(module, name, value)


def operations(action) -> int:
    """Return the number of operations of an action of the engine for one sample."""
    with counting():
        CountingNumber.count = 0
        action()
    return CountingNumber.count


def main() -> None:
    arguments = options(__doc__, 10_000)
    mechanism = runpy.run_path(str(ROOT / "examples" / "paper" / "slider_crank.py"))["slider_crank"]
    system = assemble(mechanism(np.linspace(0.194, 0.206, WIDTH), 1000.0, 69e9, 0.34))
    structure = system.structure
    values = pack(system, np.array([0.0, 1e-3]))(0)
    work, _ = begin(system, values)
    z = work.z
    matrix = work.matrix
    pattern = structure.pattern
    # Count operations of each part.
    count = {
        "residual": operations(
            lambda: equations.residual(structure, values, 0, z, work.r, work.blocks)
        ),
        "tangent": operations(
            lambda: equations.tangent(
                structure, values, 0, z, CountingNumber(1e-7), 0.0, matrix, work.blocks
            )
        ),
        "factorization": operations(
            lambda: factorization.factorize(pattern, matrix, CountingNumber(1e-12), work.r)
        ),
        "solution": operations(
            lambda: factorization.solve(pattern, pattern.below, matrix, (work.r,))
        ),
    }
    # Measure their times.
    work, _ = begin(system, values)
    array = zeros(3) + 0.5
    repeats = np.int64(arguments.samples)
    cases = {"multiply-adds": lambda: kernel_time(multiply_adds, repeats, array)}
    cases |= kernel_cases(arguments.samples, structure, values, work)
    cases["multiply-adds"]()
    measurements = alternate(cases, arguments.repeats)
    us = medians(measurements)
    us["factorization"] = us["tangent and factorization"] - us["tangent"]
    # Report rates relative to the peak.
    peak = 2 * CHAINS * WIDTH / us["multiply-adds"] / 1e3
    rows = [["multiply-adds, twelve chains", str(2 * CHAINS), "", f"{peak:.1f}", "1.00"]]
    parts = [(name, count[name], us[name]) for name in count]
    parts.append(("a Newton iteration with a new matrix", sum(count.values()),
                  us["residual"] + us["tangent and factorization"] + us["solution"]))  # fmt: skip
    parts.append(("a Newton iteration with an old matrix", count["residual"] + count["solution"],
                  us["residual"] + us["solution"]))  # fmt: skip
    for name, flops, time_ in parts:
        rate = flops * WIDTH / time_ / 1e3
        rows.append([name, str(flops), f"{time_:.2f}", f"{rate:.1f}", f"{rate / peak:.2f}"])
    report(
        arguments.output,
        "roofline",
        ["case", "operations per sample", f"µs per block of {WIDTH}", "Gflop/s", "part of peak"],
        rows,
        measurements | {"operations": count},
        [f"one core; the work space of a block is {sum(a.nbytes for a in work) / 1024:.0f} KiB"],
    )


if __name__ == "__main__":
    main()
