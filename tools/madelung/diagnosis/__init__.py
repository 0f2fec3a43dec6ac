"""The diagnosis of a sim-to-real gap: case -> gap -> where / which / how far -> report."""
