/* Planar inextensible viscoelastic rod with a point mass, in long double; compiled and called by ref_viscous_core.py.
   Unknowns: strain u = theta' and Maxwell strains z_k at N Gauss nodes, then vx, vy, rx, ry (integrated: a check), dissipated, drag loss, work of loads.
   q(s) = J(r(1) - r(s)), J(a,b) = (-b,a); overstress(n) = q.n - u - sum E_k (u - z_k) = eta u_t; v = int q u_t fixes n.
   Integrator: Gragg's modified midpoint rule extrapolated with 2, 4, ..., 16 substeps (order 16). */
#define _GNU_SOURCE
#include <math.h>
#include <stdlib.h>
#include <string.h>
#ifndef REAL
#define REAL long double
#define SINCOS sincosl
#define FABS fabsl
#define POW powl
#define SIN sinl
#endif
typedef REAL real;
#define KM 8
typedef struct {
    int N, K, M;                  /* M: size of the state */
    const real *w, *C;
    real eta, E[4], tau[4], mu, g[2], dead[2], drag, amp[2], om;
} Sys;
typedef struct { real n[2], r[2], G[3], rate; } Aux;

static void rhs(const Sys *S, real t, const real *y, real *f, Aux *a)
{
    int N = S->N, K = S->K;
    real c[N], s[N], q[N], p[N], o[N];
    real X = 0, Y = 0;
    for (int i = 0; i < N; i++) {
        real th = 0;
        const real *Ci = S->C + i * N;
        for (int j = 0; j < N; j++) th += Ci[j] * y[j];
        SINCOS(th, s + i, c + i);
        X += S->w[i] * c[i];
        Y += S->w[i] * s[i];
    }
    real gxx = 0, gxy = 0, gyy = 0, bx = 0, by = 0;
    for (int i = 0; i < N; i++) {
        real x = 0, yy = 0;
        const real *Ci = S->C + i * N;
        for (int j = 0; j < N; j++) { x += Ci[j] * c[j]; yy += Ci[j] * s[j]; }
        q[i] = -(Y - yy);
        p[i] = X - x;
        o[i] = y[i];
        for (int k = 0; k < K; k++) o[i] += S->E[k] * (y[i] - y[(k + 1) * N + i]);
        gxx += S->w[i] * q[i] * q[i]; gxy += S->w[i] * q[i] * p[i]; gyy += S->w[i] * p[i] * p[i];
        bx += S->w[i] * q[i] * o[i]; by += S->w[i] * p[i] * o[i];
    }
    const real *e = y + (K + 1) * N;
    real *fe = f + (K + 1) * N;
    bx += S->eta * e[0]; by += S->eta * e[1];
    real det = gxx * gyy - gxy * gxy;
    real nx = (gyy * bx - gxy * by) / det, ny = (gxx * by - gxy * bx) / det;
    real rate = 0;
    for (int i = 0; i < N; i++) {
        f[i] = (q[i] * nx + p[i] * ny - o[i]) / S->eta;
        rate += S->w[i] * S->eta * f[i] * f[i];
        for (int k = 0; k < K; k++) {
            real d = y[i] - y[(k + 1) * N + i];
            f[(k + 1) * N + i] = d / S->tau[k];
            rate += S->w[i] * S->E[k] * d * d / S->tau[k];
        }
    }
    real sn = SIN(S->om * t);
    real lx = S->dead[0] + S->amp[0] * sn + S->mu * S->g[0], ly = S->dead[1] + S->amp[1] * sn + S->mu * S->g[1];
    fe[0] = (-nx + lx - S->drag * e[0]) / S->mu;
    fe[1] = (-ny + ly - S->drag * e[1]) / S->mu;
    fe[2] = e[0]; fe[3] = e[1];
    fe[4] = rate;
    fe[5] = S->drag * (e[0] * e[0] + e[1] * e[1]);
    fe[6] = lx * e[0] + ly * e[1];
    if (a) { a->n[0] = nx; a->n[1] = ny; a->r[0] = X; a->r[1] = Y; a->G[0] = gxx; a->G[1] = gxy; a->G[2] = gyy; a->rate = rate; }
}

