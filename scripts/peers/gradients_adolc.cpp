// Derivatives of the discretised actions by ADOL-C: recorded once, the tape played again.
//
//     gradients_adolc charts/gradients-values.csv
#include "actions.hpp"

#include <adolc/adolc.h>

static void record(const std::string &scene, const column &x)
{
    double S;
    trace_on(1);
    std::vector<adouble> at(x.size());
    for (std::size_t k = 0; k < x.size(); k++)
        at[k] <<= x[k];
    adouble value = objective_of<adouble>(scene, at.data());
    value >>= S;
    trace_off();
}

int main(int argc, char *argv[])
{
    if (argc < 2)
        return 2;
    for (auto &[scene, v] : read_values(argv[1])) {
        int n = int(v.x.size());
        column g(n), h(n);
        record(scene, v.x);
        report("gradient " + scene, "ADOL-C", PEER_VERSION,
               [&] { gradient(1, n, v.x.data(), g.data()); }, v.gradient, g);
        report("product " + scene, "ADOL-C", PEER_VERSION,
               [&] { hess_vec(1, n, v.x.data(), v.u.data(), h.data()); }, v.product, h);
    }
}
