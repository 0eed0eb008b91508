"""The rule that a tiny expected figure has an absolute tolerance of its own: ``conftest.tolerance_rules``."""

import pytest


def test_a_figure_that_the_usual_absolute_tolerance_would_swallow_is_refused():
    with pytest.raises(AssertionError, match="give abs"):
        pytest.approx(1e-13, rel=1e-3)
    assert pytest.approx(1e-13, rel=1e-3, abs=1e-20) != 2e-13
