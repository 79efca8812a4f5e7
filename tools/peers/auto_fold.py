"""The branch of a planar rod through a fold, by AUTO-07p; the equations are in auto_fold.f90. Needs gfortran, and in AUTO_DIR a built AUTO-07p.

Called by `cargo bench --bench work_precision` with the place of the fold to compare with, `fold=y,0,0`; prints lines KEY method intervals error right-hand-sides milliseconds.
The branch goes from the end at Y = 0.3 to the fold and back to 0.3, by steps that are bounded so that there are as many points as by snaprod
(123 and 124).
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CONSTANTS = """ICP = [1, 2, 3]
NDIM = 4, IPS = 4, IRS = 0, ILP = 1
NTST = {intervals}, NCOL = 4, IAD = 3, ISP = 0, ISW = 1, IPLT = 0, NBC = 6, NINT = 0
NMX = 400, NPR = 400, MXBF = 0, IID = 0, ITMX = 9, ITNW = 7, NWTN = 3, JAC = 1
EPSL = 1e-11, EPSU = 1e-11, EPSS = 1e-09
DS = -0.1, DSMIN = 1e-4, DSMAX = 1.5, IADS = 1
NPAR = 4, RL0 = -0.8, RL1 = 0.3001
"""

home = os.environ.get("AUTO_DIR")
if not home:
    sys.exit("AUTO_DIR is not set: there is no AUTO-07p")
exact = float(sys.argv[1].split("=")[1].split(",")[0])
source = Path(__file__).with_name("auto_fold.f90")
with tempfile.TemporaryDirectory() as place:
    libraries = sorted(Path(home, "lib").glob("*.o"))
    subprocess.run(["gfortran", "-O3", "-fopenmp", source, *libraries, "-o", "rod"], cwd=place, check=True)
    for intervals in (5, 10, 20, 40, 80):
        best = float("inf")
        for _ in range(5):
            Path(place, "fort.2").write_text(CONSTANTS.format(intervals=intervals))
            clock = time.perf_counter()
            subprocess.run(["./rod"], cwd=place, check=True, stdout=subprocess.DEVNULL, env=os.environ | {"OMP_NUM_THREADS": "1"})
            best = min(best, 1e3 * (time.perf_counter() - clock))
        # Branch, point, type (5: a fold), label, parameter, ...
        rows = [line.split() for line in Path(place, "fort.7").read_text().splitlines()]
        folds = [float(row[4]) for row in rows if row[0] != "0" and row[2] in ("5", "-5")]
        error = min(abs(fold - exact) for fold in folds)
        print(f"fold AUTO-07p {intervals} {error:.3e} 0 {best:.3f}", flush=True)
