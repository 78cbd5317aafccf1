"""The slider–crank of the paper with a soft link, and the motion of the middle of the link.

Young's modulus is a tenth of that of aluminium, 6.9 GPa, so the link has five elements. Its middle
hardly depends on the random material, but on the length of the crank.
"""

import runpy
from dataclasses import replace
from pathlib import Path

import flexband as fb

STIFF = runpy.run_path(str(Path(__file__).parent / "slider_crank.py"))


def soft_link(crank_length, spring_stiffness, youngs_modulus, poissons_ratio):
    model = STIFF["slider_crank"](crank_length, spring_stiffness, youngs_modulus, poissons_ratio)
    link = replace(model.bodies["link"], elements=5)
    sensors = {"middle": fb.Position("link.middle")}
    return replace(model, bodies={**model.bodies, "link": link}, sensors=sensors)


modulus = replace(STIFF["inputs"]["youngs_modulus"], mean=6.9e9, std=0.069e9)
inputs = STIFF["inputs"] | {"youngs_modulus": modulus}
response = fb.dynamic_response(
    soft_link, duration=0.6, step=1e-3, integrator=fb.GeneralizedAlpha(spectral_radius=0.7)
)
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.01))
