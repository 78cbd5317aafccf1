"""What is required of outputs: bounds, criteria, units, and how tolerances scatter.

It may import the inputs of `uncertainty`, and nothing of `analysis`, which judges requirements.
"""
