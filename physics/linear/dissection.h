/* Nested dissection of a graph (George, SIAM J. Numer. Anal. 10, 1973): its vertices in two parts
   that no edge joins and a separator, and so on within the parts. Separators are METIS's where
   libmetis.so.5 is installed (Karypis and Kumar, SIAM J. Sci. Comput. 20, 1998), else levels of a
   breadth-first search (George and Liu, 1978). */
#ifndef PHYSICS_LINEAR_DISSECTION_H
#define PHYSICS_LINEAR_DISSECTION_H

#include "pattern.h"

/* Vertices vertex[begin] up to vertex[end - 1], of which the separator is from `separator` on. */
struct phys_dissected {
    size_t begin, separator, end;
    size_t part[2]; /* numbers of the two parts; 0: there are none, and all is separator */
};

struct phys_dissection {
    size_t n, count;
    uint32_t *vertex;            /* [n] */
    struct phys_dissected *part; /* [count]: the whole first */
};

/* Of the graph whose edges are the entries of a pattern. Ends with phys_dissection_free, whatever
   it returned. False: no memory. */
bool phys_dissection_new(struct phys_dissection *dissection, const struct phys_pattern *pattern);
void phys_dissection_free(struct phys_dissection *dissection);

#endif
