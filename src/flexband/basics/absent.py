"""What flexband does not have, and what to do instead: the one table of error messages and docs.

Whoever adds a feature deletes its row.
"""

from __future__ import annotations

from typing import NamedTuple


class Absent(NamedTuple):
    """A feature that flexband does not have.

    Attributes
    ----------
    feature : what it is called.
    names : under which users look for it, in the namespace `flexband`.
    instead : what to do, as a sentence.
    """

    feature: str
    names: str
    instead: str


ABSENT = (
    Absent(
        "mechanisms in space",
        "RigidBody3D Beam3D Spherical SphericalJoint Ball BallJoint Universal Cylindrical Hooke",
        "Mechanisms are planar. Run another program's model of it as the response of a study, see "
        "docs/how-to/models.md.",
    ),
    Absent(
        "belts and chains",
        "Belt Chain Pulley Sprocket BeltDrive",
        "Gear couples two angles by a fixed ratio, as a belt without slip and stretch does; a "
        "Spring or a Cable is a strand.",
    ),
    Absent(
        "cams",
        "Cam Follower CamFollower CamProfile",
        "Prescribe the follower's motion by PrescribedTravel with the lift as a function of time.",
    ),
    Absent(
        "controllers",
        "Controller PID PIDController Actuator Motor Servo Hydraulics",
        "PrescribedRotation and PrescribedTravel are motors with a given motion, a TorsionSpring "
        "with a loads.Characteristic one with a torque–speed curve. Write control and hydraulics "
        "as a ForceLaw with `states`: integral parts, currents and pressures are its first-order "
        "states.",
    ),
    Absent(
        "joints that slide along beams and cables",
        "SlidingJoint MovingLoad ALECable",
        "A load that moves along a member is shared by forces at its nodes, see "
        "docs/how-to/mechanisms.md.",
    ),
    Absent(
        "plays that change within a run",
        "Clearance ClearanceJoint JointClearance",
        "A Play is constant in each run; its bounds of positions of a prescribed motion hold for "
        "every motion of the pins. For forces and impacts, use Revolute(clearance=…, law=…).",
    ),
    Absent(
        "plates, shells and solids",
        "Plate Shell Solid Membrane FiniteElements Superelement CraigBampton",
        "Flexible members are beams and cables.",
    ),
    Absent(
        "import of CAD, URDF and other programs' models",
        "load_cad import_cad load_urdf from_urdf URDF from_adams load_mesh",
        "Build the mechanism from its dimensions, which are the inputs of the study.",
    ),
    Absent(
        "frequency response",
        "FrequencyResponse HarmonicResponse FRF Bode TransferFunction Sweep",
        "Simulate with a harmonic load and start='periodic', one run per frequency; of small "
        "motions, `modes` gives eigenvalues and shapes, whose sum is the response.",
    ),
    Absent(
        "rolling resistance",
        "RollingResistance RollingFriction",
        "A contact.Brake between the wheel and the body that it rolls on, whose radius times µ is "
        "the arm of the resistance and whose force is the load of the wheel.",
    ),
    Absent(
        "friction with a normal force across the plane",
        "TableFriction PlanarFriction SurfaceFriction",
        "A contact.Brake against rotations and a contact.LuGre along lines take a given normal "
        "force, such as the weight of what lies on the plane; a ForceLaw any other.",
    ),
    Absent(
        "servo constraints",
        "ServoConstraint InverseDynamics ComputedTorque",
        "Prescribe the path of the point by PrescribedPath, simulate, and give the angles of the "
        "motors to PrescribedRotation drives, whose ReactionMoment are the moments.",
    ),
    Absent(
        "gears with one efficiency in each direction",
        "WormGear SelfLockingGear BackDrive",
        "Gear has the same efficiency whichever gear drives; a second study with the other one "
        "shows what changes. A contact.OneWayClutch holds what locks itself.",
    ),
    Absent(
        "contact of teeth",
        "ToothContact GearMesh MeshStiffness Backlash",
        "A Gear is rigid. Put a shaft between it and its body, a TorsionSpring with the stiffness "
        "of the mesh, and a contact.AngularStop for backlash.",
    ),
    Absent(
        "calibration",
        "calibrate Calibration BayesianCalibration BayesianInference MCMC fit_parameters",
        "The surrogate of a study is a fast function of its inputs: give it to a least-squares "
        "solver such as scipy.optimize.least_squares, or to a sampler.",
    ),
)


def absent(name: str) -> Absent | None:
    """Return the feature that is looked for under a name, or None if there is none.

    Neither case nor underscores matter.
    """
    plain = name.casefold().replace("_", "")
    for row in ABSENT:
        if plain in row.names.casefold().replace("_", "").split():
            return row
    return None
