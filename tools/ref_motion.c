/* Motion of a mass on the planar elastica without snaps, quadruple precision; compiled and called by ref_motion.py.
   State (p, w, vx, vy), r'' = lam^2 (cos alpha, sin alpha) + dead load, q' = J^-1 v: docs/theory.md 2.2, plain time.
   RF and RD by Carlson's duplication (Numer. Algorithms 10 (1995) 13-26). Gragg's modified midpoint rule, n = 2..16, extrapolated (order 16).
   usage: prog tol x y p w fx fy t_end dt    starts at rest at (x, y), the equilibrium next to (p, w) by Newton's method;
   prints p and w of the start, then per time: t x y vx vy U alpha lam p w steps lammax wmax turns evaluations */
#include <quadmath.h>
#include <stdio.h>
#include <stdlib.h>
#include <math.h>
typedef __float128 Q;
static long evaluations;
static Q load[2];

/* RF(x, y, z) and RD(x, y, z) on one ladder of duplications. */
static void rf_rd(Q x, Q y, Q z, Q *rf, Q *rd)
{
    Q x0 = x, y0 = y, z0 = z, a0 = (x + y + z) / 3, d0 = (x + y + 3 * z) / 5, a = a0, d = d0, sum = 0, four = 1;
    double far = fmax(fmax(fabs((double)(d0 - x)), fabs((double)(d0 - y))), fabs((double)(d0 - z)));
    far = fmax(far, fmax(fmax(fabs((double)(a0 - x)), fabs((double)(a0 - y))), fabs((double)(a0 - z)))) * 1e6;
    for (; far > fmin((double)(a * four), (double)(d * four)); four *= 4) {
        Q sx = sqrtq(x), sy = sqrtq(y), sz = sqrtq(z), l = sx * sy + sy * sz + sz * sx;
        sum += 1 / (four * sz * (z + l));
        x = (x + l) / 4, y = (y + l) / 4, z = (z + l) / 4, a = (a + l) / 4, d = (d + l) / 4;
    }
    Q X = (a0 - x0) / (four * a), Y = (a0 - y0) / (four * a), Z = -X - Y;
    Q e2 = X * Y - Z * Z, e3 = X * Y * Z;
    *rf = (1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44 - 5 * e2 * e2 * e2 / 208 + 3 * e3 * e3 / 104 + e2 * e2 * e3 / 16) / sqrtq(a);
    X = (d0 - x0) / (four * d), Y = (d0 - y0) / (four * d), Z = -(X + Y) / 3;
    Q xy = X * Y, E2 = xy - 6 * Z * Z, E3 = (3 * xy - 8 * Z * Z) * Z, E4 = 3 * (xy - Z * Z) * Z * Z, E5 = xy * Z * Z * Z;
    *rd = (1 - 3 * E2 / 14 + E3 / 6 + 9 * E2 * E2 / 88 - 3 * E4 / 22 - 9 * E2 * E3 / 52 + 3 * E5 / 26 - E2 * E2 * E2 / 16 + 3 * E3 * E3 / 40
           + 3 * E2 * E4 / 20 + 45 * E2 * E2 * E3 / 272 - 9 * (E3 * E4 + E2 * E5) / 68) / (four * d * sqrtq(d)) + 3 * sum;
}

typedef struct { Q x, y, xp, yp, xw, yw, alpha, lam, U; } Point;