static real step(const Sys *S, real t, const real *y, const real *f0, real H, real *out, real *T, real *w1, real *w2, real *f)
{
    int M = S->M;
    real err = 0;
    for (int m = 0; m < KM; m++) {
        int n = 2 * (m + 1);
        real h = H / n;
        real *a = w1, *b = w2;
        for (int i = 0; i < M; i++) { a[i] = y[i]; b[i] = y[i] + h * f0[i]; }
        for (int k = 1; k < n; k++) {
            rhs(S, t + k * h, b, f, 0);
            for (int i = 0; i < M; i++) a[i] += 2 * h * f[i];
            real *x = a; a = b; b = x;
        }
        /* T[j] holds column j of the previous row */
        real *prev = T;                       /* KM rows of M */
        for (int i = 0; i < M; i++) {
            real cur = b[i], old;
            for (int j = 0; j < m; j++) {
                real rt = (real)n / (2 * (m - j));
                old = prev[j * M + i];
                prev[j * M + i] = cur;
                cur = cur + (cur - old) / (rt * rt - 1);
            }
            prev[m * M + i] = cur;
        }
    }
    /* after the last row T[j] holds T_{KM-1, j} */
    for (int i = 0; i < M; i++) {
        real d = FABS(T[(KM - 1) * M + i] - T[(KM - 2) * M + i]) / (1 + FABS(y[i]));
        if (!(d <= err)) err = d;
        out[i] = T[(KM - 1) * M + i];
    }
    return err;
}

/* out: nt rows of (t, rx, ry, vx, vy, nx, ny, dissipated, drag loss, work, rate, gxx, gxy, gyy, rx ode, ry ode, steps), then u, z_k at the nodes */
int run(int N, int K, const real *w, const real *C, const real *par, real tol, const real *y0, int nt, const real *times, real *out, real hmax)
{
    Sys S = { N, K, (K + 1) * N + 7, w, C, par[0] };
    int M = S.M, W = 17 + (K + 1) * N;
    for (int k = 0; k < K; k++) { S.E[k] = par[1 + k]; S.tau[k] = par[3 + k]; }
    S.mu = par[5]; S.g[0] = par[6]; S.g[1] = par[7]; S.dead[0] = par[8]; S.dead[1] = par[9]; S.drag = par[10]; S.amp[0] = par[11]; S.amp[1] = par[12]; S.om = par[13];
    real *mem = malloc(sizeof(real) * M * (KM + 6));
    real *y = mem, *f0 = mem + M, *o = mem + 2 * M, *w1 = mem + 3 * M, *w2 = mem + 4 * M, *f = mem + 5 * M, *T = mem + 6 * M;
    memcpy(y, y0, sizeof(real) * M);
    real t = 0, H = 0.1L * S.eta;
    long steps = 0;
    Aux a;
    int rc = 0;
    for (int k = 0; k < nt; k++) {
        while (t < times[k]) {
            rhs(&S, t, y, f0, &a);
            for (;;) {
                real h = H, left = times[k] - t;
                int last = 0;
                if (h > hmax) h = hmax;
                if (h >= left) { h = left; last = 1; } else if (h > left / 2) h = left / 2;
                real err = step(&S, t, y, f0, h, o, T, w1, w2, f);
                if (!(err == err)) err = 1e9L;
                real fac = 0.85L * POW((tol + 1e-25L) / (err + 1e-25L), 1.0L / 15);
                if (err <= tol) {
                    memcpy(y, o, sizeof(real) * M);
                    t = last ? times[k] : t + h;
                    steps++;
                    if (fac > 3) fac = 3;
                    if (!(last && h < H) || fac < 1) H = h * fac; 
                    break;
                }
                if (fac < 0.1L) fac = 0.1L;
                if (fac > 0.9L) fac = 0.9L;
                H = h * fac;
                if (H < 1e-17L) { rc = 1; goto end; }
            }
        }
        rhs(&S, t, y, f0, &a);
        real *O = out + (long)k * W, *e = y + (K + 1) * N;
        real row[17] = { t, a.r[0], a.r[1], e[0], e[1], a.n[0], a.n[1], e[4], e[5], e[6], a.rate, a.G[0], a.G[1], a.G[2], e[2], e[3], steps };
        memcpy(O, row, sizeof row);
        memcpy(O + 17, y, sizeof(real) * (K + 1) * N);
    }
end:
    free(mem);
    return rc;
}
