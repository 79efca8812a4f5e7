"""A straight rod with a heavy end, let go under a load, by PyElastica; the rod and its steps are those of ../compare_pyelastica.py.

Called by `cargo bench --bench work_precision` with the place of the end to compare with, `let-go=x,y,0`; prints lines KEY method elements error right-hand-sides milliseconds.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from compare_pyelastica import pyelastica  # noqa: E402

exact = np.array(sys.argv[1].split("=")[1].split(",")[:2], dtype=float)
pyelastica(10, 1e-3)  # compiles
for elements in (10, 20, 40, 80):
    place, seconds, steps = pyelastica(elements)
    # One evaluation of the forces a step.
    print(f"let-go PyElastica {elements} {np.linalg.norm(place - exact):.3e} {steps} {1e3 * seconds:.1f}", flush=True)
