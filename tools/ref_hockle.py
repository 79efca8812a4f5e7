#!/usr/bin/env python3
"""The first fold of a rod that a heavy, spinning body winds up: the constants of tests/suite/hockle.rs.

A body hangs on a taut rod that is slightly bent without load and turns on, until the rod forms a loop (hockles). With the base held at the
origin along the axes and the wrench (m, n) that the material beyond s exerts on that before it, the rod without mass is in equilibrium,

    n' = 0,   m' + r' x n = 0,   r' = R e3 (1 + n.R e3 / EA),   R' = R [u]x,   u = rest + K^-1 R^T m,

its end is the body's place and turn, and the body moves by

    mass v' = mass g e3 - n(1),   (R J R^T omega)' = -m(1).

Rod: the moment balance is integrated once, m = m(0) - r x n, so that the wrench of the base (six numbers) and the curves of place and
quaternion are the unknowns. They are taken in Chebyshev polynomials over the whole rod, the two rates being integrated exactly as such, and
solved for with the six conditions at the end by Newton's method at every instant. Body: DOP853 of scipy, with the momentum along the
directors.

At a fold the wrench goes like sqrt(t_f - t), and its rate without bound. The independent variable is therefore the arc length tau of
the curve (t, wrench) with dt/dtau = sigma = 1 / sqrt(1 + |wrench rate|^2): in it everything is smooth up to the fold and sigma goes to zero
linearly. t is then a power series in sigma without a linear term, t = t_f - a sigma^2 - b sigma^3 ...; steps stop short of the
fold and t_f is that series, through the last nine of them, at 0. That no fold came before is seen by the sign of the determinant.

Where the rod comes to rest after the fold: the flow of a rod with viscous sections, its end held, in implicit Euler steps.

Prints for every gravity the time of the first fold and the energy released from there, and what coarser polynomials and tolerances
change of both; the last line of each gives how far the constants in tests/suite/hockle.rs are off. Fails if any is off by more than
2e-10 of it. Ten minutes.
Run: python3 tools/ref_hockle.py
"""
import os
import re
import sys

os.environ.setdefault('OMP_NUM_THREADS', '1')

import numpy as np
from scipy.integrate import DOP853
from scipy.linalg import lu_factor, lu_solve

STIFFNESS, AXIAL = np.array([1.1, 1.0, 0.75]), 2e4
REST = np.array([0.1, -0.05, 0.0])
MASS, INERTIA, SPIN = 40.0, np.array([20.0, 20.0, 10.0]), 18.0


def product(p, q):
    """Of quaternions (w, x, y, z), along the first axis."""
    return np.array([p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3], p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
                     p[0] * q[2] + p[2] * q[0] + p[3] * q[1] - p[1] * q[3], p[0] * q[3] + p[3] * q[0] + p[1] * q[2] - p[2] * q[1]])


ONE = np.eye(4)
SIGNS = np.array([1.0, -1, -1, -1])
# p o q = MULTIPLY[i, k, l] p_k q_l, and the rotation R[i, j] = TURN[i, j, k, l] q_k q_l, symmetric in k, l.
MULTIPLY = np.array([[product(ONE[k], ONE[l]) for l in range(4)] for k in range(4)]).transpose(2, 0, 1)
TURN = np.array([[[product(product(ONE[k], ONE[j]), SIGNS * ONE[l])[1:] for l in range(4)] for k in range(4)]
                 for j in (1, 2, 3)]).transpose(3, 0, 1, 2)
TURN = 0.5 * (TURN + TURN.swapaxes(2, 3))
# The cross product a x b = CROSS[i, j, k] a_j b_k.
CROSS = np.cross(np.eye(3)[:, None], np.eye(3)[None]).transpose(2, 0, 1)


def rotation(q):
    return np.einsum('ijkl,k,l', TURN, q, q) / (q @ q)


