"""Reference of a mass on a bar with friction that bounces against a wall: flights in closed form.

The bar stretches alone: m = 1, stiffness K, viscosity C. A force F + A sin(W t) presses the mass onto the wall at the
stretch G, which it hits with the restitution E. After infinitely many bounces it rests there, until the force on the
wall, F + A sin(W t) - K G, is zero. Then it flies again.

    python3 tools/ref_damped_bounce.py

prints the times and speeds of the first impacts, the end of the bounces, the time of release, and the state at END.
"""

from mpmath import asin, cos, exp, findroot, mp, mpf, pi, sin, sqrt

mp.dps = 40
K, C, F, A, W, G, E, END = map(mpf, ("20", "0.8", "8", "7", "1.3", "0.1", "0.6", "3.9"))


def flight(t0, x0, v0):
    """Place and speed as functions of time, from the state at t0."""
    # Steady part: F/K + s sin(W t) + d cos(W t).
    det = (K - W * W) ** 2 + (C * W) ** 2
    s, d = A * (K - W * W) / det, -A * C * W / det
    steady = lambda t: F / K + s * sin(W * t) + d * cos(W * t)
    steady_rate = lambda t: W * (s * cos(W * t) - d * sin(W * t))
    h, n = C / 2, sqrt(K - C * C / 4)
    a = x0 - steady(t0)
    b = (v0 - steady_rate(t0) + h * a) / n
    x = lambda t: steady(t) + exp(-h * (t - t0)) * (a * cos(n * (t - t0)) + b * sin(n * (t - t0)))
    v = lambda t: steady_rate(t) + exp(-h * (t - t0)) * (
        (n * b - h * a) * cos(n * (t - t0)) - (n * a + h * b) * sin(n * (t - t0))
    )
    return x, v


def first_hit(x, t0, step):
    """First root of x = G after t0, which is no root to count."""
    t = t0 + step
    while x(t) < G:
        t += step
    return findroot(lambda u: x(u) - G, (t - step / 2, t), solver="anderson")


def main():
    t, x, v, lost = mpf(0), mpf(0), mpf(0), mpf(0)
    for number in range(80):
        # Later flights last about 2 v/a.
        step = mpf("0.01") if number == 0 else -v / 40
        place, speed = flight(t, x, v)
        t = first_hit(place, t, step)
        v = speed(t)
        lost += (1 - E * E) * v * v / 2
        if number < 6:
            print(f"impact {number}: t = {mp.nstr(t, 17)}, speed {mp.nstr(v, 17)}")
        x, v = G, -E * v
    # What is left of the geometric sequence is below rounding.
    print("accumulation", mp.nstr(t, 17), "lost in impacts", mp.nstr(lost, 17))
    release = (pi - asin((K * G - F) / A)) / W
    print("release", mp.nstr(release, 17))
    place, speed = flight(release, G, mpf(0))
    print("end", mp.nstr(place(END), 17), mp.nstr(speed(END), 17))


main()
