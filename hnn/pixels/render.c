/* The exact fraction of a pixel that the rod covers.

   A rod with round ends is three adjacent pieces: a half disc, a rectangle, a half disc. In
   coordinates along and across the rod a pixel is a rotated rectangle; two lines across the rod cut
   it into three convex polygons, each of which meets one piece: the inner one is clipped by the
   rod's two sides, the outer ones meet a complete disc. */
#include "render.h"

#include <math.h>

enum { CORNERS = 8 }; /* each of four cuts adds one at most to a rectangle's four */

struct polygon {
    size_t n;
    struct hnn_point corner[CORNERS];
};

/* The part where a x + b y <= c (I. Sutherland, G. Hodgman, CACM 17, 32, 1974). */
static struct polygon cut(const struct polygon *p, double a, double b, double c)
{
    struct polygon kept = {0};
    for (size_t i = 0; i < p->n; i++) {
        struct hnn_point s = p->corner[i], e = p->corner[(i + 1) % p->n];
        double ds = a * s.x + b * s.y - c, de = a * e.x + b * e.y - c;
        if (ds <= 0)
            kept.corner[kept.n++] = s;
        if ((ds < 0 && de > 0) || (ds > 0 && de < 0)) {
            double t = ds / (ds - de);
            kept.corner[kept.n++] =
                (struct hnn_point){s.x + t * (e.x - s.x), s.y + t * (e.y - s.y)};
        }
    }
    return kept;
}

static double cross(struct hnn_point a, struct hnn_point b) { return a.x * b.y - a.y * b.x; }

static double polygon_area(const struct polygon *p)
{
    double twice = 0;
    for (size_t i = 0; i < p->n; i++)
        twice += cross(p->corner[i], p->corner[(i + 1) % p->n]);
    return twice / 2;
}

static double angle_between(struct hnn_point a, struct hnn_point b)
{
    return atan2(cross(a, b), a.x * b.x + a.y * b.y);
}

/* Twice the signed area of the disc about the origin within the triangle (0, a, b): a triangle over
   the part of ab inside the circle, and sectors before and behind it. Each of these spans less
   than a right angle, so that an edge through the centre does no harm. */
static double twice_in_disc(struct hnn_point a, struct hnn_point b, double r)
{
    struct hnn_point d = {b.x - a.x, b.y - a.y};
    double dd = d.x * d.x + d.y * d.y, ad = a.x * d.x + a.y * d.y;
    double root = ad * ad - dd * (a.x * a.x + a.y * a.y - r * r);
    double from = root > 0 ? fmax(0, (-ad - sqrt(root)) / dd) : 1;
    double to = root > 0 ? fmin(1, (-ad + sqrt(root)) / dd) : 0;
    if (from >= to)
        return r * r * angle_between(a, b);
    struct hnn_point in = {a.x + from * d.x, a.y + from * d.y};
    struct hnn_point out = b; /* exactly: close to the centre rounding would turn it */
    if (to < 1)
        out = (struct hnn_point){a.x + to * d.x, a.y + to * d.y};
    return r * r * (angle_between(a, in) + angle_between(out, b)) + cross(in, out);
}

/* Area of a polygon within a disc, as the sum over its edges seen from the centre. */
static double disc_area(const struct polygon *p, double x, double y, double r)
{
    double twice = 0;
    for (size_t i = 0; i < p->n; i++) {
        struct hnn_point a = p->corner[i], b = p->corner[(i + 1) % p->n];
        a.x -= x, a.y -= y, b.x -= x, b.y -= y;
        twice += twice_in_disc(a, b, r);
    }
    return twice / 2;
}

/* Area of a pixel under the rod, axle and all, in coordinates along (x) and across (y) the rod,
   from the pivot. */
static double rod_area(const struct hnn_rod *rod, const struct polygon *pixel)
{
    struct polygon before = cut(pixel, 1, 0, 0), behind = cut(pixel, -1, 0, -rod->length);
    struct polygon beside = cut(pixel, -1, 0, 0);
    beside = cut(&beside, 1, 0, rod->length);
    beside = cut(&beside, 0, 1, rod->radius);
    beside = cut(&beside, 0, -1, rod->radius);
    return polygon_area(&beside) + disc_area(&before, 0, 0, rod->radius) +
           disc_area(&behind, rod->length, 0, rod->radius);
}

/* Distance of a point from the rod's middle line. */
static double distance(const struct hnn_rod *rod, struct hnn_point p)
{
    const double x = p.x - fmin(fmax(p.x, 0), rod->length);
    return sqrt(x * x + p.y * p.y);
}

static struct hnn_point turned(const struct hnn_drawing *d, double x, double y)
{
    return (struct hnn_point){x * d->along.x + y * d->along.y, y * d->along.x - x * d->along.y};
}

struct hnn_drawing hnn_drawing_of(const struct hnn_rod *rod, double angle, size_t height,
                                  size_t width)
{
    const double half_x = (rod->right - rod->left) / (2 * (double)width);
    const double half_y = (rod->top - rod->bottom) / (2 * (double)height);
    struct hnn_drawing d = {.rod = rod, .along = {sin(angle), -cos(angle)}};
    d.first = (struct hnn_point){rod->left + half_x, rod->top - half_y};
    d.step = (struct hnn_point){2 * half_x, 2 * half_y};
    d.half_width = turned(&d, half_x, 0);
    d.half_height = turned(&d, 0, half_y);
    d.reach = hypot(half_x, half_y);
    return d;
}

/* Most pixels are far from the rod's edge. */
double hnn_drawing_coverage(const struct hnn_drawing *d, size_t i, size_t j)
{
    const struct hnn_rod *rod = d->rod;
    const struct hnn_point w = d->half_width, h = d->half_height;
    const struct hnn_point m =
        turned(d, d->first.x + (double)j * d->step.x, d->first.y - (double)i * d->step.y);
    const double away = distance(rod, m);
    if (away - d->reach >= rod->radius)
        return 0;
    const bool axle = hypot(m.x, m.y) - d->reach < rod->axle;
    if (away + d->reach <= rod->radius && !axle)
        return 1;
    struct polygon pixel = {4,
                            {{m.x - w.x - h.x, m.y - w.y - h.y},
                             {m.x + w.x - h.x, m.y + w.y - h.y},
                             {m.x + w.x + h.x, m.y + w.y + h.y},
                             {m.x - w.x + h.x, m.y - w.y + h.y}}};
    double area = rod_area(rod, &pixel) - (axle ? disc_area(&pixel, 0, 0, rod->axle) : 0);
    return fmin(fmax(area / polygon_area(&pixel), 0), 1);
}
