"""Equilibria of the planar elastica as strain fields (theory: sin(psi/2) = kap cd(lam (1 - s)), theta' = 2 lam kap kap' sd(lam (1 - s)))."""
import mpmath as mp
from ref_viscous_core import LD, ld, np


def strain(lam, kap):
    """theta'(s) for the equilibrium (lam, kap), given as decimal strings; 30 digits inside."""
    def f(s):
        with mp.workdps(30):
            l, k = mp.mpf(lam), mp.mpf(kap)
            m, kp = k * k, mp.sqrt(1 - k * k)
            tab = lambda x: mp.ellipfun('sn', x, m=m) / mp.ellipfun('dn', x, m=m)
            return ld([LD(mp.nstr(2 * l * k * kp * tab(l * (1 - mp.mpf(np.format_float_positional(x, unique=True)))), 25)) for x in s])
    return f
