"""The slider–crank of examples/worn_pin.py in minimal coordinates: an independent program.

The crank turns at a given speed, so that the rod's angle φ and the slider's place x are all. With
the crank's end P, the rod's unit vectors n along it and t across, its end E = P + L n, and the
force F on this end and −F on the slider:

    (I + m L²/4) φ̈ = L t·F − (m L/2) t·P̈,    M ẍ = −F_x.

The pin is a point in a hole of the slider whose radius is the clearance c: beyond it by δ, the
force is K δ^1.5 (1 + a δ̇/δ̇₀) towards the middle of the hole, never outwards. Once the pin leaves
and is pressed in again, its damping is at most 2 ζ √(k m) with the tangent stiffness k and the
mass m of the gap, and it falls to that where the pin is pressed in more slowly than by its impact.
A method of Dormand and Prince with chosen steps, which end where the gap closes or turns, serves
one sample at a time.
"""

from __future__ import annotations

import numba
import numpy as np

CRANK = 0.05
ROD = 0.12
ROD_MASS = 0.21
ROD_INERTIA = 2.5e-5
SPEED = 2 * np.pi * 5000 / 60
K = 6.61e10
A = 0.75 * (1 - 0.9**2)
LEAST_SPEED = 1e-3
ZETA = -np.log(0.9) / np.hypot(np.pi, np.log(0.9))
ROD_MASS_OF_TURNING = ROD_INERTIA + ROD_MASS * ROD**2 / 4
LATE = 0.012
END = 0.036
TOLERANCE = 1e-10
LONGEST = 5e-6

NODES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
WEIGHTS = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
    [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
    [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
])  # fmt: skip
ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])


@numba.njit
def contact(t, y, clearance):
    """Return the depth, its rate, and the direction from the hole's middle to the pin."""
    angle = SPEED * t
    c = np.cos(y[0])
    s = np.sin(y[0])
    dx = CRANK * np.cos(angle) + ROD * c - y[1]
    dy = CRANK * np.sin(angle) + ROD * s
    vx = -CRANK * SPEED * np.sin(angle) - ROD * s * y[2] - y[3]
    vy = CRANK * SPEED * np.cos(angle) + ROD * c * y[2]
    distance = np.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return -clearance, 0.0, 1.0, 0.0
    nx = dx / distance
    ny = dy / distance
    return distance - clearance, nx * vx + ny * vy, nx, ny


@numba.njit
def force(depth, rate, impact_speed, impact_over, gap_mass):
    """Return the force of a contact that began with `impact_speed`; none where that is negative.

    `gap_mass` is the mass of the gap, and `impact_over` whether its impact is over.
    """
    if impact_speed < 0.0 or depth <= 0.0:
        return 0.0
    speed = max(impact_speed, LEAST_SPEED)
    elastic = K * depth**1.5
    c = A * elastic / speed
    min_damping = 2.0 * ZETA * np.sqrt(1.5 * elastic / depth * gap_mass)
    squared_speed = (
        2.0 * elastic * depth / (2.5 * gap_mass)
    )  # squared speed of an impact of this depth
    if impact_over:
        c = min(c, min_damping)
    elif squared_speed > (2.0 * speed) ** 2:
        c = min(c, max(c * (2.0 * speed) ** 2 / squared_speed, min_damping))
    return max(0.0, elastic + c * rate)


@numba.njit
def mass_of_gap(y, nx, ny, mass):
    """Return 1 over the acceleration of the gap by a unit force along it."""
    across = ROD * (np.cos(y[0]) * ny - np.sin(y[0]) * nx)
    return 1.0 / (across**2 / ROD_MASS_OF_TURNING + nx**2 / mass)


