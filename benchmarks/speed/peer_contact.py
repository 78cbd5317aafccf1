"""A mass on a spring that hits a stop, in flexband and with Exudyn's `ObjectContactCoordinate`.

The stop is a linear spring without damping where the mass passes its middle position, so that the
instants of impacts are known exactly. Exudyn solves the same equation with one coordinate. Of the
settings listed below, the fastest that is as accurate as flexband counts.
"""

from __future__ import annotations

import time
from itertools import product

import numpy as np

import flexband as fb
from benchmarks.harness import alternate, medians
from benchmarks.speed import peer_exudyn as peer
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.engine.batch import march_block
from flexband.mechanics.kernels.lane_arrays import WIDTH

MASS = 1.0
SPRING = 400.0
AMPLITUDE = 0.1
DURATION = 0.42  # kg, N/m, m, s: three impacts
FREQUENCY = np.sqrt(SPRING / MASS)
CHECKED = 64
IMPLICIT = [("GeneralizedAlpha", h, 1e-8) for h in (8e-4, 7e-4, 6e-4, 5e-4, 4e-4, 2e-4)]
EXPLICIT = [
    ("DOPRI5", DURATION / parts, tolerance)
    for tolerance, parts in product((1e-2, 1e-3, 1e-4, 1e-5, 1e-6), (8, 20))
]


def exact(stiffness: np.ndarray) -> np.ndarray:
    """Return the instants (samples, 3) [s] for these stiffnesses of the stop [N/m]."""
    interval = np.pi / FREQUENCY + np.pi / np.sqrt((SPRING + stiffness) / MASS)
    return np.pi / (2 * FREQUENCY) + np.outer(interval, range(3))


def error(instants: np.ndarray, stiffness: np.ndarray) -> float:
    """Return the largest error of an instant, relative to the interval between impacts."""
    exact_instants = exact(stiffness)
    return float(
        (np.abs(instants - exact_instants) / (exact_instants[:, 1:2] - exact_instants[:, :1])).max()
    )


