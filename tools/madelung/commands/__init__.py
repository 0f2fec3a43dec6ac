"""The commands of ``madelung``, one module each: they parse, call the library, print."""

import os

# Before the first of them imports numpy: sums of one thread are the same bytes on every machine,
# and hypotheses are fitted side by side by threads of their own.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
