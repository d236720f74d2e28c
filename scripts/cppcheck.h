/* Included first by cppcheck: see autodiff/autodiff.h. */
#define __cppcheck__ 1
