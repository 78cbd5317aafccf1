"""Impulses where the speed of a prescribed motion jumps: in words, and as remarks on runs."""

from __future__ import annotations

from collections import Counter, defaultdict

from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.batch import Impulse
from flexband.remarks.collection import catch
from flexband.remarks.remark import Remark, RemarkKind


def impulses_text(system: System, impulses: list[Impulse]) -> str:
    """Return the impulses of joints that have sensors, in the order of time."""
    output_numbers = [k for k, name in enumerate(system.outputs) if name in system.impulsive]
    order: dict[int, list[Impulse]] = defaultdict(list)
    count: Counter[int] = Counter()
    for impulse in impulses:
        count[impulse.sample] += 1
        order[count[impulse.sample]].append(impulse)
    lines = []
    for group in order.values():
        when = _range([impulse.time for impulse in group], "s")
        sizes = (
            f"{system.outputs[k]} {_range([i.outputs[k] for i in group], system.units[k] + ' s')}"
            for k in output_numbers
        )
        lines.append(f"at t = {when}: {', '.join(sizes) or 'no joint has a sensor of its force'}")
    return "; ".join(lines)


def _remark_on_impulse(system: System, impulse: Impulse) -> Remark:
    """Return that outputs do not show an impulse, with those of which there is one."""
    names = [name for name in system.outputs if name in system.impulsive]
    sizes = {name: float(impulse.outputs[system.outputs.index(name)]) for name in names}
    largest = max(map(abs, sizes.values()), default=0.0)
    threshold = 1e-9 * largest  # below it is rounding
    outputs = tuple(name for name, size in sizes.items() if abs(size) > threshold)
    text = (
        f"the speed of a prescribed motion jumps at t = {impulse.time:.4g} s: the impulse that "
        "this takes is in no force at an instant"
    )
    return Remark(
        RemarkKind.IMPULSES, text, size=largest, outputs=outputs,
        time=float(impulse.time), sample=impulse.sample,
    )  # fmt: skip


def keep_impulses(system: System, impulses: list[Impulse]) -> None:
    """Have a study keep that outputs do not show these impulses."""
    for impulse in impulses:
        catch(_remark_on_impulse(system, impulse))


def _range(values: list[float], unit: str) -> str:
    """Return equal values as one number, others as a range."""
    low = f"{min(values):.6g}"
    high = f"{max(values):.6g}"
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"
