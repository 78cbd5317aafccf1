"""The axis of a field's figure says what the field is a function of."""

from dataclasses import replace

import pytest
from matplotlib.figure import Figure

import flexband as fb
from flexband.report.page.given import field_axes
from flexband.report.plot.figures import fields_figure
from flexband.report.study_figures import write_comparison_report
from flexband.study.comparison import compare

FIELD = fb.RandomField(1e9, 1e7, correlation_length=0.5, domain=(0.0, 1.0), terms=2)
ANGLE = fb.RandomField(
    0.0, 0.1, correlation_length=0.5, domain=(0.0, 1.0), terms=2,
    correlation=fb.fields.squared_exponential,
)  # fmt: skip


def arm(modulus, turn, scale):
    return fb.Mechanism(
        bodies={"arm": fb.Beam(length=1.0, height=0.01, width=0.01, density=1e3,
                               youngs_modulus=modulus, poissons_ratio=0.3, elements=1)},
        joints={"A": fb.Revolute("arm.start", (0.0, 0.0)),
                "drive": fb.PrescribedRotation("arm.start", turn)},
        loads={"F": fb.Force("arm.end", lambda t: (scale(0.5 + 0 * t), 0.0))},
        sensors={"end": fb.Position("arm.end")},
    )  # fmt: skip


def test_a_property_varies_with_the_position_and_what_drives_with_the_time():
    inputs = {"modulus": FIELD, "turn": ANGLE, "scale": FIELD}
    response = fb.dynamic_response(arm, duration=1.0)
    along = field_axes(response, inputs)
    assert along == {"modulus": "position", "turn": "time"}
    axes = fields_figure(inputs, along).axes
    labels = ["position [m]", "time [s]", "position [m] or time [s]"]
    assert [panel.get_xlabel() for panel in axes] == labels
    assert axes[0].get_ylabel() == "modulus"
    assert field_axes(lambda modulus: modulus, {"modulus": FIELD}) == {}


@pytest.mark.filterwarnings("ignore:joint 'drive' is prescribed by", "ignore:assembly turned body")
def test_a_comparison_tells_what_fields_are_functions_of(tmp_path, monkeypatch):
    inputs = {"modulus": FIELD, "turn": ANGLE}

    def bare_arm(modulus, turn):
        return replace(arm(modulus, turn, None), loads={})

    response = fb.dynamic_response(bare_arm, duration=0.02, step=1e-3)
    study = fb.Study(response, inputs, fb.PCCI(1, 1))
    drawn = {}
    monkeypatch.setattr(
        "flexband.report.study_figures.write_figures",
        lambda file, title, about, table, figures, text: drawn.update(figures),
    )
    scan = fb.LHSScanning(4, 2)
    write_comparison_report(tmp_path, "arm", study, compare(study, scan, []), [])
    labels = [panel.get_xlabel() for panel in drawn["Realizations of the fields"]().axes]
    assert labels == ["position [m]", "time [s]"]


def test_a_field_is_along_nothing_else():
    with pytest.raises(
        fb.errors.InputError, match="along must be 'position', 'time' or ''; got 'x'"
    ):
        fb.plot.field(FIELD, "E", along="x", ax=Figure().add_subplot())
