"""Responses of a builder: its result is checked, and failures give its inputs."""

import numpy as np
import pytest

import flexband as fb
from flexband.mechanics.simulate import TimeGrid
from tests.mechanics.models import hardening_spring, rigid_slider_crank


def test_a_builder_must_return_a_mechanism():
    response = fb.dynamic_response(lambda length: None, duration=0.1, step=0.01)
    with pytest.raises(fb.errors.InputError, match="must return a Mechanism; got None"):
        response(length=np.ones(2))


def test_assembly_errors_give_the_inputs():
    def short_link(link_length):
        crank = fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=1.0)
        link = fb.RigidBody.bar(
            length=link_length, height=0.01, width=0.01, density=1.0, start=(0.2, 0), angle=1.0
        )
        joints = {
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("crank.end", "link.start"),
            "C": fb.Revolute("link.end", (0.3, 0.3)),
        }
        sensors = {"angle": fb.Angle("link")}
        return fb.Mechanism(bodies={"crank": crank, "link": link}, joints=joints, sensors=sensors)

    response = fb.dynamic_response(short_link, duration=0.01, step=1e-3)
    with pytest.raises(fb.errors.AssemblyError, match=r"sample 1: link_length = 0.1") as error:
        response(link_length=np.array([0.3, 0.1]))
    assert list(error.value.failures) == [1]


def test_a_diverging_run_is_reported_with_inputs_and_time():
    def locking(crank_length, link_length):
        return rigid_slider_crank(crank_length, link_length)

    response = fb.dynamic_response(locking, duration=0.3, step=1e-3)
    lengths = np.array([0.2, 0.2, 0.2])
    with pytest.raises(fb.errors.SimulationError) as error:
        response(crank_length=lengths, link_length=np.array([0.45, 0.15, 0.45]))
    assert list(error.value.failures) == [1]
    time = error.value.failures[1][0]
    assert time == pytest.approx(np.arcsin(0.75) / (4 * np.pi), abs=2e-3)  # where it locks
    assert "1 of 3 runs failed" in str(error.value)
    assert "link_length = 0.15" in str(error.value)


SPRING_STEEL = {"height": 2e-3, "width": 0.02, "density": 7800.0, "poissons_ratio": 0.3}
QUICK = {"duration": 4e-3, "step": 2e-4}


def leaf(elements, modulus):
    """A curved leaf of varying stiffness with sensors of all kinds along it."""

    def path(u):
        return np.stack([0.3 * u, 0.1 * u**2 * (1 - u / 2)], axis=1)

    at = {f"{k}": f"leaf.node {k}" for k in range(4)} | {"part": "leaf.0.4", "middle": "leaf"}
    return fb.Mechanism(
        bodies={
            "leaf": fb.Beam.along(path, youngs_modulus=modulus, elements=elements, **SPRING_STEEL)
        },
        joints={"clamp": fb.Weld("leaf.start", (0.0, 0.0))},
        loads={
            "P": fb.Force("leaf.node 2", y=-5.0), "w": fb.DistributedLoad("leaf", y=lambda x: -x),
            "k": fb.Spring("leaf.0.5", (0.2, 1.0), 300.0),
        },
        sensors={name: fb.Position(point) for name, point in at.items()}
        | {"N": fb.SectionForces("leaf", "node 1"), "d": fb.Deflection("leaf", "node 2")},
    )  # fmt: skip


def test_a_refined_response_has_half_the_step_and_twice_the_elements():
    """Bit for bit the motion of a mesh and a step that are given so, with nodes named as before."""

    def fine(modulus):
        model = leaf(24, modulus)
        loads = {"w": model.loads["w"], "k": model.loads["k"], "P": fb.Force("leaf.node 8", y=-5.0)}
        sensors = {f"{k}": fb.Position(f"leaf.node {4 * k}") for k in range(4)}
        section_sensors = {
            "N": fb.SectionForces("leaf", "node 4"),
            "d": fb.Deflection("leaf", "node 8"),
        }
        return fb.Mechanism(
            bodies=model.bodies, joints=model.joints, loads={**model.loads, **loads},
            sensors={**model.sensors, **sensors, **section_sensors},
        )  # fmt: skip

    def modulus(x):
        return np.array([[2.1e11], [1.9e11]]) * (1.0 - x)

    coarse = fb.dynamic_response(lambda modulus: leaf(6, modulus), **QUICK)
    refined_response = coarse.refined().refined()
    motion = refined_response(modulus=modulus)
    reference = fb.dynamic_response(fine, duration=4e-3, step=5e-5)(modulus=modulus)[..., ::4]
    np.testing.assert_array_equal(motion, reference)
    assert motion.coords.equals(coarse(modulus=modulus).coords)
    assert list(refined_response.__signature__.parameters) == ["modulus"]


