/* Which states of a loop are stored. A. Griewank and A. Walther, "Algorithm 799: revolve", ACM
   Trans. Math. Softw. 26 (2000) 19: with s states stored, the first among them, b(s, r) = C(s + r,
   s) steps can be gone back with each step run forward at most r times. Where b(s, r-1) < l <= b(s,
   r), the least work for l steps is reached by storing a state m steps on, for any m with b(s, r-2)
   <= m <= b(s, r-1) and b(s-1, r-1) <= l - m <= b(s-1, r). */
#include "scan.h"

size_t ad_checkpoint_after(size_t l, size_t slots)
{
    const double s = (double)slots + 1, steps = (double)l;
    double b = 1, before = 1; /* b(s, r), b(s, r-1) */
    double r = 0;
    while (b < steps) {
        before = b;
        r++;
        b = b * (s + r) / r;
    }
    /* b(s-1, r-1) = b(s, r-1) s / (s + r-1) */
    double most = before, rest = before * s / (s + r - 1);
    double m = steps - rest < most ? steps - rest : most;
    return m < 1 ? 1 : (size_t)(m + 0.5);
}
