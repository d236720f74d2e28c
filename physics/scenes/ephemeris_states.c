/* State vectors at 2022-Jul-14 00:00 TDB (ephemeris.h). The digits are those printed by
   Horizons, in km and km/s; KM converts to SI with the same single rounding as the reader of
   tables. */
#include "ephemeris.h"

#define KM 1e3

const struct ephemeris_body phys_ephemeris_bodies[PHYS_EPHEMERIS_BODIES] = {
    {.name = "sun",
     .id = 10,
     .gm = 132712440041.93938e9,
     .published_mass = 1.99e30,
     .position = {-1.351726041276557E+06 * KM, 2.462102851293260E+05 * KM,
                  2.951105537484762E+04 * KM},
     .velocity = {-2.034205734889688E-03 * KM, -1.573882610814763E-02 * KM,
                  1.659179881591697E-04 * KM}},
    {.name = "mercury",
     .id = 199,
     .gm = 22031.86855e9,
     .published_mass = 3.3e23,
     .position = {-6.819347861505019E+06 * KM, 4.618319242507705E+07 * KM,
                  4.284976522918230E+06 * KM},
     .velocity = {-5.814575461097006E+01 * KM, -4.002790320353201E+00 * KM,
                  5.007669558963743E+00 * KM}},
    {.name = "venus",
     .id = 299,
     .gm = 324858.592e9,
     .published_mass = 4.87e24,
     .position = {7.375717913448443E+07 * KM, 7.798530196298192E+07 * KM,
                  -3.237239463507764E+06 * KM},
     .velocity = {-2.529542521514409E+01 * KM, 2.416944455572963E+01 * KM,
                  1.791672237777401E+00 * KM}},
    {.name = "earth",
     .id = 399,
     .gm = 398600.435436e9,
     .published_mass = 5.97e24,
     .position = {5.379184128556358E+07 * KM, -1.414690829485953E+08 * KM,
                  3.669156366088986E+04 * KM},
     .velocity = {2.726224652787181E+01 * KM, 1.066834351473718E+01 * KM,
                  1.866902838409956E-05 * KM}},
    {.name = "mars",
     .id = 499,
     .gm = 42828.375214e9,
     .published_mass = 6.42e23,
     .position = {2.028839135507045E+08 * KM, -3.410802740813480E+07 * KM,
                  -5.700325453727802E+06 * KM},
     .velocity = {4.943041693545463E+00 * KM, 2.595133113812033E+01 * KM,
                  4.230859822894484E-01 * KM}},
};