def test_outputs_may_be_farther_apart_than_steps():
    modulus = np.array([2.1e11, 1.9e11])
    all_outputs = fb.dynamic_response(lambda modulus: leaf(6, modulus), duration=4e-3, step=5e-5)
    sparse_outputs = fb.dynamic_response(
        lambda modulus: leaf(6, modulus), duration=4e-3, step=5e-5, output_step=2e-4
    )
    np.testing.assert_array_equal(
        sparse_outputs(modulus=modulus), all_outputs(modulus=modulus)[..., ::4]
    )
    with pytest.raises(
        fb.errors.InputError, match=r"output_step .s. must be a whole multiple of step; got 0\.0001"
    ):
        fb.dynamic_response(leaf, duration=4e-3, step=3e-5, output_step=1e-4)
    with pytest.raises(
        fb.errors.InputError, match=r"whole multiple of output_step; got 0\.004 with out"
    ):
        fb.dynamic_response(leaf, duration=4e-3, output_step=3e-4)
    with pytest.raises(
        fb.errors.InputError, match=r"whole multiple of step; got 0\.004 with step 0\.0003"
    ):
        fb.dynamic_response(leaf, duration=4e-3, step=3e-4)
    with pytest.raises(fb.errors.InputError, match=r"output_step .s. must be positive; got 0"):
        fb.dynamic_response(leaf, duration=4e-3, output_step=0.0)


def test_what_is_left_out_of_the_discretization_is_told():
    open_ = fb.dynamic_response(lambda modulus: leaf(None, modulus), duration=5e-3)
    values = {"modulus": np.array([2e11])}
    assert open_.description(**values).left_out == ["step", "elements"]
    refined_response = open_.refinements(**values)["elements"].refinements(**values)["step"]
    assert refined_response.description(**values).discretization == {
        "step": 5e-6,
        "elements of leaf": 8,
    }
    with (
        pytest.warns(fb.errors.ResolutionWarning, match="step is left out: 1e-05 s is used"),
        pytest.warns(
            fb.errors.ResolutionWarning, match="elements of 'leaf' is left out: 4 are used"
        ),
    ):
        coarse = open_(**values)
    complete = fb.dynamic_response(lambda modulus: leaf(4, modulus), duration=5e-3, step=1e-5)
    assert complete.description(**values).left_out == []
    np.testing.assert_array_equal(coarse, complete(**values))
    rigid = fb.dynamic_response(rigid_slider_crank, duration=0.3, step=1e-3)
    assert list(rigid.refinements(crank_length=0.1, link_length=0.3)) == ["step"]


def test_runs_that_diverge_are_not_completed_where_the_step_is_left_out():
    """Else a repetition with half the step, which is the same, would tell that nothing changes."""
    speeds = {"speed": np.array([0.1, 7.5])}
    open_ = fb.dynamic_response(hardening_spring, duration=0.2, output_step=0.02)
    with (
        pytest.warns(fb.errors.ResolutionWarning, match="step is left out"),
        pytest.raises(fb.errors.SimulationError, match=r"speed = 7\.5") as error,
    ):
        open_(**speeds)
    assert "diverged with steps of 0.02 s\nTake shorter steps" in str(error.value)
    half = open_.refinements(**speeds)["step"]
    assert half(**speeds).shape == (2, 2, 11)


