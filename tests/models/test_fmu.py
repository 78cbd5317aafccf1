"""FMUs for co-simulation, compiled here, against the closed form of the damped oscillator."""

import pickle
import shutil
import subprocess
import zipfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import flexband as fb

SOURCE = Path(__file__).with_name("oscillator.c")
fmpy = pytest.importorskip("fmpy")
compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
pytestmark = pytest.mark.skipif(compiler is None, reason="needs a compiler of C")

REAL = [
    ("mass", "parameter", "fixed", "start='1' min='0.001' unit='kg'"),
    ("spring.k", "parameter", "tunable", "start='100' unit='N/m'"),
    ("damping", "parameter", "fixed", "start='2'"),
    ("x0", "parameter", "fixed", "start='1' unit='m'"),
    ("force", "input", "continuous", "start='0'"),
    ("x", "output", "continuous", "unit='m'"),
    ("v", "output", "continuous", "unit='m/s'"),
    ("k_over_m", "calculatedParameter", "fixed", ""),
    ("guess", "local", "continuous", "start='1'"),
    ("mass_again", "parameter", "fixed", "start='1'"),
    ("gravity", "local", "constant", "start='9.81'"),
    ("time", "independent", "continuous", ""),
]


def description(version, variable_steps=True):
    units = "".join(f"<Unit name='{u}'/>" for u in ("kg", "N/m", "m", "m/s"))
    variables = []
    for k, (name, causality, variability, rest) in enumerate(REAL):
        reference = 0 if name == "mass_again" and version == 2 else k
        attributes = f"name='{name}' valueReference='{reference}' causality='{causality}' "
        attributes += f"variability='{variability}'" + (
            " initial='approx'" if name == "guess" else ""
        )
        variables.append(
            f"<ScalarVariable {attributes}><Real {rest}/></ScalarVariable>"
            if version == 2
            else f"<Float64 {attributes} {rest}/>"
        )
    fixed = "causality='parameter' variability='fixed'"
    for name, kind, start in (("springs", "Integer", "1"), ("locked", "Boolean", "false")):
        attributes = f"name='{name}' valueReference='{100 + (kind == 'Boolean')}' {fixed}"
        variables.append(
            f"<ScalarVariable {attributes}><{kind} start='{start}'/></ScalarVariable>"
            if version == 2
            else f"<{kind.replace('eger', '32')} {attributes} start='{start}'/>"
        )
    steps = f"canHandleVariableCommunicationStepSize='{str(variable_steps).lower()}'"
    if version == 2:
        head = "fmiVersion='2.0' modelName='oscillator' guid='{1}'"
        structure = "<Outputs><Unknown index='6'/><Unknown index='7'/></Outputs>"
        structure += "<InitialUnknowns><Unknown index='6'/><Unknown index='7'/></InitialUnknowns>"
    else:
        head = "fmiVersion='3.0' modelName='oscillator' instantiationToken='{1}'"
        structure = "<Output valueReference='5'/><Output valueReference='6'/>"
    return (
        f"<?xml version='1.0' encoding='UTF-8'?><fmiModelDescription {head}>"
        f"<CoSimulation modelIdentifier='oscillator' {steps}/>"
        f"<UnitDefinitions>{units}</UnitDefinitions>"
        f"<ModelVariables>{''.join(variables)}</ModelVariables>"
        f"<ModelStructure>{structure}</ModelStructure></fmiModelDescription>"
    )


