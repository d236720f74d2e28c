/* What chart_rules.c measures and chart_rules_draw.c draws. */
#ifndef APPS_CHART_RULES_H
#define APPS_CHART_RULES_H

#include "apps/output/plot.h"
#include "physics/physics.h"

enum { RULE_LEVELS = 9, MOST_RULES = 16, N_BOUNDARIES = 3 };

/* Between the ends of a motion that starts where the scene does. */
struct boundary {
    const char *scene, *title;
    double time;
    bool published; /* the span of the paper: its descent is run too */
};

struct rule_point {
    size_t slices;
    double seconds, error;
};

struct rule_curve {
    const struct phys_rule *rule;
    size_t n;
    struct rule_point point[RULE_LEVELS];
};

struct panel {
    const struct boundary *boundary;
    struct phys_system system;
    size_t n;
    struct rule_curve curve[MOST_RULES];
    struct rule_point adam; /* slices 0: none */
};

/* Slope of the last stretch above rounding; NaN if there is none. */
double rule_order(const struct rule_curve *curve);
/* Above errors over slices, below over seconds, a column a panel. */
void rules_draw(const struct panel panels[N_BOUNDARIES], struct plot *plot);

#endif