class Rod:
    """Clamped at the origin; `curves` holds quaternion and place at every node, `wrench` (m, n) at the base."""

    def __init__(self, degree):
        x = -np.cos(np.pi * np.arange(degree + 1) / degree)
        self.s = 0.5 * (x + 1)
        to_series = np.linalg.inv(np.polynomial.chebyshev.chebvander(x, degree))
        antiderivative = np.polynomial.chebyshev.chebint(np.eye(degree + 1), lbnd=-1, axis=0)
        # Integrals from 0 to every node of the polynomial with given values at the nodes.
        self.integral = 0.5 * np.polynomial.chebyshev.chebvander(x, degree + 1) @ antiderivative @ to_series
        self.curves = np.zeros((degree + 1, 7))
        self.curves[:, 0], self.curves[:, 6] = 1.0, self.s
        self.wrench = np.zeros(6)
        # The matrix of the Newton steps, and its rows and columns of the nodes by node, component, node, component.
        self.matrix = np.zeros((7 * degree + 6, 7 * degree + 6), order='F')
        down, right = self.matrix.strides
        self.inner = np.lib.stride_tricks.as_strided(self.matrix, (degree, 7, degree, 7), (7 * down, down, 7 * right, right))
        # Strains without load; and by how much the section is stiffer than elastic, which a step of its flow makes it.
        self.rest, self.unit, self.harder = np.tile(REST, (degree + 1, 1)), np.ones(degree + 1), 1.0

    def strains(self):
        """Of bending and torsion, and the stretch, at every node."""
        frame = np.einsum('ijkl,ak,al->aij', TURN, self.curves[:, :4], self.curves[:, :4])
        m = self.wrench[:3] - np.cross(self.curves[:, 4:], self.wrench[3:])
        u = self.rest + np.einsum('aij,ai->aj', frame, m) / (self.harder * STIFFNESS)
        return u, self.unit + frame[:, :, 2] @ self.wrench[3:] / (self.harder * AXIAL)

    def energy(self):
        u, stretch = self.strains()
        return 0.5 * self.integral[-1] @ ((STIFFNESS * (u - REST)**2).sum(axis=1) + AXIAL * (stretch - 1)**2)

    def rates(self):
        """Of quaternion and place along the rod; their derivatives by them and by the wrench."""
        stiffness, axial = self.harder * STIFFNESS, self.harder * AXIAL
        q, r, m0, n = self.curves[:, :4], self.curves[:, 4:], self.wrench[:3], self.wrench[3:]
        by_turn = 2 * np.einsum('ijkl,al->aijk', TURN, q)
        frame = 0.5 * np.einsum('aijk,ak->aij', by_turn, q)
        m = m0 - np.cross(r, n)
        u, stretch = self.strains()
        spin = np.concatenate([np.zeros((len(q), 1)), u], axis=1)
        f = np.concatenate([0.5 * product(q.T, spin.T).T, frame[:, :, 2] * stretch[:, None]], axis=1)
        by_frame = np.einsum('aijk,ai->ajk', by_turn, m) / stiffness[:, None]
        crossed = np.einsum('ijk,k->ij', CROSS, n)
        by_place = -np.einsum('aij,ik->ajk', frame, crossed) / stiffness[:, None]
        by_couple = frame.swapaxes(1, 2) / stiffness[:, None]
        by_force = -np.einsum('aij,ikl,ak->ajl', frame, CROSS, r) / stiffness[:, None]
        lifted = 0.5 * np.einsum('ikl,ak->ail', MULTIPLY[:, :, 1:], q)
        along = frame[:, :, 2]
        by_z, by_w = np.zeros((len(q), 7, 7)), np.zeros((len(q), 7, 6))
        by_z[:, :4, :4] = 0.5 * np.einsum('ikl,al->aik', MULTIPLY, spin) + lifted @ by_frame
        by_z[:, :4, 4:] = lifted @ by_place
        by_z[:, 4:, :4] = by_turn[:, :, 2] * stretch[:, None, None] + np.einsum('ai,ajk,j->aik', along, by_turn[:, :, 2], n) / axial
        by_w[:, :4, :3], by_w[:, :4, 3:] = lifted @ by_couple, lifted @ by_force
        by_w[:, 4:, 3:] = np.einsum('ai,aj->aij', along, along) / axial
        return f, by_z, by_w

    def linear(self, end):
        """Residual, and in `matrix` its derivative by the nodes behind the base, then the wrench.

        `end` gives the residual of its six conditions, and their derivatives by the last node and by the wrench.
        """
        f, by_z, by_w = self.rates()
        nodes, matrix = len(f) - 1, self.matrix
        np.multiply(-self.integral[1:, None, 1:, None], by_z[1:].swapaxes(0, 1), out=self.inner)
        self.inner[np.arange(nodes), :, np.arange(nodes), :] += np.eye(7)
        matrix[:-6, -6:] = -np.einsum('ji,iab->jab', self.integral[1:], by_w).reshape(7 * nodes, 6)
        residual = (self.curves[1:] - self.curves[0] - self.integral[1:] @ f).ravel()
        at_end, by_end, by_wrench = end(self.curves[-1], self.wrench)
        matrix[-6:] = 0
        matrix[-6:, -13:-6], matrix[-6:, -6:] = by_end, by_wrench
        return np.concatenate([residual, at_end])

    def solve(self, end, tolerance=1e-9, most=25):
        """Newton's method; returns the factors of its last matrix, in whose place the next step puts its own."""
        for _ in range(most):
            residual = self.linear(end)
            factors = lu_factor(self.matrix, overwrite_a=True, check_finite=False)
            step = lu_solve(factors, -residual, check_finite=False)
            self.curves[1:] += step[:-6].reshape(-1, 7)
            self.wrench += step[-6:]
            size = np.abs(step[:-6]).max() + np.abs(step[-6:]).max() / (1 + np.abs(self.wrench).max())
            if not size < 1e2:
                break
            if size < tolerance:
                return factors
        raise ArithmeticError('no equilibrium found')


