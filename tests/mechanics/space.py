"""A rigid body with three axes, in forms, and what tests read of it."""

import numpy as np
from scipy.spatial.transform import Rotation

from flexband.mechanics.bodies.body import Body
from flexband.mechanics.kernels.forms import Form, Frame, dot
from flexband.mechanics.sensors.motion import Sensor

MASS = 15.0
INERTIA = np.array([0.25, 0.4, 0.3])
NONE = Rotation.identity()


class SpatialBody(Body):
    """A rigid body with the coordinates [r, g₁, g₂, g₃] and six conditions on its axes."""

    per_node = 12
    dimension = 3

    def __init__(self, place, turn=NONE, velocity=(0, 0, 0), spin=(0, 0, 0), **points):
        self.points = {"center": (0.0, 0.0, 0.0), "foot": (0.0, -1.0, 0.0), **points}
        axes = turn.as_matrix()  # columns are the axes
        self.start = [np.asarray(c) for c in (*place, *axes.T.ravel())]
        rates = np.cross(spin, axes.T).ravel()  # the spin is in global axes
        self.rates = [np.asarray(c) for c in (*velocity, *rates)]

    def coordinates(self):
        return self.start

    def velocities(self):
        return self.rates

    def mass_entries(self):
        numbers = np.repeat([MASS, *(INERTIA.sum() / 2 - INERTIA)], 3)
        return {(k, k): np.asarray(number) for k, number in enumerate(numbers)}

    def frame(self, name, first):
        vectors = np.array([Form.variable(first + k) for k in range(12)]).reshape(4, 3)
        place, *axes = map(tuple, vectors)
        return Frame(place, tuple(axes), rigid=True).translate(*self.points[name])

    def constraints(self, first):
        x, y, z = axes = self.frame("center", first).axes
        return [*(dot(v, v) - 1.0 for v in axes), dot(x, y), dot(y, z), dot(x, z)]


class Coordinates(Sensor):
    """All coordinates of a body."""

    units = tuple((f" {k}", "1") for k in range(12))

    def __init__(self, body):
        self.body = body

    def rows(self, model):
        frame = model.frame(self.body)
        return [form for vector in (frame.position, *frame.axes) for form in vector]


def axes_of(motion, name):
    names = [f"{name} {k}" for k in range(3, 12)]
    return motion.sel(output=names).values.T.reshape(-1, 3, 3).transpose(0, 2, 1)
