"""Hypothesis profiles for all tests. Test modules import tests/reference as `reference`."""

from hypothesis import settings

# "ci": the same examples in every run. For a search: pytest --hypothesis-profile=explore
settings.register_profile(
    "ci", derandomize=True, print_blob=True, deadline=None, database=None, max_examples=100
)
settings.register_profile("explore", print_blob=True, deadline=None, max_examples=5000)
settings.load_profile("ci")