static void integrals(Q kap, Q kc, Q s, Q c, Q *lam, Q *B)
{
    Q rf, rd, d2 = kc * kc + kap * kap * s * s;
    rf_rd(kc * kc * c * c, d2, kc * kc, &rf, &rd);
    *lam = s * rf;
    *B = kc * kc / 3 * s * s * s * rd;
}
static Point point(Q p, Q w)
{
    Point o;
    Q kap = tanhq(p), kc = 1 / coshq(p), s = sinq(w), c = cosq(w), D = sqrtq(kc * kc + kap * kap * s * s), lam, B;
    int n = (int)floorq(w / M_PIq + 0.5Q);
    evaluations++;
    integrals(kap, kc, sinq(w - n * M_PIq), c, &lam, &B);
    if (n) {
        Q K, full;
        integrals(kap, kc, 1, 0, &K, &full);
        lam += 2 * n * K;
        B += 2 * n * full;
    }
    Q kc2 = kc * kc, dE = kc2 * lam + kap * kap * B;
    Q lp = kap * (B + c * s / D), lw = 1 / D, ep = -kc2 * kap * (lam - B), ap = -2 * kc2 * c / D, aw = 2 * kap * s / D;
    Q X = 2 * dE / lam - 1, Y = 2 * kap * s / lam;
    Q Xp = 2 * ep / lam - (X + 1) * lp / lam, Xw = 2 * D / lam - (X + 1) * lw / lam;
    Q Yp = 2 * kc2 * s / lam - Y * lp / lam, Yw = 2 * kap * c / lam - Y * lw / lam;
    o.alpha = -2 * atan2q(kap * c, D);
    Q ca = cosq(o.alpha), sa = sinq(o.alpha);
    Q ip = Xp - ap * Y, jp = Yp + ap * X, iw = Xw - aw * Y, jw = Yw + aw * X;
    o.x = ca * X - sa * Y, o.y = sa * X + ca * Y;
    o.xp = ca * ip - sa * jp, o.yp = sa * ip + ca * jp, o.xw = ca * iw - sa * jw, o.yw = sa * iw + ca * jw;
    o.lam = lam;
    o.U = 2 * lam * kap * kap * B;
    return o;
}
static void rhs(const Q *z, Q *f)
{
    Point o = point(z[0], z[1]);
    Q det = o.xp * o.yw - o.xw * o.yp;
    f[0] = (o.yw * z[2] - o.xw * z[3]) / det;
    f[1] = (o.xp * z[3] - o.yp * z[2]) / det;
    f[2] = o.lam * o.lam * cosq(o.alpha) + load[0];
    f[3] = o.lam * o.lam * sinq(o.alpha) + load[1];
}
/* One step of length H; returns the difference of the last two columns, relative to 1 + size. */
static double gbs(const Q *z, const Q *f0, Q H, Q *out)
{
    static Q T[8][8][4];
    double e = 0;
    for (int i = 0; i < 8; i++) {
        int n = 2 * (i + 1);
        Q h = H / n, a[4], b[4], k[4];
        for (int j = 0; j < 4; j++) { a[j] = z[j]; b[j] = z[j] + h * f0[j]; }
        for (int m = 1; m < n; m++) {
            if (!(b[1] > 0 && fabsq(b[0]) < 1000 && b[1] < 1000)) return 1;
            rhs(b, k);
            for (int j = 0; j < 4; j++) { Q t = a[j] + 2 * h * k[j]; a[j] = b[j]; b[j] = t; }
        }
        for (int j = 0; j < 4; j++) T[i][0][j] = b[j];
        for (int q = 1; q <= i; q++) {
            Q r = (Q)(i + 1) / (i + 1 - q);
            for (int j = 0; j < 4; j++) T[i][q][j] = T[i][q - 1][j] + (T[i][q - 1][j] - T[i - 1][q - 1][j]) / (r * r - 1);
        }
        if (i == 3 || i == 7) { /* hopeless steps are abandoned early */
            e = 0;
            for (int j = 0; j < 4; j++) { double d = fabs((double)(T[i][i][j] - T[i][i - 1][j])) / (1 + fabs((double)z[j])); if (!(d <= e)) e = d; }
            if (!(e < 1e-2)) return 1;
        }
    }
    for (int j = 0; j < 4; j++) out[j] = T[7][7][j];
    return e;
}
static void number(Q x) { char b[64]; quadmath_snprintf(b, sizeof b, "%.28Qe", x); printf("%s ", b); }
int main(int argc, char **argv)
{
    Q a[8], z[4], f0[4], y[4], t = 0, H = 0.001Q;
    if (argc != 10) return 5;
    double tol = atof(argv[1]), lmax = 0, wmax = 0, before = 0;
    for (int i = 0; i < 8; i++) a[i] = strtoflt128(argv[2 + i], 0);
    load[0] = a[4], load[1] = a[5];
    z[0] = a[2], z[1] = a[3], z[2] = z[3] = 0;
    for (int i = 0; i < 40; i++) {
        Point o = point(z[0], z[1]);
        Q det = o.xp * o.yw - o.xw * o.yp, ex = o.x - a[0], ey = o.y - a[1];
        z[0] -= (o.yw * ex - o.xw * ey) / det;
        z[1] -= (o.xp * ey - o.yp * ex) / det;
    }
    number(z[0]), number(z[1]), printf("\n");
    Point o = point(z[0], z[1]);
    int side = o.xp * o.yw - o.xw * o.yp > 0, turns = 0, steps = 0, rows = (int)roundq(a[6] / a[7]);
    for (int row = 0; row <= rows; row++) {
        Q goal = row * a[7];
        while (t < goal) {
            Q h = H < goal - t ? H : goal - t;
            rhs(z, f0);
            double e = gbs(z, f0, h, y);
            if (!(e <= tol)) { double q = 0.9 * pow(tol / e, 1. / 15); H = h * (q > 0.15 ? q : 0.15); if (H < 1e-14Q) { fprintf(stderr, "stuck\n"); return 4; } continue; }
            int full = h == H;
            for (int i = 0; i < 4; i++) z[i] = y[i];
            t = full ? t + h : goal;
            steps++;
            double q = 0.9 * pow(tol / (e + tol * 1e-6), 1. / 15);
            if (full || q < 1) H = h * (q < 2 ? q : 2);
            o = point(z[0], z[1]);
            if ((o.xp * o.yw - o.xw * o.yp > 0) != side) { fprintf(stderr, "fold at t = %.10g\n", (double)t); return 3; }
            double out = (double)(o.x * z[2] + o.y * z[3]);
            if (before > 0 && out <= 0) turns++;            /* the mass turns back from the circle |r| = 1 */
            before = out;
            if ((double)o.lam > lmax) lmax = (double)o.lam;
            if ((double)z[1] > wmax) wmax = (double)z[1];
        }
        o = point(z[0], z[1]);
        Q out[] = {goal, o.x, o.y, z[2], z[3], o.U, o.alpha, o.lam, z[0], z[1]};
        for (int i = 0; i < 10; i++) number(out[i]);
        printf("%d %.10g %.10g %d %ld\n", steps, lmax, wmax, turns, evaluations);
        fflush(stdout);
    }
    return 0;
}
