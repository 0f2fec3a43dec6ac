"""Blind trials: cases whose labels are sealed, answered by the diagnosis, opened and scored."""