def build(folder, version, **options):
    """Compile the oscillator, with functions that fail for all that it does not have."""
    from fmpy import fmi2, fmi3  # noqa: PLC0415

    kind = fmi2.FMU2Slave if version == 2 else fmi3.FMU3Slave
    source = SOURCE.read_text()
    names = [n for n in dir(kind) if n.startswith(f"fmi{version}") and f" {n}(" not in source]
    names = [n for n in names if f"*{n}(" not in source]
    stubs = "".join(f"int {n}() {{ return {0 if 'Terminate' in n else 3}; }}\n" for n in names)
    (folder / "stubs.c").write_text(stubs)
    library = folder / "oscillator.so"
    command = [compiler, "-shared", "-fPIC", "-O1", "-w", f"-DFMI{version}", "-o", library]
    subprocess.run([*command, SOURCE, folder / "stubs.c", "-lm"], check=True)
    platform = fmpy.platform if version == 2 else fmpy.platform_tuple
    file = folder / f"oscillator{version}.fmu"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("modelDescription.xml", description(version, **options))
        archive.write(library, f"binaries/{platform}/oscillator{fmpy.sharedLibraryExtension}")
    return file


@pytest.fixture(scope="module", params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def fmu(request, tmp_path_factory):
    return build(tmp_path_factory.mktemp("fmu"), request.param)


TIMES = np.array([0.0, 0.1, 0.15, 0.4, 1.0])


def closed_form(mass, stiffness, damping=2.0):
    mass, stiffness = (np.atleast_1d(a)[:, None] for a in (mass, stiffness))
    decay = damping / (2 * mass)
    omega = np.sqrt(stiffness / mass - decay**2)
    swing = np.cos(omega * TIMES) + decay / omega * np.sin(omega * TIMES)
    speed = -(omega**2 + decay**2) / omega * np.sin(omega * TIMES)
    return np.stack([np.exp(-decay * TIMES) * wave for wave in (swing, speed)], axis=1)


def test_an_fmu_equals_its_closed_form(fmu):
    response = fb.models.FMU(fmu, TIMES)
    values = {"mass": np.array([1.0, 1.3]), "spring.k": np.array([80.0, 120.0])}
    result = response(**values)
    exact = closed_form(*values.values())
    np.testing.assert_allclose(result, exact, rtol=1e-10, atol=1e-12)
    assert result.dims == ("sample", "output", "time")
    assert list(result["output"].values) == ["x", "v"]
    assert list(result["unit"].values) == ["m", "m/s"]
    with ProcessPoolExecutor(1) as pool:
        np.testing.assert_array_equal(pool.submit(response, **values).result(), result)
    for step in (0.05, 0.007):
        velocities = fb.models.FMU(fmu, TIMES, ["v"], step=step)(**values)
        np.testing.assert_allclose(velocities[:, 0], exact[:, 1], rtol=1e-9, atol=1e-10)


def test_a_study(fmu):
    inputs = {"mass": fb.Normal(1.0, 0.02), "spring.k": fb.Interval(90.0, 110.0)}
    bands = fb.propagate(fb.models.FMU(fmu, TIMES), inputs, fb.PCCI(3, 3))
    expected = fb.propagate(
        closed_form, {"mass": inputs["mass"], "stiffness": inputs["spring.k"]}, fb.PCCI(3, 3)
    )
    np.testing.assert_allclose(bands["error_bar"], expected["error_bar"].values, atol=1e-8)


def test_inputs_integers_and_booleans(fmu):
    response = fb.models.FMU(fmu, [2.0, 4.0], ["x", "springs", "locked"])
    result = response(force=[50.0, 50.0, 0.0], springs=[1, 2, 1], locked=[0, 0, 1], damping=8.0)
    np.testing.assert_allclose(result[:, 0, 1], [0.5, 0.25, 1.0], atol=1e-5)
    np.testing.assert_array_equal(result[:, 1, 0], [1, 2, 1])
    np.testing.assert_array_equal(result[:, 2, 0], [0, 0, 1])


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"masss": 1.0}, "variables of the FMU that can be set: mass, .*spring.k.*; got 'masss'"),
        ({"k_over_m": 1.0}, "k_over_m cannot be set in this FMU: it is of causality calculatedP"),
        ({"x": 1.0}, "x cannot be set in this FMU: it is a variable of causality output whose st"),
        ({"gravity": 1.0}, "gravity cannot be set in this FMU: it is a constant"),
        ({"guess": 2.0}, "guess cannot be set in this FMU: it was set to 2.0 and is 1.0 after"),
        ({"mass": 1.0, "mass_again": 2.0}, "mass and mass_again are the same variable"),
        ({"mass": -1.0}, "mass has the min 0.001 in this FMU; got -1.0"),
        ({"springs": 1.5}, "springs must be a whole number for this FMU; got 1.5"),
        ({"locked": 2.0}, "locked must be 0 or 1 for this FMU; got 2.0"),
        ({"mass": "heavy"}, "mass must be a finite number for this FMU; got 'heavy'"),
        ({"mass": np.nan}, "mass must be a finite number for this FMU; got nan"),
        ({"mass": lambda x: x}, "mass must be a number for an FMU; got a function of position"),
    ],
)
def test_values_that_an_fmu_cannot_have(fmu, values, text):
    if "mass_again" in values and "3" in fmu.name:
        pytest.skip("variables of FMI 3.0 have references of their own")
    with pytest.raises(fb.errors.InputError, match=text):
        fb.models.FMU(fmu, TIMES)(**values)


