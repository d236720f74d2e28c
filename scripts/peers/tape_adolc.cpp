// Programs of scalars by ADOL-C:  tape_adolc [operations]  CSV on standard output
#include "tape.hpp"

#include <adolc/adolc.h>

struct adolc {
    void record(bool is_lu, std::size_t side, const column &x)
    {
        trace_on(1);
        std::vector<adouble> at(x.size());
        for (std::size_t k = 0; k < x.size(); k++)
            at[k] <<= x[k];
        double value;
        adouble y = is_lu ? lu<adouble>(side, at) : burgers<adouble>(side, at);
        y >>= value;
        trace_off();
    }
    void gradient(const column &x, column &g) { ::gradient(1, int(x.size()), x.data(), g.data()); }
};

int main(int argc, char *argv[])
{
    measure<adolc>("ADOL-C", PEER_VERSION, argc > 1 ? std::atof(argv[1]) : 1e7);
}
