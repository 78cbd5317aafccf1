"""Exudyn's planar scripts: which of them flexband rebuilds, and why not the others.

The 96 scripts in the folders Examples and TestModels of Exudyn 1.11.0 that use items of the plane,
such as `NodeRigidBody2D` or `ObjectANCFCable2D`.
"""

from __future__ import annotations

DOCUMENTED = {
    "a body, a chain or a linkage": """
        Examples/SliderCrank Examples/doublePendulum2D Examples/myFirstExample
        Examples/pendulum2Dconstraint Examples/pendulumIftommBenchmark Examples/rigidPendulum
        Examples/simple4linkPendulumBing Examples/slidercrankWithMassSpring
        Examples/xExudynConfigSpecial TestModels/MiniExamples/ObjectConnectorDistance
        TestModels/MiniExamples/ObjectMassPoint2D TestModels/MiniExamples/ObjectRigidBody2D
        TestModels/compareFullModifiedNewton TestModels/fourBarMechanismIftomm
        TestModels/perfRigidPendulum
    """,
    "`Spring`, `TorsionSpring` and `Bushing`": """
        Examples/SpringDamperMassUserFunction Examples/finiteSegmentMethod
        Examples/lavalRotor2Dtest TestModels/PARTS_ATEs_moving TestModels/rigidBody2Dtest
        TestModels/scissorPrismaticRevolute2D TestModels/sliderCrankFloatingTest
        TestModels/sparseMatrixSpringDamperTest
    """,
    "`ForceLaw` with `states`": """
        Examples/HydraulicActuator2Arms Examples/HydraulicActuatorStaticInitialization
        Examples/HydraulicsUserFunction TestModels/hydraulicActuatorSimpleTest
    """,
    "control by `TorsionSpring`": "TestModels/doublePendulum2DControl",
    "friction by `contact.Brake`": "TestModels/pendulumFriction",
    "`contact.Switched`": "Examples/switchingConstraintsPendulum",
    "a start from `equilibrium`, with velocities": "Examples/bungeeJump",
    "`Cable` or `Beam`": """
        Examples/ANCFcantileverTest Examples/ANCFrotatingCable2D Examples/ANCFtestHalfcircle
        Examples/ANCFtests2 Examples/beamTutorial Examples/flexiblePendulumANCF
        Examples/pendulumGeomExactBeam2D Examples/pendulumGeomExactBeam2Dsimple
        Examples/solutionViewerMultipleSimulations TestModels/ANCFCableBeamDampingTest
        TestModels/LShapeGeomExactBeam2D TestModels/MiniExamples/ObjectANCFCable2D
        TestModels/geometricallyExactBeam2Dtest TestModels/gridGeomExactBeam2D
    """,
    "`modes`": "Examples/solverFunctionsTestEigenvalues TestModels/computeODE2EigenvaluesTest",
}
WORKAROUND = {
    "one simulation per decision of the controller, each from the state of the one before": """
        Examples/TCPIPexudynMatlab Examples/openAIgymInterfaceTest
        Examples/openAIgymTriplePendulum Examples/testGymCartpoleEnv
        Examples/testGymCartpoleEnvSlow Examples/testGymDoublePendulumEnv
    """,
    "nodes of the cable meet the rolls, with a fine mesh there": """
        Examples/ANCFcontactCircle Examples/ANCFcontactCircle2 TestModels/ANCFcontactCircleTest
        TestModels/ANCFcontactFrictionTest
    """,
    "a second simulation, in which the clamp begins to move": "Examples/ANCFcantileverTestDyn",
    "a pin beside the axis, on a massless body": "TestModels/ANCFoutputTest",
    "its equations are those of a `Distance`": "TestModels/coordinateVectorConstraint",
    "the model only; flexband's own integrator": "TestModels/manualExplicitIntegrator",
    "SciPy calls `simulate` with a population": "Examples/geneticOptimizationSliderCrank",
}
NOT = {
    "a joint slides along a member": """
        Examples/ANCFmovingRigidbody Examples/ANCFslidingJoint2D
        Examples/ANCFslidingJoint2Drigid Examples/ANCFswitchingSlidingJoint2D
        TestModels/ACNFslidingAndALEjointTest TestModels/ANCFmovingRigidBodyTest
        TestModels/ANCFslidingAndALEjointTest
    """,
    "one of its nine models slides along a member": "TestModels/modelUnitTests",
    "a member that moves along its axis (ALE)": """
        Examples/ALEANCFpipe Examples/ANCFALEtest
        Examples/publications/CND2022PieberNtarladimaGerstmayr/allTestsConvergenceParameterVariation
        Examples/publications/CND2022PieberNtarladimaGerstmayr/allTestsMovingMassFactor
        Examples/publications/CND2022PieberNtarladimaGerstmayr/fixedFixedANCFALEdiscreteMasses
    """,
    "a belt, rope or chain": """
        Examples/ANCFbeltDrive Examples/beltDriveALE Examples/beltDriveReevingSystem
        Examples/beltDrivesComparison Examples/chainDriveExample Examples/reevingSystem
        Examples/reevingSystemOpen Examples/sliderCrank3DwithANCFbeltDrive
        Examples/sliderCrank3DwithANCFbeltDrive2 TestModels/ANCFbeltDrive
        TestModels/ANCFgeneralContactCircle
    """,
    "a motion in space": """
        Examples/flexibleRotor3Dtest Examples/rigidRotor3DFWBW
        Examples/rigidRotor3DbasicBehaviour Examples/rigidRotor3Dnutation
        Examples/rigidRotor3Drunup TestModels/ANCFBeam3DeigTest TestModels/ANCFBeamEigTest
        TestModels/distanceSensor TestModels/geometricallyExactBeam3Dtest
    """,
    "a nonlinear law of the section": "TestModels/ANCFcable2DuserFunction",
}


def all_scripts() -> dict[str, tuple[str, str]]:
    """Return whether a script is rebuilt, and how or why not, by its path."""
    groups = {"as documented": DOCUMENTED, "by a workaround": WORKAROUND, "no": NOT}
    return {
        f"{path}.py": (answer, remark)
        for answer, group in groups.items()
        for remark, paths in group.items()
        for path in paths.split()
    }