def flexband_instants(stiffness: np.ndarray, tolerance: float) -> tuple[np.ndarray, float]:
    """Return instants (samples, 3) [s], and CPU seconds per sample without assembly."""
    law = fb.contact.KeepsRestitution(stiffness=stiffness, exponent=1.0)
    model = fb.Mechanism(
        bodies={"mass": fb.PointMass(mass=MASS, position=(AMPLITUDE, 0.0))},
        loads={
            "spring": fb.Spring("mass", (-1.0, 0.0), stiffness=SPRING, rest_length=1.0),
            "stop": fb.contact.Stop("mass", (0.0, 0.0), law, lower=0.0),
        },
        sensors={"impacts": fb.contact.Contacts("stop", first=3)},
    )
    system = assemble(model)
    integrator = fb.GeneralizedAlpha(step_tolerance=tolerance)
    limits = integrator.step_limits(system.structure.state, DURATION)
    packed = pack(system, np.array([0.0, DURATION]), None, tolerance)
    method = integrator.coefficients(DURATION)
    rounds = len(packed.schedule.parts)
    rows = []
    start_time = time.process_time()
    for block in range(-(-len(stiffness) // WIDTH)):
        values = packed(block)
        motion = march_block(system, method, integrator.tolerance, values, rounds, limits=limits)
        if motion.failure[0].any():
            raise RuntimeError("a run failed")
        rows.append(motion.series[-1, 1:4].T)
    cpu = time.process_time() - start_time
    return np.concatenate(rows)[: len(stiffness)], cpu / len(stiffness)


def _run_exudyn(stiffness: float, setting: tuple[str, float, float], *, store_steps: bool):
    """Return CPU seconds of a run of Exudyn and, if `store_steps`, their times, places, speeds."""
    exu = peer._exudyn()
    from exudyn import itemInterface as interface  # noqa: N813, PLC0415

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.AddNode(interface.NodePointGround())
    node = mbs.AddNode(interface.Node1D(referenceCoordinates=[0.0], initialCoordinates=[AMPLITUDE]))
    mbs.AddObject(interface.Mass1D(nodeNumber=node, mass=MASS))
    ends = [
        mbs.AddMarker(interface.MarkerNodeCoordinate(nodeNumber=number, coordinate=0))
        for number in (ground, node)
    ]
    state = mbs.AddNode(
        interface.NodeGenericData(initialCoordinates=[AMPLITUDE], numberOfDataCoordinates=1)
    )
    mbs.AddObject(interface.CoordinateSpringDamper(markerNumbers=ends, stiffness=SPRING))
    mbs.AddObject(
        interface.ObjectContactCoordinate(
            markerNumbers=ends, nodeNumber=state, contactStiffness=stiffness
        )
    )
    kind = exu.OutputVariableType
    sensors = [
        mbs.AddSensor(
            interface.SensorNode(nodeNumber=node, outputVariableType=of, storeInternal=True)
        )
        for of in (kind.Coordinates, kind.Coordinates_t)
        if store_steps
    ]
    mbs.Assemble()
    solver, step, tolerance = setting
    simulation_settings = peer.settings(DURATION, step, 1.0, modified=True, dense=True)
    simulation_settings.timeIntegration.relativeTolerance = tolerance
    simulation_settings.timeIntegration.absoluteTolerance = tolerance
    simulation_settings.solutionSettings.sensorsWritePeriod = 0.0  # every step
    start_time = time.process_time()
    mbs.SolveDynamic(
        simulation_settings, solverType=getattr(exu.DynamicSolverType, solver), showHints=False
    )
    cpu = time.process_time() - start_time
    series = [mbs.GetSensorStoredData(number) for number in sensors]
    return cpu, (series[0][:, 0], series[0][:, 1], series[1][:, 1]) if store_steps else ()


def _instants(times: np.ndarray, place: np.ndarray, speed: np.ndarray) -> list[float]:
    """Return the first three instants [s], by cubic interpolation of the steps."""
    instants = []
    for k in np.flatnonzero((place[:-1] > 0) & (place[1:] <= 0))[:3]:
        h, (a, b), (c, d) = times[k + 1] - times[k], place[k : k + 2], speed[k : k + 2]
        c = c * h
        d = d * h
        roots = np.roots([2 * a - 2 * b + c + d, 3 * b - 3 * a - 2 * c - d, c, a])
        real = roots.real[np.abs(roots.imag) < 1e-9]
        inside = real[(real > -1e-9) & (real < 1 + 1e-9)]
        instants.append(times[k] + h * inside.min(initial=1.0))
    return instants + [np.nan] * (3 - len(instants))


def exudyn_instants(stiffness: np.ndarray, setting: tuple[str, float, float]) -> np.ndarray:
    """Return the instants (samples, 3) [s] of Exudyn."""
    return np.array([_instants(*_run_exudyn(K, setting, store_steps=True)[1]) for K in stiffness])


def seconds(stiffness: np.ndarray, setting: tuple[str, float, float]) -> float:
    """Return CPU seconds per sample of Exudyn's solver."""
    return float(np.mean([_run_exudyn(K, setting, store_steps=False)[0] for K in stiffness]))


def compare(samples: int, repeats: int, tolerance: float) -> list[list]:
    """Return rows of case, CPU ms per sample and error; medians of alternating runs."""
    stiffness = np.random.default_rng(0).uniform(0.5e6, 2e6, samples)
    subset = stiffness[:CHECKED]
    cases = {}
    errors = {}
    for batch in (stiffness, stiffness[:1]):
        name = f"flexband, samples in a batch: {len(batch)}"
        cases[name] = lambda batch=batch: flexband_instants(batch, tolerance)[1]
        errors[name] = error(flexband_instants(batch, tolerance)[0], batch)
    limit = error(flexband_instants(subset, tolerance)[0], subset)
    for settings in (IMPLICIT, EXPLICIT):
        accurate = {
            s: e for s in settings if (e := error(exudyn_instants(subset, s), subset)) <= limit
        }
        best = min(accurate, key=lambda setting: seconds(subset, setting))
        name = "Exudyn, {} with steps of at most {:.3g} s, tolerance {:g}".format(*best)
        cases[name] = lambda best=best: seconds(subset, best)
        errors[name] = accurate[best]
    middle = medians(alternate(cases, repeats))
    return [[name, 1e3 * cpu, errors[name]] for name, cpu in middle.items()]
