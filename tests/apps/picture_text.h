/* The texts of a picture, read from the SVG that gnuplot writes. */
#ifndef TESTS_APPS_PICTURE_TEXT_H
#define TESTS_APPS_PICTURE_TEXT_H

#include <stddef.h>

/* Fails the test where two texts of the picture overlap or one leaves it; returns the number of
   texts. Widths are those of Helvetica, to a few per cent. */
size_t picture_text_is_apart(const char *file);
/* The same of all SVG files in the work folder (shell.h), if there are any. */
void picture_texts_are_apart(void);
/* How many pairs overlap or texts leave the picture; the first is described in `what`. */
size_t picture_text_faults(const char *svg, char what[400], size_t *texts);

#endif
