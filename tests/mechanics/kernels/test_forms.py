"""The algebra of quadratic forms."""

import pytest

from flexband.mechanics.kernels.forms import Form, PlanarFrame, dot


def test_forms_are_an_algebra():
    x = Form.variable(1)
    y = Form.variable(2)
    product = (x + 2.0 * y) * (x - y)
    assert {k[:2]: float(v) for k, v in product.terms.items()} == {
        (1, 1): 1.0,
        (1, 2): 1.0,
        (2, 2): -2.0,
    }
    with pytest.raises(ValueError, match="at most two variables"):
        product * x
    frame = PlanarFrame.of_node(1)
    assert set(dot(frame.x, frame.y).terms) == {(3, 5, None), (4, 6, None)}