def test_points_of_a_refined_mechanism_stay_where_they_are():
    model = leaf(6, 2e11)
    refined_model = model.refined(3)
    assert refined_model.bodies["leaf"].elements == 18
    coarse, fine = (
        fb.simulate(m, duration=1e-9, step=1e-9)[:12, 0] for m in (model, refined_model)
    )
    np.testing.assert_allclose(fine, coarse, atol=2e-6)  # of Hermite cubics that follow a curve
    np.testing.assert_allclose(fine[:8], coarse[:8], atol=1e-12)  # nodes
    with pytest.raises(fb.errors.InputError, match="'node 0' to 'node 6'"):
        refined_model.model.frame("leaf.node 7")
    with pytest.raises(
        fb.errors.InputError, match="body 'leaf': Beam elements must be 100000 or less"
    ):
        model.refined(20_000)
    with pytest.raises(fb.errors.InputError, match="parts must be 1 or more; got 0"):
        model.refined(0)
    rigid = rigid_slider_crank()
    assert rigid.refined() is rigid


def test_a_refined_response_warns_of_nothing_new_and_names_its_failures():
    def spinning_wheel(rate):
        wheel = fb.RigidBody(mass=1.0, inertia=0.5, rate=rate)
        return fb.Mechanism(
            bodies={"wheel": wheel},
            joints={"pin": fb.Revolute("wheel", (0.0, 0.0))},
            sensors={"angle": fb.Angle("wheel")},
        )

    response = fb.dynamic_response(spinning_wheel, duration=0.02, step=1e-3)
    with pytest.warns(fb.errors.FlexbandWarning, match="rad per step"):
        coarse = response(rate=np.array([900.0]))
    fine = response.refined()(rate=np.array([900.0]))
    exact = 900.0 * coarse.time
    assert abs(fine - exact).max() < 0.3 * abs(coarse - exact).max()

    locking = fb.dynamic_response(rigid_slider_crank, duration=0.3, step=1e-3)
    with pytest.raises(
        fb.errors.SimulationError,
        match="2 times finer steps and 2 times finer elements:\nsample 0: cr",
    ):
        locking.refined()(crank_length=np.array([0.2]), link_length=np.array([0.15]))


@pytest.mark.parametrize(
    ("duration", "step"),
    [(0.415, 1e-3), (0.7, 0.7 / 3), (1 / 3, 1e-3 / 3), (300000.26e-7, 1e-7), (1, 1)],
)
def test_substeps_have_the_times_of_whole_steps(duration, step):
    times = TimeGrid(duration, step, 1).times()
    np.testing.assert_array_equal(TimeGrid(duration, step, 2).times()[::2], times)


@pytest.mark.parametrize("substeps", [0, 2.0, True, 10**400])
def test_substeps_must_be_a_whole_number(substeps):
    with pytest.raises(fb.errors.InputError, match="substeps must be"):
        fb.simulate(rigid_slider_crank(), **QUICK, substeps=substeps)


def test_runs_that_needed_half_the_step_are_warned_of():
    def builder(speed):
        return fb.Mechanism(
            bodies={"m": fb.PointMass(mass=1.0, position=(1.0, 0.0), velocity=(speed, 0.0))},
            joints={"line": fb.Slot("m", (0.0, 0.0))},
            loads={"s": fb.Spring("m", (-1.0, 0.0), 10.0, 2.0, cubic=1e7)},
            sensors={"m": fb.Position("m")},
        )

    response = fb.dynamic_response(builder, duration=0.2, step=0.02)
    with pytest.warns(fb.errors.FlexbandWarning, match="1 of 3 runs diverged with steps of 0.02 s"):
        response(speed=np.array([0.1, 7.5, 0.2]))


