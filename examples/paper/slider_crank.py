"""The slider–crank of the example above with the numerics of the paper's comparison.

Three continuum elements and a step of 1 ms, five steps per period of its vibration, 184 Hz: errors
of methods are compared on these, as in the paper, but the bands themselves are not converged, and
the error of the step is not corrected.
"""

import runpy
from pathlib import Path

import flexband as fb

CONVERGED = runpy.run_path(str(Path(__file__).parents[1] / "slider_crank.py"))


def slider_crank(crank_length, spring_stiffness, youngs_modulus, poissons_ratio):
    return CONVERGED["slider_crank"](
        crank_length, spring_stiffness, youngs_modulus, poissons_ratio,
        elements=3, integration=fb.sections.FullIntegration(),
    )  # fmt: skip


inputs = CONVERGED["inputs"]
response = fb.dynamic_response(
    slider_crank, duration=0.6, step=1e-3, integrator=fb.GeneralizedAlpha(spectral_radius=0.7)
)
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.01, correct=False))
