// The objectives of `leastaction chart gradients` for any number type, and what the peers written in
// C++ share: values from gradients-values.csv, medians of processor time, rows
// job,peer,version,seconds,difference.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

constexpr int slices = 100;
using column = std::vector<double>;

// T - V at one slice, q and v of all coordinates there.
template <class real> real threebody(const real *q, const real *v)
{
    real L = 0;
    for (int k = 0; k < 6; k++)
        L += 0.5 * v[k] * v[k];
    for (int a = 0; a < 3; a++)
        for (int b = a + 1; b < 3; b++) {
            real dx = q[2 * a] - q[2 * b], dy = q[2 * a + 1] - q[2 * b + 1];
            L += 1.3e-4 / (sqrt(dx * dx + dy * dy + 1e-6) + 1e-6);
        }
    return L;
}

template <class real> real dblpend(const real *q, const real *v)
{
    real L = v[0] * v[0] + 0.5 * v[1] * v[1] + v[0] * v[1] * cos(q[0] - q[1]);
    return L + 2 * cos(q[0]) + cos(q[1]);
}

template <class real> real ephemeris(const real *q, const real *v)
{
    static const double G = 6.67430e-11;
    static const double gm[] = {132712440041.93938e9, 22031.86855e9, 324858.592e9,
                                398600.435436e9, 42828.375214e9};
    real L = 0;
    for (int k = 0; k < 15; k++)
        L += 0.5 * gm[k / 3] / G * v[k] * v[k];
    for (int a = 0; a < 5; a++)
        for (int b = a + 1; b < 5; b++) {
            real dx = q[3 * a] - q[3 * b], dy = q[3 * a + 1] - q[3 * b + 1];
            real dz = q[3 * a + 2] - q[3 * b + 2];
            L += gm[a] * gm[b] / G / sqrt(dx * dx + dy * dy + dz * dz);
        }
    return L;
}

template <class real> real gas(const real *q, const real *v)
{
    real L = 0;
    for (int k = 0; k < 100; k++)
        L += 0.5 * v[k] * v[k];
    for (int a = 0; a < 50; a++)
        for (int b = a + 1; b < 50; b++) {
            real dx = q[2 * a] - q[2 * b], dy = q[2 * a + 1] - q[2 * b + 1];
            real u = 0.04 * 0.04 / (dx * dx + dy * dy + 1e-6), u3 = u * u * u;
            L -= 1e-4 * (u3 * u3 - u3);
        }
    return L;
}

// The mean over slices and bodies under rule left+repeat; x [dof x slices].
template <class real, class lagrangian>
real objective(lagrangian L, int dof, double dt, int bodies, const real *x)
{
    std::vector<real> q(dof), v(dof);
    real S = 0;
    for (int i = 0; i < slices; i++) {
        int j = i < slices - 1 ? i : slices - 2;
        for (int k = 0; k < dof; k++) {
            q[k] = x[k * slices + i];
            v[k] = (x[k * slices + j + 1] - x[k * slices + j]) / dt;
        }
        S += L(q.data(), v.data());
    }
    return S / (bodies * slices);
}

template <class real> real objective_of(const std::string &scene, const real *x)
{
    if (scene == "threebody")
        return objective(threebody<real>, 6, 0.5, 3, x);
    if (scene == "dblpend")
        return objective(dblpend<real>, 2, 0.06, 1, x);
    if (scene == "ephemeris")
        return objective(ephemeris<real>, 15, 86400.0, 5, x);
    return objective(gas<real>, 100, 0.2, 50, x);
}

struct values {
    column x, u, gradient, product;
};

inline std::map<std::string, values> read_values(const char *name)
{
    std::map<std::string, values> found;
    std::ifstream in(name);
    std::string line, cell, cells[8];
    bool header = true;
    while (std::getline(in, line)) {
        if (line[0] == '#')
            continue;
        std::istringstream row(line);
        for (int k = 0; k < 8 && std::getline(row, cell, ','); k++)
            cells[k] = cell;
        if (!header) {
            values &v = found[cells[0]];
            v.x.push_back(std::stod(cells[3]));
            v.u.push_back(std::stod(cells[4]));
            v.gradient.push_back(std::stod(cells[5]));
            v.product.push_back(std::stod(cells[6]));
        }
        header = false;
    }
    return found;
}

template <class job> double median_seconds(job run)
{
    auto now = [] { return std::clock() / double(CLOCKS_PER_SEC); };
    run();
    double began = now(), started = began;
    run();
    int calls = std::max(1, int(0.02 / std::max(now() - began, 1e-7)));
    column times;
    while (times.empty() || (now() - started < 0.5 && times.size() < 101)) {
        began = now();
        for (int k = 0; k < calls; k++)
            run();
        times.push_back((now() - began) / calls);
    }
    std::sort(times.begin(), times.end());
    return times[times.size() / 2];
}

// run() leaves its result in `theirs`.
template <class job>
void report(const std::string &name, const char *peer, const char *version, job run,
            const column &ours, const column &theirs)
{
    double seconds = median_seconds(run), largest = 0, difference = 0;
    for (std::size_t k = 0; k < ours.size(); k++) {
        largest = std::max(largest, std::fabs(ours[k]));
        difference = std::max(difference, std::fabs(ours[k] - theirs[k]));
    }
    std::printf("%s,%s,%s,%.4g,%.2g\n", name.c_str(), peer, version, seconds, difference / largest);
    std::fflush(stdout);
}
