// Programs of scalars by CppAD:  tape_cppad [operations]  CSV on standard output
#include "tape.hpp"

#include <cppad/cppad.hpp>

struct cppad {
    using real = CppAD::AD<double>;
    CppAD::ADFun<double> f;

    void record(bool is_lu, std::size_t side, const column &x)
    {
        std::vector<real> at(x.begin(), x.end()), y(1);
        CppAD::Independent(at);
        y[0] = is_lu ? lu<real>(side, at) : burgers<real>(side, at);
        f.Dependent(at, y);
    }
    void gradient(const column &x, column &g)
    {
        f.Forward(0, x);
        g = f.Reverse(1, column{1});
    }
};

int main(int argc, char *argv[])
{
    measure<cppad>("CppAD", PEER_VERSION, argc > 1 ? std::atof(argv[1]) : 1e7);
}
