// A mass on the planar elastica as one would write it in C++: closed forms by Boost's Carlson integrals, RKF78 by Boost's odeint, the chart (p, w) of
// docs/theory.md 2.2 as state, time as it is. Called by `cargo bench --bench work_precision`:
//   boost_plane W=x,y,0,vx,vy,0 ...   the place and the velocity at t = 20 to compare with; prints KEY method tolerance error right-hand-sides milliseconds
#include <array>
#include <boost/math/special_functions/ellint_rd.hpp>
#include <boost/math/special_functions/ellint_rf.hpp>
#include <boost/numeric/odeint.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>

using State = std::array<double, 4>; // p, w, vx, vy

struct Motion {
    const char *key;
    double p, w; // at rest there
    double load[2];
};
// The starts of tests/data/motion_*.json.
static const Motion motions[] = {
    {"W", 1.0271856612491402, 2.5407679515596731, {-8, -2}},
    {"B", 0.32157894982544838, 3.6415877655977810, {0, 0}},
    {"H", 0.62161487696899186, 3.9899887769607351, {0, 0}},
};

struct Point {
    double x, y, xp, yp, xw, yw, fx, fy;
};

static Point point(double p, double w)
{
    // In double precision, as the rest.
    const boost::math::policies::policy<boost::math::policies::promote_double<false>> plain;
    const auto rf = [plain](double x, double y, double z) { return boost::math::ellint_rf(x, y, z, plain); };
    const auto rd = [plain](double x, double y, double z) { return boost::math::ellint_rd(x, y, z, plain); };
    const double kap = std::tanh(p), kc = 1 / std::cosh(p), kc2 = kc * kc, s = std::sin(w), c = std::cos(w);
    const double D2 = kc2 + kap * kap * s * s, D = std::sqrt(D2);
    const double n = std::floor(w / M_PI + 0.5), t = std::sin(w - n * M_PI);
    double lam = t * rf(kc2 * c * c, D2, kc2), B = kc2 / 3 * t * t * t * rd(kc2 * c * c, D2, kc2);
    if (n > 0) {
        lam += 2 * n * rf(0., 1., kc2);
        B += 2 * n * kc2 / 3 * rd(0., 1., kc2);
    }
    const double dE = kc2 * lam + kap * kap * B;
    const double lp = kap * (B + c * s / D), lw = 1 / D, ep = -kc2 * kap * (lam - B), ap = -2 * kc2 * c / D, aw = 2 * kap * s / D;
    const double X = 2 * dE / lam - 1, Y = 2 * kap * s / lam;
    const double Xp = 2 * ep / lam - (X + 1) * lp / lam, Xw = 2 * D / lam - (X + 1) * lw / lam;
    const double Yp = 2 * kc2 * s / lam - Y * lp / lam, Yw = 2 * kap * c / lam - Y * lw / lam;
    const double alpha = -2 * std::atan2(kap * c, D), ca = std::cos(alpha), sa = std::sin(alpha);
    const double ip = Xp - ap * Y, jp = Yp + ap * X, iw = Xw - aw * Y, jw = Yw + aw * X;
    return {ca * X - sa * Y,   sa * X + ca * Y,   ca * ip - sa * jp, sa * ip + ca * jp,
            ca * iw - sa * jw, sa * iw + ca * jw, lam * lam * ca,    lam * lam * sa};
}

static const double duration = 20;
static long count;

int main(int argc, char **argv)
{
    namespace ode = boost::numeric::odeint;
    for (int i = 1; i < argc; i++) {
        const std::string given(argv[i]);
        const size_t equals = given.find('=');
        double end[6];
        if (std::sscanf(given.c_str() + equals + 1, "%lf,%lf,%lf,%lf,%lf,%lf", end, end + 1, end + 2, end + 3, end + 4, end + 5) != 6) {
            std::fprintf(stderr, "%s: six numbers are wanted\n", argv[i]);
            return 2;
        }
        for (const Motion &motion : motions) {
            if (given.substr(0, equals) != motion.key) continue;
            const auto slope = [&motion](const State &z, State &f, double) {
                const Point o = point(z[0], z[1]);
                const double det = o.xp * o.yw - o.xw * o.yp;
                f = {(o.yw * z[2] - o.xw * z[3]) / det, (o.xp * z[3] - o.yp * z[2]) / det, o.fx + motion.load[0], o.fy + motion.load[1]};
                count++;
            };
            for (int digits = 4; digits <= 12; digits += 2) {
                const double tolerance = std::pow(10, -digits);
                double best = INFINITY;
                State z{};
                for (int run = 0; run < 5; run++) {
                    z = {motion.p, motion.w, 0, 0};
                    count = 0;
                    const auto clock = std::chrono::steady_clock::now();
                    auto stepper = ode::make_controlled(tolerance, tolerance, ode::runge_kutta_fehlberg78<State>());
                    double t = 0, h = 1e-3;
                    while (t < duration) {
                        h = std::fmin(h, duration - t);
                        try {
                            stepper.try_step(slope, z, t, h);
                        } catch (const std::exception &) { // a step tried beyond the chart
                            h /= 4;
                        }
                    }
                    best = std::fmin(best, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - clock).count());
                }
                const Point o = point(z[0], z[1]);
                const double error = std::fmax(std::hypot(o.x - end[0], o.y - end[1]), std::hypot(z[2] - end[3], z[3] - end[4]));
                std::printf("%s C++,~Boost,~RKF78 1e-%d %.3e %ld %.4f\n", motion.key, digits, error, count, best);
                std::fflush(stdout);
            }
        }
    }
}
