/* Quoting of text from outside. File names, units, notes of models and attributes of run files may
   contain any byte; none may act as a command. */
#ifndef APPS_QUOTE_H
#define APPS_QUOTE_H

#include <stdio.h>

/* For a terminal: what is not printable (physics/io/utf8.h) as \xNN. */
void quote_terminal(FILE *out, const char *text);
/* The same, on a line of its own, behind `before`. */
void quote_terminal_line(FILE *out, const char *before, const char *text);
/* A word of a command to be copied: in quotes where a shell needs them, printable as above. */
void quote_shell(FILE *out, const char *before, const char *text);
/* For JSON, with its quotes: what is not printable as \uNNNN, bytes that are not UTF-8 as U+FFFD.
 */
void quote_json(FILE *out, const char *text);
/* For CSV, with its quotes; as for a terminal, but line ends and tabs stay. */
void quote_csv(FILE *out, const char *text);
/* Two parts of a name, with quotes where it needs them. */
void quote_csv_name(FILE *out, const char *first, const char *second);

/* For gnuplot, as a double-quoted string in which no character is special. A text is shown without
   markup ("noenhanced"); in a label, which has markup, a power such as m^2 is the only markup that
   counts. Both end with "..." where they are longer than people read. A file name keeps its bytes
   and is never an option, a pipe or a data block; that of `set output` is a format of printf, too.
 */
void quote_gnuplot(FILE *out, const char *text);
void quote_gnuplot_label(FILE *out, const char *text);
void quote_gnuplot_file(FILE *out, const char *name);

/* Both texts in one, to be freed. NULL: out of memory. */
char *text_joined(const char *first, const char *second);

/* "./NAME" for a relative name, to be freed: one that a program does not take for an option, a pipe
   or a file of arguments. NULL: out of memory. */
char *quote_path(const char *name);

#endif
