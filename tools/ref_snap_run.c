/* Free motion after the landing, quadruple precision; compiled and called by ref_snap_run.py.
   State (lam, p, vx, vy), r'' = lam^2 (cos alpha, sin alpha), q' = J^-1 v.
   Pendulum measured from its top, chi = pi - psi, chi'' = sin chi, chi(0) = 4 atan(exp(-|p|)), so that taut rods keep relative accuracy;
   Taylor series of order ORD, steps <= 1/2.  Gragg's modified midpoint rule, n = 2..16, extrapolated (order 16).
   usage: prog tol t0 lam p vx vy t1 t2 ...   prints per time: t lam p vx vy x y U alpha steps lammax bounces */
#include <quadmath.h>
#include <stdio.h>
#include <stdlib.h>
#include <math.h>
typedef __float128 Q;
#define ORD 46
static long nev;
static int point(Q lam, Q p, Q *o) /* o: x y xl xp yl yp alpha U lam2 */
{
    Q sg = p < 0 ? -1 : 1, ap = fabsq(p), chi = 4 * atanq(expq(-ap));
    Q h0 = 2 * atanq(expq(-ap)), sh = sinq(h0);
    Q st[8] = {chi, 0, 2 * sh * cosq(h0), 1 - 2 * sh * sh, 0, -2 / coshq(ap), 0, 0};
    Q c1 = -st[3]; /* cos psi1 */
    if (!(lam > 0) || lam > 400) return 1;
    nev++;
    int n = (int)ceil((double)lam / 0.5);
    Q h = lam / n;
    for (int k = 0; k < n; k++) {
        Q a[8][ORD + 1];
        for (int i = 0; i < 8; i++) a[i][0] = st[i];
        for (int m = 0; m < ORD; m++) {
            Q cv = 0, sv = 0, cd = 0, sd = 0, q = h / (m + 1);
            for (int i = 0; i <= m; i++) {
                cv += a[3][i] * a[1][m - i];
                sv += a[2][i] * a[1][m - i];
                cd += a[3][i] * a[5][m - i];
                sd += a[2][i] * a[5][m - i];
            }
            a[0][m + 1] = q * a[1][m];
            a[1][m + 1] = q * a[2][m];
            a[2][m + 1] = q * cv;
            a[3][m + 1] = -q * sv;
            a[4][m + 1] = -q * a[3][m];
            a[5][m + 1] = q * a[6][m];
            a[6][m + 1] = q * cd;
            a[7][m + 1] = q * sd;
        }
        for (int i = 0; i < 8; i++) { Q s = 0; for (int m = ORD; m >= 0; m--) s += a[i][m]; st[i] = s; }
    }
    Q v = st[1], s = st[2], c = st[3], C = st[4], d = st[5], w = st[6], Cd = st[7];
    Q ca = -cosq(st[0]), sa = -sinq(st[0]);
    Q X = C / lam, Y = v / lam, x = ca * X - sa * Y, y = sa * X + ca * Y;
    Q Xl = (-c - X) / lam, Yl = (s - Y) / lam;
    o[0] = x; o[1] = sg * y;
    o[2] = ca * Xl - sa * Yl - y * v;
    o[4] = sg * (sa * Xl + ca * Yl + x * v);
    o[3] = sg * ((ca * Cd - sa * w) / lam - y * d);
    o[5] = (sa * Cd + ca * w) / lam + x * d;
    o[6] = sg * (st[0] - M_PIq);
    o[7] = lam * (C - lam * c1);
    o[8] = lam * lam;
    return 0;
}
static int rhs(const Q *z, Q *f)
{
    Q o[9];
    if (point(z[0], z[1], o)) return 1;
    Q D = o[2] * o[5] - o[3] * o[4];
    f[0] = (o[5] * z[2] - o[3] * z[3]) / D;
    f[1] = (o[2] * z[3] - o[4] * z[2]) / D;
    f[2] = o[8] * cosq(o[6]);
    f[3] = o[8] * sinq(o[6]);
    return 0;
}
static double gbs(const Q *z, const Q *f0, Q H, Q *out)
{
    static Q T[8][8][4];
    for (int i = 0; i < 8; i++) {
        int n = 2 * (i + 1);
        Q h = H / n, a[4], b[4], k[4];
        for (int j = 0; j < 4; j++) { a[j] = z[j]; b[j] = z[j] + h * f0[j]; }
        for (int m = 1; m < n; m++) {
            if (rhs(b, k)) return 1;
            for (int j = 0; j < 4; j++) { Q t = a[j] + 2 * h * k[j]; a[j] = b[j]; b[j] = t; }
        }
        for (int j = 0; j < 4; j++) T[i][0][j] = b[j];
        for (int q = 1; q <= i; q++) {
            Q r = (Q)(i + 1) / (i + 1 - q);
            for (int j = 0; j < 4; j++) T[i][q][j] = T[i][q - 1][j] + (T[i][q - 1][j] - T[i - 1][q - 1][j]) / (r * r - 1);
        }
        if (i == 3) { /* hopeless steps are abandoned early */
            double e = 0;
            for (int j = 0; j < 4; j++) { double d = fabs((double)(T[3][3][j] - T[3][2][j])) / (1 + fabs((double)z[j])); if (!(d <= e)) e = d; }
            if (!(e < 1e-2)) return 1;
        }
    }
    double e = 0;
    for (int j = 0; j < 4; j++) { out[j] = T[7][7][j]; double d = fabs((double)(T[7][7][j] - T[7][6][j])) / (1 + fabs((double)z[j])); if (!(d <= e)) e = d; }
    return e;
}
static void pq(Q x) { char b[64]; quadmath_snprintf(b, sizeof b, "%.28Qe", x); printf("%s ", b); }
int main(int argc, char **argv)
{
    double tol = atof(argv[1]);
    Q t = strtoflt128(argv[2], 0), z[4], f0[4], y[4], o[9], H = 0.001, lmax;
    for (int i = 0; i < 4; i++) z[i] = strtoflt128(argv[3 + i], 0);
    point(z[0], z[1], o);
    int ds = o[2] * o[5] - o[3] * o[4] > 0, bounces = 0, steps = 0;
    double prev = 0;
    lmax = z[0];
    for (int g = 7; g < argc; g++) {
        Q goal = strtoflt128(argv[g], 0);
        while (t < goal) {
            Q h = H < goal - t ? H : goal - t;
            if (rhs(z, f0)) return 2;
            double e = gbs(z, f0, h, y);
            if (!(e <= tol)) { double q = 0.9 * pow(tol / e, 1. / 15); H = h * (q > 0.15 ? q : 0.15); if (H < 1e-14Q) { fprintf(stderr, "stuck\n"); return 4; } continue; }
            int full = h == H;
            for (int i = 0; i < 4; i++) z[i] = y[i];
            t = full ? t + h : goal;
            steps++;
            double q = 0.9 * pow(tol / (e + tol * 1e-6), 1. / 15);
            if (full || q < 1) H = h * (q < 2 ? q : 2);
            if (z[0] > lmax) lmax = z[0];
            point(z[0], z[1], o);
            if ((o[2] * o[5] - o[3] * o[4] > 0) != ds) { fprintf(stderr, "fold at t = %.10g\n", (double)t); return 3; }
            if (prev > 0 && f0[0] <= 0) bounces++;
            prev = (double)f0[0];
        }
        point(z[0], z[1], o);
        pq(goal); for (int i = 0; i < 4; i++) pq(z[i]);
        pq(o[0]); pq(o[1]); pq(o[7]); pq(o[6]);
        printf("%d %.6g %d %ld\n", steps, (double)lmax, bounces, nev);
        fflush(stdout);
    }
    return 0;
}
