"""Hypothesis profiles and a marker for all tests.

Test modules import tests/reference as `reference`.
"""

import pytest
from hypothesis import settings

import madelung.commands  # noqa: F401  one BLAS thread, as for users; before numpy is loaded

# "ci": the same examples in every run. For a search: pytest --hypothesis-profile=explore
settings.register_profile(
    "ci", derandomize=True, print_blob=True, deadline=None, database=None, max_examples=100
)
settings.register_profile("explore", print_blob=True, deadline=None, max_examples=5000)
settings.load_profile("ci")


def pytest_configure(config: pytest.Config) -> None:
    """Leave out the slow tests, unless a marker is asked for: pytest -m slow."""
    config.addinivalue_line("markers", "slow: minutes; `make test-all` runs them")
    config.option.markexpr = config.option.markexpr or "not slow"
