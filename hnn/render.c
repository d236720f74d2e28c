/* Drawing the rod: every pixel is the exact area of its part that is covered.

   A rod with round ends is three pieces side by side: a half disc, a rectangle, a half disc. In
   coordinates along and across the rod a pixel is a rotated rectangle; cut by two lines across the
   rod it falls into three convex polygons, and each of them meets one piece alone: the inner one
   is cut by the rod's two sides, the outer ones meet a whole disc. */
#include "pixels.h"

#include <math.h>

enum { CORNERS = 8 }; /* each of four cuts adds one at most to a rectangle's four */

struct point {
    double x, y;
};

struct polygon {
    size_t n;
    struct point corner[CORNERS];
};

/* The part where a x + b y <= c (I. Sutherland, G. Hodgman, CACM 17, 32, 1974). */
static struct polygon cut(const struct polygon *p, double a, double b, double c)
{
    struct polygon kept = {0};
    for (size_t i = 0; i < p->n; i++) {
        struct point s = p->corner[i], e = p->corner[(i + 1) % p->n];
        double ds = a * s.x + b * s.y - c, de = a * e.x + b * e.y - c;
        if (ds <= 0)
            kept.corner[kept.n++] = s;
        if ((ds < 0 && de > 0) || (ds > 0 && de < 0)) {
            double t = ds / (ds - de);
            kept.corner[kept.n++] = (struct point){s.x + t * (e.x - s.x), s.y + t * (e.y - s.y)};
        }
    }
    return kept;
}

static double cross(struct point a, struct point b) { return a.x * b.y - a.y * b.x; }

static double polygon_area(const struct polygon *p)
{
    double twice = 0;
    for (size_t i = 0; i < p->n; i++)
        twice += cross(p->corner[i], p->corner[(i + 1) % p->n]);
    return twice / 2;
}

static double angle_between(struct point a, struct point b)
{
    return atan2(cross(a, b), a.x * b.x + a.y * b.y);
}

/* Twice the signed area of the disc about the origin within the triangle (0, a, b): a triangle over
   the part of ab inside the circle, and sectors before and behind it. Each of these spans less
   than a right angle, so that an edge through the centre does no harm. */
static double twice_in_disc(struct point a, struct point b, double r)
{
    struct point d = {b.x - a.x, b.y - a.y};
    double dd = d.x * d.x + d.y * d.y, ad = a.x * d.x + a.y * d.y;
    double root = ad * ad - dd * (a.x * a.x + a.y * a.y - r * r);
    double from = root > 0 ? fmax(0, (-ad - sqrt(root)) / dd) : 1;
    double to = root > 0 ? fmin(1, (-ad + sqrt(root)) / dd) : 0;
    if (from >= to)
        return r * r * angle_between(a, b);
    struct point in = {a.x + from * d.x, a.y + from * d.y};
    struct point out = b; /* exactly: close to the centre rounding would turn it */
    if (to < 1)
        out = (struct point){a.x + to * d.x, a.y + to * d.y};
    return r * r * (angle_between(a, in) + angle_between(out, b)) + cross(in, out);
}

/* Area of a polygon within a disc, as the sum over its edges seen from the centre. */
static double disc_area(const struct polygon *p, double x, double y, double r)
{
    double twice = 0;
    for (size_t i = 0; i < p->n; i++) {
        struct point a = p->corner[i], b = p->corner[(i + 1) % p->n];
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
static double distance(const struct hnn_rod *rod, struct point p)
{
    const double x = p.x - fmin(fmax(p.x, 0), rod->length);
    return sqrt(x * x + p.y * p.y);
}

/* How a rod lies in a frame. */
struct drawing {
    const struct hnn_rod *rod;
    struct point along;      /* unit vector; across it is (-along.y, along.x) */
    struct point half_width; /* of a pixel, to the right, in coordinates along and across */
    struct point half_height;
    double reach; /* from a pixel's middle to its corners */
};

static struct point turned(const struct drawing *d, double x, double y)
{
    return (struct point){x * d->along.x + y * d->along.y, y * d->along.x - x * d->along.y};
}

/* The covered part of the pixel whose middle is m. Most pixels are far from the rod's edge. */
static double coverage(const struct drawing *d, struct point m)
{
    const struct hnn_rod *rod = d->rod;
    const struct point w = d->half_width, h = d->half_height;
    const double away = distance(rod, m);
    const bool axle = hypot(m.x, m.y) - d->reach < rod->axle;
    if (away - d->reach >= rod->radius)
        return 0;
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

void hnn_rod_draw(const struct hnn_rod *rod, double angle, size_t height, size_t width,
                  float *pixels)
{
    const double half_x = (rod->right - rod->left) / (2 * (double)width);
    const double half_y = (rod->top - rod->bottom) / (2 * (double)height);
    struct drawing d = {.rod = rod, .along = {sin(angle), -cos(angle)}};
    d.half_width = turned(&d, half_x, 0);
    d.half_height = turned(&d, 0, half_y);
    d.reach = hypot(half_x, half_y);
    for (size_t i = 0; i < height; i++)
        for (size_t j = 0; j < width; j++) {
            double x = rod->left + (2 * (double)j + 1) * half_x;
            double y = rod->top - (2 * (double)i + 1) * half_y;
            pixels[i * width + j] = (float)(rod->shade * coverage(&d, turned(&d, x, y)));
        }
}
