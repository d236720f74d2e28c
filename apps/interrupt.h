/* Ctrl-C: the first asks a long run to stop with what it has, the second ends the process. */
#ifndef APPS_INTERRUPT_H
#define APPS_INTERRUPT_H

#include <stdbool.h>

/* From now on SIGINT and SIGTERM raise the flag; one that comes half a second after the first ends
   the process as usual. */
void interrupt_catch(void);
/* Whether one of them came. */
bool interrupted(void);

#endif
