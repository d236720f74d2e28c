// The programs of `leastaction chart tape` for any number type, and what the peers share: sizes, the
// least time of some rounds, rows program,operations,peer,version,record_ns,gradient_ns,again_ns.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <string>
#include <vector>

using column = std::vector<double>;

template <class real> real lu(std::size_t side, std::vector<real> a)
{
    for (std::size_t k = 0; k < side; k++)
        for (std::size_t i = k + 1; i < side; i++) {
            real *row = &a[i * side];
            row[k] = row[k] / a[k * side + k];
            for (std::size_t j = k + 1; j < side; j++)
                row[j] = row[j] - row[k] * a[k * side + j];
        }
    real y = log(a[0]);
    for (std::size_t k = 1; k < side; k++)
        y = y + log(a[k * side + k]);
    return y;
}

template <class real> real burgers(std::size_t side, std::vector<real> now)
{
    std::size_t points = side * side;
    std::vector<real> next(2 * points);
    for (std::size_t k = 0; k < side; k++, std::swap(now, next))
        for (std::size_t i = 0; i < 2 * points; i++) {
            std::size_t row = i % points / side, col = i % side, at = row * side + col;
            std::size_t east = row * side + (col + 1) % side, west = row * side + (col + side - 1) % side;
            std::size_t north = (row + 1) % side * side + col, south = (row + side - 1) % side * side + col;
            const real *u = now.data(), *v = u + points, *w = u + i / points * points;
            real drift = u[at] * (w[east] - w[west]) + v[at] * (w[north] - w[south]);
            real spread = w[east] + w[west] + (w[north] + w[south]) - 4.0 * w[at];
            next[i] = w[at] + (0.01 * spread - 0.005 * drift);
        }
    real y = now[0] * now[0];
    for (std::size_t i = 1; i < 2 * points; i++)
        y = y + now[i] * now[i];
    return y;
}

inline double seconds()
{
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

struct times {
    double record = std::numeric_limits<double>::infinity(), first = record, again = record;
};

template <class job> void keep_least(double &least, job run)
{
    double began = seconds();
    run();
    least = std::min(least, seconds() - began);
}

// `peer` records the program anew (record) and computes its gradient (gradient).
template <class peer> void measure(const char *name, const char *version, double most)
{
    for (bool is_lu : {true, false})
        for (double wanted = 1e3; wanted < 1.1 * most; wanted *= 10) {
            std::size_t side = std::size_t(std::lround(std::cbrt(wanted / (is_lu ? 2.0 / 3 : 28))));
            column x((is_lu ? 1 : 2) * side * side), g(x.size());
            for (std::size_t i = 0; i < x.size(); i++)
                x[i] = std::sin(double(i + 1)) + (is_lu && i % (side + 1) == 0 ? double(side) : 0);
            times t;
            for (double round = 0; round < std::min(5.0, 1e6 / wanted); round++) {
                peer p;
                keep_least(t.record, [&] { p.record(is_lu, side, x); });
                keep_least(t.first, [&] { p.gradient(x, g); });
                for (int k = 0; k < std::max(1.0, 1e6 / wanted); k++)
                    keep_least(t.again, [&] { p.gradient(x, g); });
            }
            double n = double(side), cubed = is_lu ? n * (n - 1) / 2 + (n - 1) * n * (2 * n - 1) / 3 + 2 * n - 1
                                                   : 28 * n * n * n + 4 * n * n - 1;
            std::printf("%s,%.0f,%s,%s,%.1f,%.1f,%.1f\n", is_lu ? "lu" : "burgers", cubed, name, version,
                        1e9 * t.record / cubed, 1e9 * t.first / cubed, 1e9 * t.again / cubed);
        }
}