def test_failures_tell_what_the_fmu_has_logged(fmu, capfd):
    with pytest.raises(
        fb.errors.ModelError, match=r"DoStep failed with status 3.*\n +stiffness is neg"
    ):
        fb.models.FMU(fmu, TIMES)(**{"spring.k": -1.0})
    assert capfd.readouterr().out == ""


def test_an_fmu_that_ends_early(tmp_path):
    with pytest.raises(fb.errors.ModelError, match="the FMU ends at 4 s"):
        fb.models.FMU(build(tmp_path, 3), [4.0, 5.0])(mass=1.0)


def test_a_changed_file_is_refused(tmp_path):
    file = build(tmp_path, 2)
    response = fb.models.FMU(file, TIMES)
    assert pickle.loads(pickle.dumps(response)) == response
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr("resources/more.txt", "changed")
    with pytest.raises(fb.errors.ModelError, match="has changed since the response was made"):
        response(mass=1.0)


def test_equal_steps_only(tmp_path):
    file = build(tmp_path, 2, variable_steps=False)
    with pytest.raises(
        fb.errors.InputError, match=r"equal communication steps only.*from 0.05 to 0.6 s"
    ):
        fb.models.FMU(file, TIMES)
    result = fb.models.FMU(file, TIMES, step=0.05)(mass=1.0)
    np.testing.assert_allclose(result, closed_form(1.0, 100.0), atol=1e-10)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("nowhere.fmu", TIMES), "FMU path must be a file that exists; got 'nowhere.fmu'"),
        ((__file__, TIMES), "FMU path must be an FMU; .* cannot be read"),
        ((None, [0.0, 0.0]), r"FMU times \[s\] must increase"),
        ((None, [-1.0, 0.0]), r"FMU times \[s\] must not be before its start 0; got -1"),
        ((None, TIMES, ["y"]), "outputs must be numbers of the FMU: .*x, v.*; got 'y'"),
        ((None, TIMES, "x"), "FMU outputs must be a list of names; got 'x'"),
        ((None, TIMES, []), "FMU outputs must be one or more different variables"),
        ((None, TIMES, ["x"], 0.0), r"FMU step \[s\] must be positive"),
    ],
)
def test_bad_descriptions_are_refused(fmu, arguments, text):
    path, *others = arguments
    with pytest.raises(fb.errors.InputError, match=text):
        fb.models.FMU(path or fmu, *others)


def test_an_fmu_for_another_computer(fmu, tmp_path):
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(tmp_path / "o.fmu", "w") as target:
        target.writestr("modelDescription.xml", source.read("modelDescription.xml"))
    with pytest.raises(fb.errors.InputError, match=r"must be an FMU for .*; .* is for nothing"):
        fb.models.FMU(tmp_path / "o.fmu", TIMES)