@numba.njit
def rates(t, y, clearance, mass, impact_speed, impact_over, f):
    """Fill in the rates of φ, x and their rates."""
    depth, rate, nx, ny = contact(t, y, clearance)
    F = force(depth, rate, impact_speed, impact_over, mass_of_gap(y, nx, ny, mass))
    c = np.cos(y[0])
    s = np.sin(y[0])
    ax = -CRANK * SPEED**2 * np.cos(SPEED * t)
    ay = -CRANK * SPEED**2 * np.sin(SPEED * t)
    moment = -ROD * F * (c * ny - s * nx) - ROD_MASS * ROD / 2 * (c * ay - s * ax)
    f[0] = y[2]
    f[1] = y[3]
    f[2] = moment / ROD_MASS_OF_TURNING
    f[3] = F * nx / mass


@numba.njit
def try_step(t, y, h, clearance, mass, impact_speed, impact_over, f, new):
    """Fill in the state after a step; return its error in parts of what is allowed."""
    for stage in range(7):
        for k in range(4):
            new[k] = y[k]
            for earlier in range(stage):
                new[k] += h * WEIGHTS[stage, earlier] * f[earlier, k]
        rates(t + NODES[stage] * h, new, clearance, mass, impact_speed, impact_over, f[stage])
    worst = 0.0
    for k in range(4):
        error = 0.0
        for stage in range(7):
            error += h * ERROR[stage] * f[stage, k]
        scale = TOLERANCE * (1.0 if k < 2 else 1e3)
        worst = max(worst, abs(error) / scale)
    return worst


@numba.njit
def sample(clearance, mass, numbers):
    """Fill in how often the gap closes, and the largest forces of the run and after a turn."""
    y = np.array([0.0, CRANK + ROD, -CRANK * SPEED / ROD, 0.0])
    f, new = np.empty((7, 4)), np.empty(4)
    t, h, impact_speed, impact_over = 0.0, 1e-7, -1.0, False
    numbers[:] = 0.0
    while t < END:
        h = min(h, LONGEST, END - t)
        error = try_step(t, y, h, clearance, mass, impact_speed, impact_over, f, new)
        if error > 1.0:
            h *= max(0.2, 0.9 * error**-0.2)
            continue
        depth, rate, _, _ = contact(t + h, new, clearance)
        leaves = contact(t, y, clearance)[1] < 0.0
        actual_step = h
        event = 0  # 1 where it closes or opens, 2 where it is pressed in again
        if (impact_speed < 0.0) == (depth > 0.0) and depth != 0.0:
            event = 1
        elif impact_speed >= 0.0 and not impact_over and leaves and rate > 0.0:
            event = 2
        # Bisect the step for the event.
        if event > 0:
            low, high = 0.0, h
            for _ in range(60):
                actual_step = (low + high) / 2
                try_step(t, y, actual_step, clearance, mass, impact_speed, impact_over, f, new)
                middle_depth, middle_rate, _, _ = contact(t + actual_step, new, clearance)
                if (middle_depth > 0.0) == (depth > 0.0) if event == 1 else middle_rate > 0.0:
                    high = actual_step
                else:
                    low = actual_step
            actual_step = high
            try_step(t, y, actual_step, clearance, mass, impact_speed, impact_over, f, new)
        # Accept the step, and change the state of the contact.
        t += actual_step
        y[:] = new
        depth, rate, nx, ny = contact(t, y, clearance)
        if impact_speed < 0.0 and depth > 0.0:
            impact_speed, impact_over = max(rate, 0.0), False
            numbers[0] += 1
        elif impact_speed >= 0.0 and depth <= 0.0:
            impact_speed = -1.0
        elif event == 2:
            impact_over = True
        F = force(depth, rate, impact_speed, impact_over, mass_of_gap(y, nx, ny, mass))
        numbers[1] = max(numbers[1], F)
        if t >= LATE:
            numbers[2] = max(numbers[2], F)
        h = actual_step * min(5.0, 0.9 * max(error, 1e-8) ** -0.2) if actual_step == h else h


@numba.njit
def samples(clearances, masses, numbers):
    """Fill in what `sample` does for each of some samples, (samples, 3)."""
    for k in range(len(clearances)):
        sample(clearances[k], masses[k], numbers[k])
