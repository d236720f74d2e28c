/* The Jacobian of bundle adjustment by hand, as ADBench's own in C: the entries of each row, in the
   order of columns, row after row. */
#include "adbench.h"

#include <math.h>

enum { CAMERA = 11, ROW = 14 };

/* Rotated p, and its derivatives by r (3 x 3) and by p (3 x 3), row-major. */
static void rotate(const double r[3], const double p[3], double v[3], double by_r[9],
                   double by_p[9])
{
    double angle = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]), c = cos(angle), s = sin(angle);
    double w[3] = {r[0] / angle, r[1] / angle, r[2] / angle};
    double along = w[0] * p[0] + w[1] * p[1] + w[2] * p[2];
    double cross[3] = {w[1] * p[2] - w[2] * p[1], w[2] * p[0] - w[0] * p[2],
                       w[0] * p[1] - w[1] * p[0]};
    double wx[9] = {0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0};
    double px[9] = {0, p[2], -p[1], -p[2], 0, p[0], p[1], -p[0], 0}; /* e_m x p: column m */
    for (int i = 0; i < 3; i++) {
        double by_angle = -s * p[i] + c * cross[i] + s * w[i] * along, by_w[3], radial = 0;
        v[i] = c * p[i] + s * cross[i] + (1 - c) * w[i] * along;
        for (int m = 0; m < 3; m++) {
            by_p[3 * i + m] = (i == m ? c : 0) + s * wx[3 * i + m] + (1 - c) * w[i] * w[m];
            by_w[m] = s * px[3 * i + m] + (1 - c) * ((i == m ? along : 0) + w[i] * p[m]);
            radial += by_w[m] * w[m];
        }
        for (int m = 0; m < 3; m++)
            by_r[3 * i + m] = by_angle * w[m] + (by_w[m] - radial * w[m]) / angle;
    }
}

void adbench_ba_by_hand(const struct problem *p, const size_t size[3], double *value)
{
    const double *seen = p->fixed;
    const size_t cameras = size[0], points = size[1], n = size[2];
    for (size_t k = 0; k < n; k++) {
        const size_t camera = k % cameras, point = (k * 7 + k / cameras) % points;
        double c[CAMERA], from[3], v[3], by_r[9], by_p[9], w = p->at[2][k];
        for (size_t i = 0; i < CAMERA; i++)
            c[i] = p->at[0][i * cameras + camera];
        for (size_t i = 0; i < 3; i++)
            from[i] = p->at[1][i * points + point] - c[3 + i];
        rotate(c, from, v, by_r, by_p);
        double u[2] = {v[0] / v[2], v[1] / v[2]}, rr = u[0] * u[0] + u[1] * u[1];
        double bent = 1 + c[9] * rr + c[10] * rr * rr, slope = 2 * (c[9] + 2 * c[10] * rr);
        for (size_t i = 0; i < 2; i++) {
            double *row = value + (i * n + k) * ROW, by_v[3];
            for (size_t j = 0; j < 2; j++)
                by_v[j] = w * c[6] * ((i == j ? bent : 0) + slope * u[i] * u[j]) / v[2];
            by_v[2] = -(by_v[0] * u[0] + by_v[1] * u[1]);
            for (size_t m = 0; m < 3; m++) {
                row[m] = by_v[0] * by_r[m] + by_v[1] * by_r[3 + m] + by_v[2] * by_r[6 + m];
                row[10 + m] = by_v[0] * by_p[m] + by_v[1] * by_p[3 + m] + by_v[2] * by_p[6 + m];
                row[3 + m] = -row[10 + m];
            }
            row[6] = w * u[i] * bent;
            row[7] = w;
            row[8] = w * c[6] * u[i] * rr;
            row[9] = row[8] * rr;
            row[13] = u[i] * bent * c[6] + c[7 + i] - seen[i * n + k];
        }
        value[2 * n * ROW + k] = -2 * w;
    }
}