def loaded(n):
    """The end that no couple acts on, of a rod pulled by n."""
    crossed = np.einsum('ijk,k->ij', CROSS, n)

    def end(last, wrench):
        by_end, by_wrench = np.zeros((6, 7)), np.eye(6)
        by_end[:3, 4:] = -crossed
        by_wrench[:3, 3:] = -np.einsum('ijk,j->ik', CROSS, last[4:])
        return np.concatenate([wrench[:3] - np.cross(last[4:], wrench[3:]), wrench[3:] - n]), by_end, by_wrench
    return end


def held(q, r):
    """The end at a pose: the vector part of q* o q(1) is zero for both signs of q."""
    back = np.einsum('ikl,k->il', MULTIPLY, SIGNS * q)[1:]
    by_end = np.zeros((6, 7))
    by_end[:3, :4], by_end[3:, 4:] = back, np.eye(3)

    def end(last, _):
        return np.concatenate([back @ last[:4], last[4:] - r]), by_end, np.zeros((6, 6))
    return end


class Winding:
    """The body, its rod, and the rates of (quaternion, place, momentum along the directors, velocity, time) by tau."""

    def __init__(self, gravity, degree):
        self.gravity, self.rod = gravity, Rod(degree)
        for part in np.linspace(0.2, 1.0, 5):
            self.rod.wrench[3:] = [0, 0, part * MASS * gravity]
            self.rod.solve(loaded(self.rod.wrench[3:].copy()))
        last = self.rod.curves[-1]
        momentum = INERTIA * (rotation(last[:4]).T @ [0, 0, SPIN])
        self.start = np.concatenate([last, momentum, np.zeros(4)])
        self.accepted = self.rod.curves.copy(), self.rod.wrench.copy()
        self.side = None
        self.scale = np.repeat([20.0, MASS * gravity], 3)

    def rates(self, _, y):
        if not np.isfinite(y).all():
            return np.full(14, np.nan)
        q, r, momentum, v = y[:4], y[4:7], y[7:10], y[10:13]
        rod = self.rod
        rod.curves, rod.wrench = (part.copy() for part in self.accepted)
        try:
            # Newton's method begins with the rod twisted on by what its end has turned since.
            turn = product(SIGNS * rod.curves[-1, :4], q)
            turn *= np.sign(turn[0])
            angle = np.arctan2(turn[3], turn[0]) * rod.s
            extra = np.array([np.cos(angle), 0 * angle, 0 * angle, np.sin(angle)])
            rod.curves[:, :4] = product(rod.curves[:, :4].T, extra).T
            factors = rod.solve(held(q, r))
        except ArithmeticError:
            return np.full(14, np.nan)
        omega = momentum / INERTIA
        frame = rotation(q)
        q_rate = 0.5 * product(q, np.concatenate([[0], omega]))
        n, m = rod.wrench[3:], rod.wrench[:3] - np.cross(r, rod.wrench[3:])
        force = np.array([0, 0, MASS * self.gravity]) - n
        # By time the residual at the end changes by -(q_rate* o q(1)) and by r_rate.
        back = product(SIGNS * q_rate, rod.curves[-1, :4])[1:]
        source = np.zeros(len(factors[0]))
        source[-6:-3], source[-3:] = -back, v
        wrench_rate = lu_solve(factors, source, check_finite=False)[-6:]
        sigma = 1 / np.sqrt(1 + ((wrench_rate / self.scale)**2).sum())
        couple = -frame.T @ m + np.cross(momentum, omega)
        self.sigma = sigma
        # Of the determinant: it changes where the rod passes a fold or a branch.
        pivots = np.count_nonzero(factors[1] != np.arange(len(factors[1])))
        self.sign = (-1)**pivots * np.prod(np.sign(np.diag(factors[0])))
        return sigma * np.concatenate([q_rate, v, couple, force / MASS, [1]])

    def accept(self, y):
        """Every solve up to the next step begins with the rod of this state: from there the way to the fold is down."""
        if not np.isfinite(self.rates(0.0, y)).all():
            raise ArithmeticError(f'no equilibrium at t = {y[-1]}')
        self.accepted = self.rod.curves.copy(), self.rod.wrench.copy()
        self.side = self.side or self.sign
        if self.sign != self.side:
            raise ArithmeticError(f'another equilibrium at t = {y[-1]}')

    def total(self, y):
        momentum, v = y[7:10], y[10:13]
        kinetic = 0.5 * (momentum**2 / INERTIA).sum() + 0.5 * MASS * v @ v
        return kinetic + self.rod.energy() - MASS * self.gravity * y[6]