def test_a_stress_that_is_zero_in_theory_does_not_drive_the_refinement():
    def cantilever(length, modulus):
        beam = fb.Beam(
            length=length, height=0.01, width=0.01, density=7800.0, youngs_modulus=modulus,
            poissons_ratio=0.3, retardation_time=1e-4,
        )  # fmt: skip
        return fb.Mechanism(
            bodies={"beam": beam},
            joints={"clamp": fb.Weld("beam.start", (0.0, 0.0))},
            loads={"gravity": fb.Gravity()},
            sensors={"s": fb.Stress("beam", "start", y=0.004), "f": fb.SectionForces("beam")},
        )

    response = fb.dynamic_response(cantilever, duration=0.1)
    values = {"length": np.array([0.5]), "modulus": np.array([2e11])}
    assert response.description(**values).quantities == ["s [Pa]"] * 3 + ["f [N]"] * 2 + ["f [N m]"]
    assert response.description(**values).tensors == ["s [Pa]"]
    inputs = {"length": fb.Interval(0.49, 0.51), "modulus": fb.Normal(2e11, 1e10)}
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(0.05))
    assert bands.attrs["expected_error"] < 0.05
    assert "s_yy" in bands.attrs["small_components"]
    assert bands.attrs["halved"].count("elements") <= 2
    width = (bands["error_bar"][1] - bands["error_bar"][0]).mean("time")
    assert float(width.sel(output="s_yy")) < 1e-6 * float(width.sel(output="s_xx"))


def test_sensors_over_windows_and_instants_are_finite_at_all_times():
    """A carriage meets its stop at 50 ms or not at all; its window begins at 40 ms."""
    law = fb.contact.KeepsRestitution(stiffness=1e8, restitution=0.5)

    def carriage(velocity):
        return fb.Mechanism(
            bodies={"m": fb.PointMass(mass=1.0, velocity=(velocity, 0.0 * velocity))},
            joints={"guide": fb.Slot("m", (0.0, 0.0))},
            loads={"stop": fb.contact.Stop("m", (0.0, 0.0), law, upper=0.1)},
            sensors={
                "far": fb.sensors.Largest(fb.Position("m"), window=(0.04, 0.1)),
                "stop": fb.contact.Contacts("stop", first=2),
            },
        )

    response = fb.dynamic_response(carriage, duration=0.1, step=0.01)
    motion = response(velocity=np.array([0.5, 2.0]))
    names = "far_X", "stop_t1", "stop_t2"
    largest, first, second = (motion.sel(output=name).values for name in names)
    assert largest[:, :5] == pytest.approx(np.outer([0.5, 2.0], np.full(5, 0.04)))
    assert largest[0, -1] == pytest.approx(0.05)
    assert first == pytest.approx(np.outer([0.1, 0.05], np.ones(11)), rel=1e-6)
    assert (second == 0.1).all()
    bands = fb.propagate(response, {"velocity": fb.Interval(1.5, 2.5)}, fb.PCCI(0, 8))
    instant = bands["mean"].sel(output="stop_t1").values[:, 0]
    assert instant == pytest.approx([0.04, 0.1 / 1.5], rel=1e-3)


def rubbing_block(mu):
    """A block on a spring that slides, and rubs more the slower it is."""
    law = fb.contact.Coulomb(kinetic=mu, static=2 * mu, stribeck_speed=0.3)
    return fb.Mechanism(
        bodies={"b": fb.PointMass(mass=1.0, velocity=(1.0, 0.0))},
        joints={"s": fb.Slot("b", (0.0, 0.0), friction=law)},
        loads={"g": fb.Gravity(), "k": fb.Spring("b", (-1.0, 0.0), 60.0, 1.0)},
        sensors={"x": fb.Position("b")},
    )


def test_a_refined_response_has_a_finer_tolerance_where_samples_choose_their_steps():
    """With it a study states the error of the steps: before, it was too small by 20 times."""

    def bands(tolerance, method):
        integrator = fb.GeneralizedAlpha(step_tolerance=tolerance)
        response = fb.dynamic_response(
            rubbing_block, duration=0.8, step=0.05, integrator=integrator
        )
        return fb.propagate(response, {"mu": fb.Interval(0.05, 0.07)}, method)

    exact = bands(1e-10, fb.PCCI(random_order=0, interval_order=8))["mean"].values
    width = np.abs(exact[1] - exact[0]).max()
    for tolerance in (1e-4, 1e-5, 1e-6):
        result = bands(tolerance, fb.AdaptivePCCI(0.01))
        error = np.abs(result["mean"].values - exact).max() / width
        assert result.attrs["expected_error"] > error / 5
        assert result.attrs["expected_error"] < 10 * max(error, 1e-3)
