/* xoshiro256** 1.0 (D. Blackman, S. Vigna, ACM Trans. Math. Softw. 47, 2021), seeded by splitmix64
   as its authors advise; normal numbers by Marsaglia's polar method. */
#include "random.h"

#include <math.h>

static uint64_t splitmix64(uint64_t *x)
{
    uint64_t z = *x += 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
}

static uint64_t rotate(uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }

static uint64_t next(uint64_t s[4])
{
    uint64_t result = rotate(s[1] * 5, 7) * 9, t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate(s[3], 45);
    return result;
}

void phys_random_seed(struct phys_random *random, uint64_t seed)
{
    *random = (struct phys_random){0};
    for (int i = 0; i < 4; i++)
        random->state[i] = splitmix64(&seed);
}

double phys_random_uniform(struct phys_random *random)
{
    return (double)(next(random->state) >> 11) * 0x1p-53;
}

double phys_random_normal(struct phys_random *random)
{
    if (random->has_spare) {
        random->has_spare = false;
        return random->spare;
    }
    double a, b, square;
    do {
        a = 2 * phys_random_uniform(random) - 1;
        b = 2 * phys_random_uniform(random) - 1;
        square = a * a + b * b;
    } while (square >= 1 || square == 0);
    double scale = sqrt(-2 * log(square) / square);
    random->spare = b * scale;
    random->has_spare = true;
    return a * scale;
}

double phys_random_unseen(size_t once, size_t n, double *limit)
{
    const double most = (double)once + 1.645 * sqrt((double)once + 0.5) + 1.84; /* 3.0, 4.7, 6.3 */
    *limit = n ? fmin(1, most / (double)n) : 1;
    return n ? (double)once / (double)n : 1;
}
