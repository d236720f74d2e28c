#include "autodiff/version.h"

const char *leastaction_version(void) { return LEASTACTION_VERSION; }