def at_zero(seen):
    """Columns behind the first at sigma = 0 (the first): of the polynomials through all points without a linear term."""
    sigma, values = seen[:, 0], seen[:, 1:]
    powers = (sigma[:, None] / sigma[0]) ** np.r_[0, 2:len(sigma) + 1]
    return values[-1] + np.linalg.solve(powers, values - values[-1])[0]


def fold(gravity, degree, tolerance):
    """The first fold: its time, elastic energy and pose; what another extrapolation changes of the time; the relative change of
    the total energy; the rod there."""
    winding = Winding(gravity, degree)
    run = DOP853(winding.rates, 0.0, winding.start, np.inf, rtol=tolerance, atol=tolerance, first_step=0.01)
    total, opened, before = winding.total(winding.start), 0.0, None
    seen, rods = [], []
    while not seen or seen[-1][0] > 1e-3:
        run.step()
        if run.status != 'running':
            raise ArithmeticError(f'g = {gravity}: stopped at t = {run.y[-1]}')
        winding.accept(run.y)
        opened = max(opened, abs(winding.total(run.y) / total - 1))
        rods.append(winding.accepted)
        seen.append([winding.sigma, run.y[-1], winding.rod.energy(), *run.y[:7]])
        # No stage may lie behind the fold, where the rod has no equilibrium.
        fall = (before[1] - winding.sigma) / (run.t - before[0]) if before else 0.0
        run.max_step = 0.3 * winding.sigma / fall if fall > 0 else 0.1
        before = run.t, winding.sigma
    seen = np.array(seen)
    other, found = at_zero(seen[-10:-1]), at_zero(seen[-9:])
    # Two last rods, continued beyond the fold by as much as the last one is before it.
    (one, two), part = rods[-2:], 2 * seen[-1, 0] / (seen[-2, 0] - seen[-1, 0])
    winding.rod.curves, winding.rod.wrench = (b + part * (b - a) for a, b in zip(one, two))
    return found[0], found[1], found[2:], abs(found[0] - other[0]), opened, winding.rod


def landing(rod, pose):
    """Energy where the flow of a rod with viscous sections, its end held, comes to rest: implicit Euler steps, each of which
    is an elastic rod that is 1 + 1/step times stiffer and has other strains at rest."""
    end = held(pose[:4], pose[4:])
    step, u, stretch = 1e-3, *rod.strains()
    energy = rod.energy()
    while step < 1e9:
        if step < 1e-12:
            raise ArithmeticError('the rod does not come to rest')
        kept = rod.curves, rod.wrench
        rod.curves, rod.wrench = (part.copy() for part in kept)
        rod.harder = 1 + 1 / step
        rod.rest, rod.unit = (REST + u / step) / rod.harder, (1 + stretch / step) / rod.harder
        try:
            rod.solve(end, most=8)
            now, part = rod.energy(), rod.strains()
            moved = np.abs(part[0] - u).max() / (1 + np.abs(u).max())
            if not (now <= energy * (1 + 1e-12) and moved < 0.05):
                raise ArithmeticError('too far')
        except ArithmeticError:
            (rod.curves, rod.wrench), step = kept, step / 4
            continue
        energy, (u, stretch) = now, part
        step *= 1.5
    return energy


def stored():
    """Gravity, time and energy of every row of FIRST in the test."""
    place = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests', 'suite', 'hockle.rs')
    rows = re.search(r'const FIRST: .*?= \[(.*?)\];', open(place).read(), re.S).group(1)
    return np.array([float(x.replace('_', '')) for x in re.findall(r'[0-9][0-9_.]*', rows)]).reshape(-1, 3)


def main():
    worst = 0.0
    for gravity, *constants in stored():
        # The harder the pull the smaller the loop.
        values, coarse = [], 80 if gravity < 10 else 96
        for degree, tolerance in [(coarse, 1e-10), (coarse + 16, 1e-11)]:
            time, energy, pose, fitted, opened, rod = fold(gravity, degree, tolerance)
            values.append((time, energy - landing(rod, pose)))
            print(f'g = {gravity:<4} degree {degree:3} tolerance {tolerance:.0e}: t {values[-1][0]:.12f} released {values[-1][1]:.9f}'
                  f'  (extrapolation {fitted:.0e}, total energy {opened:.0e})', flush=True)
        off = np.abs(np.array(values + [constants]) / values[1] - 1)
        print(f'         coarser: {off[0][0]:.0e} {off[0][1]:.0e}; stored: {off[2][0]:.0e} {off[2][1]:.0e}', flush=True)
        worst = max(worst, off[2].max())
    return int(not worst < 2e-10)


if __name__ == '__main__':
    sys.exit(main())
