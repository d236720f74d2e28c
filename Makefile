# leastaction. `make help` lists the targets. Objects go to $(BUILD); nothing else is written.
#
#   make CC=clang CFLAGS='-O2 -g' BUILD=build-clang V=1      variables
#   make O1=1 BUILD=build-o1                                 scalar kernels at -O1: the oracle
#   make WERROR=1 SAN=1                                      warnings are errors; ASan and UBSan

BUILD  ?= build
PREFIX ?= /usr/local
# below PREFIX
LIBDIR ?= lib
CFLAGS ?= -O2 -g
PYTHON ?= python3
VERSION := $(shell sed -n 's/.*LEASTACTION_VERSION "\(.*\)"/\1/p' autodiff/version.h 2>/dev/null)

ifeq ($(origin CC),default)
CC = gcc
endif
Q = $(if $(V),,@)
say = $(if $(V),@:,@printf '  %-5s %s\n' $(1) $(2))

MACHINE := $(shell $(CC) -dumpmachine 2>/dev/null)
CLANG   := $(findstring clang,$(shell $(CC) --version 2>/dev/null))
X86     := $(filter x86_64%,$(MACHINE))
# The target of the compiler with its flags: pointer8, and libc with or without glibc.
TARGET  := $(shell { $(CC) $(CFLAGS) -E -dM -x c /dev/null; \
             printf '\043include <limits.h>\n' | $(CC) $(CFLAGS) -E -dM -x c -; } 2>/dev/null | \
             sed -n 's/.define __SIZEOF_POINTER__ /pointer/p; s/.define CHAR_BIT .*/libc/p; s/.define __GLIBC__ .*/glibc/p')
ISAS    := base $(if $(X86),avx2 avx512)

# ---- flags ----

WARN = -Wall -Wextra -Wpedantic -Wshadow -Wstrict-prototypes -Wconversion $(if $(WERROR),-Werror)
# No -ffast-math: these two only promise that nobody reads errno or the exception flags, which is
# what vector loops need. clang finds glibc's vector functions by -fveclib, gcc by declarations.
MATH = -fno-math-errno -fno-trapping-math $(if $(CLANG),$(if $(X86),-fveclib=libmvec))
ifdef SAN
# With clang the objects are instrumented for the fuzzers, except the tape and the rooms of numbers, which read
# no files and whose loops would take up to twice as long. They are optimized, without UBSan's checks of pointers,
# whose accesses ASan checks already: that halves their time. Tests are compiled quickly.
SANITIZE = -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer $(SAN_ROOM)
COVERED = $(if $(CLANG),-fsanitize=fuzzer-no-link)
SAN_ROOM = $(COVERED)
NUMBERS = autodiff quantum $(addprefix physics/,action gas integrators lagrangian linear modes motion ode path stability)
$(foreach d,$(NUMBERS),$(BUILD)/$d/%.o): SAN_ROOM = -O2 -fno-sanitize=pointer-overflow,null,alignment,object-size
$(BUILD)/tests/%.o: SAN_ROOM = -O0
$(BUILD)/tests/fuzz/%.o: SAN_ROOM = $(COVERED)
endif
# The serial HDF5, where Debian has it beside parallel ones.
PACKAGES   := $(shell pkg-config --exists hdf5-serial && echo hdf5-serial || echo hdf5) openblas lapacke libpng zlib
PKG_CFLAGS := $(patsubst -I%,-isystem %,$(filter-out -I/usr/include/$(MACHINE),$(shell pkg-config --cflags $(PACKAGES) 2>/dev/null)))
PKG_LIBS   := $(shell pkg-config --libs $(PACKAGES) 2>/dev/null)
ALL_CFLAGS = -std=c11 -D_XOPEN_SOURCE=700 -I. -I$(BUILD) $(PKG_CFLAGS) $(WARN) -fPIC -fopenmp $(MATH) \
             $(if $(X86),,-DAD_ONLY_BASE) $(CFLAGS) $(SANITIZE)
# HDF5 and OpenBLAS are loaded on first use (autodiff/lazy.h): only tests that call them link them.
LIBS = -Wl,--as-needed $(PKG_LIBS) -lm -ldl

# Vector code: one source compiled for each element type and instruction set, chosen at run time.
SIMD = $(if $(O1),-O1 -fno-openmp -fno-tree-vectorize -Wno-unknown-pragmas,-O3) \
       $(if $(CLANG),-Wno-pass-failed)
ISA_base   =
ISA_avx2   = -mavx2 -mfma
ISA_avx512 = -mavx512f -mavx512dq -mavx512vl -mavx512bw -mavx2 -mfma -mprefer-vector-width=512

# ---- what is built ----

KERNELS := $(wildcard autodiff/kernels/kernels.c)
SWEEPS  := $(wildcard autodiff/direct/sweeps.c)
# The libraries, each after those it uses: ROOMS=autodiff builds what its tests need.
ROOMS   := autodiff physics hnn quantum
LIB_SRC := $(filter-out $(KERNELS) $(SWEEPS),$(wildcard $(foreach d,$(ROOMS),$d/*.c $d/*/*.c $d/*/*/*.c)))
LIB_OBJ := $(LIB_SRC:%.c=$(BUILD)/%.o) \
           $(if $(KERNELS),$(foreach t,f32 f64,$(foreach i,$(ISAS),$(BUILD)/autodiff/kernels/$(t)_$(i).o))) \
           $(if $(SWEEPS),$(foreach t,f32 f64,$(BUILD)/autodiff/direct/sweeps_$(t).o))
HAND    := $(wildcard $(foreach f,kernels hnn forces,apps/bench/hand/hand_$f.c))
APP_SRC := $(filter-out $(HAND) apps/ranks/mpi.c,$(wildcard apps/*.c apps/*/*.c apps/*/*/*.c))
APP_OBJ := $(filter-out $(BUILD)/apps/main.o,$(APP_SRC:%.c=$(BUILD)/%.o)) \
           $(foreach f,$(HAND:%.c=$(BUILD)/%),$(foreach i,$(ISAS),$(f)_$(i).o))
TEST_DIRS ?= $(wildcard tests/*)
TEST_SRC := $(wildcard $(foreach d,$(TEST_DIRS),$d/test_*.c $d/*/test_*.c))
TESTS    := $(TEST_SRC:%.c=$(BUILD)/%)
LONG     := $(addprefix $(BUILD)/tests/,autodiff/native/test_native_fuzz autodiff/native/test_native_structures \
              autodiff/native/test_native_loops autodiff/programs/test_random_programs \
              apps/bench/test_charts apps/bench/test_chart_motions apps/path/test_path_steep \
              physics/path/test_path_all_kepler physics/path/test_path_all_lambert physics/path/test_path_covering stability/test_networks \
              contract/test_stored_reports)
FUZZERS  := $(patsubst %.c,$(BUILD)/%,$(wildcard tests/fuzz/fuzz_*.c))
HELP_OBJ := $(patsubst %.c,$(BUILD)/%.o,$(filter-out $(wildcard tests/*/test_*.c tests/*/*/test_*.c tests/fuzz/*.c \
              tests/apps/scenes/*.c tests/abi/*.c),$(wildcard tests/*.c tests/*/*.c tests/*/*/*.c)))
FUZZ_SECONDS ?= 10
# 0: another one each time
FUZZ_SEED ?= 0
KILLS ?= 200
PUBLIC   := $(wildcard autodiff/autodiff.h autodiff/status.h autodiff/version.h autodiff/tape.h autodiff/operations.h \
              autodiff/program.h autodiff/derivatives.h autodiff/series.h autodiff/ops.def autodiff/optim.h autodiff/lbfgs.h autodiff/ranks.h \
              physics/physics.h physics/system/system.h physics/io/names.h \
              physics/lagrangian/check.h physics/lagrangian/conserved.h physics/lagrangian/euler_lagrange.h \
              physics/action/action.h physics/path/path.h physics/path/ranks/path_ranks.h physics/ephemeris/ephemeris.h \
              physics/ephemeris/horizons.h physics/ephemeris/models.h physics/lagrangian/legendre.h \
              physics/ode/ode.h physics/integrators/integrators.h physics/motion/checks.h \
              physics/motion/motion.h physics/motion/solve.h physics/motion/ensemble.h physics/gas/order.h \
              physics/stability/stability.h physics/stability/periodic.h physics/stability/family.h \
              physics/fit/fit.h physics/modes/modes.h physics/stability/diagnostics.h hnn/hnn.h \
              hnn/model.h hnn/trainer.h hnn/data/data.h hnn/pixels/latent.h \
              hnn/pixels/pixels.h hnn/pixels/pixel_energy.h hnn/rollout/rollout.h quantum/quantum.h \
              quantum/run.h quantum/slit.h quantum/published.h)

# Raised whenever a program compiled before could fail (docs/compatibility.md, scripts/abi).
SOVERSION = 4

A  = $(BUILD)/libleastaction.a
SO = $(BUILD)/libleastaction.so
# With MPI=1 there is a module beside the command, by what mpicc says, for runs on many ranks.
MPICC ?= mpicc
COMMAND = $(if $(wildcard apps/main.c),$(BUILD)/$(if $(MPI),ranks/$(MPICC)/)leastaction)

.PHONY: all build-tests objects test test-long check demo deb abi abi-headers charts docs-pictures peers hnn-table bench adbench lint format sanitize test-o1 fuzz-native coverage matrix mutants torture test-ranks ranks-speed faults tsan test-page run-threaded recipes fuzz run-fuzzers $(FUZZERS:%=%.run) install uninstall clean help FORCE
.DELETE_ON_ERROR:
.SECONDARY:

all: $(A) $(SO) $(COMMAND) $(if $(filter build,$(BUILD)),$(if $(COMMAND),leastaction))

help:
	@echo 'make [TARGET] [BUILD=build] [CC=gcc] [CFLAGS=...] [PREFIX=/usr/local] [DESTDIR=] [V=1]'
	@echo
	@echo '  all        library (.a, .so) and the command ./leastaction'
	@echo '             MPI=1: and its module for many ranks, by mpirun; MPICC=mpicc'
	@echo '  test       install missing packages, build, run all tests but those of test-long'
	@echo '  test-long  many random programs, each operation on every back end, charts, searches, trainings, stored reports'
	@echo '  check      build and run all tests; TEST_DIRS=tests/autodiff: those of a folder'
	@echo '  demo       install, build, one result of each front end, pictures in demo/'
	@echo '  charts     speed against accuracy, in charts/ (QUICK=1: a smaller range; HORIZONS=DIR: tables)'
	@echo '  docs-pictures  draw the pictures of README.md again'
	@echo '  hnn-table  train the published Hamiltonian neural networks: published and our results (PIXELS=3: also from frames; LNN=3: also Lagrangian ones, SYMPNET=3: symplectic maps)'
	@echo '  peers      the same jobs in SciPy, PyTorch, JAX, where installed (PYTHON=python3)'
	@echo '  bench      gradients by the tape against hand-written C; fails if slower than the stored baseline'
	@echo '  adbench    Microsoft'"'"'s ADBench on the tape: gradient beside value, each against stored values'
	@echo '  abi        the shared library beside the first of its soname (libabigail, and a program compiled then)'
	@echo '  lint       warnings as errors (gcc, clang), cppcheck, format, exported names, dependencies between folders'
	@echo '  format     clang-format all files'
	@echo '  sanitize   all tests under ASan and UBSan, each parser under libFuzzer for 2 s (clang)'
	@echo '  test-o1    tests of the tape with scalar kernels at -O1, the oracle'
	@echo '  fuzz-native  PROGRAMS=1000 random programs from SEED=1 on: machine code (gcc, clang), interpreter, kernels at -O1'
	@echo '  test-page  pages of runs in a headless Chromium, where one is installed'
	@echo '  coverage   line coverage by gcov: each folder, and files under 90 %'
	@echo '  matrix     the runs of docs/accuracy.md, by gcc and clang, -O0 to -O3, with and without AVX, 1 and 2 threads'
	@echo '  mutants    tests must fail for each flipped sign in a gradient rule; LINES=60: for random changed lines'
	@echo '  torture    kill runs at random moments: files stay intact, training resumes'
	@echo '  test-ranks the command on 1 to 4 ranks, by each MPI installed; KILLS=6 of ranks'
	@echo '  ranks-speed  training and ensembles on two ranks beside one (SAMPLES=1000000 RUNS=3)'
	@echo '  recipes    follow docs/recipes.md in copies of the tree and its build (minutes)'
	@echo '  faults     fail each file call and each allocation of a run, for each subcommand'
	@echo '  tsan       multithreaded tests under the thread sanitizer (clang)'
	@echo '  fuzz       each parser under libFuzzer (clang), FUZZ_SECONDS=10 each; check runs the corpus'
	@echo '  deb        Debian packages by dpkg-buildpackage, in BUILD/deb, and what lintian says (scripts/debian)'
	@echo '  install uninstall clean'

# ---- compile ----

# Rewritten when the flags change, so that a change of flags rebuilds.
$(BUILD)/flags: FORCE
	@$(if $(filter pointer4,$(TARGET)),echo 'a 64-bit target is needed: pointers of $(CC) $(CFLAGS) have 32 bits' >&2; exit 1)
	@$(if $(filter libc,$(TARGET)),$(if $(filter glibc,$(TARGET)),,echo 'glibc is needed, as by HDF5 and OpenBLAS: $(CC) compiles for another C library' >&2; exit 1))
	@$(if $(PKG_LIBS),,echo 'libraries, or pkg-config, are missing: scripts/install-deps installs them' >&2; exit 1)
	@mkdir -p $(@D)
	@echo '$(CC) $(ALL_CFLAGS) $(SIMD) $(LDFLAGS)' | cmp -s - $@ || echo '$(CC) $(ALL_CFLAGS) $(SIMD) $(LDFLAGS)' > $@

# Sonames of the libraries of lazy.h.
$(BUILD)/libraries.h: $(BUILD)/flags
	@$(CC) -shared -x c /dev/null -Wl,--no-as-needed $(PKG_LIBS) -o $@.so
	@readelf -d $@.so | sed -nE 's/.*NEEDED.*\[lib(hdf5|openblas)(.*)\]/#define AD_LIBRARY_\1 "lib\1\2"/p' > $@

LAZY := tests/physics/test_linear tests/apps/shell autodiff/blas autodiff/lazy physics/linear/linear $(basename $(wildcard physics/io/hdf5_*.c))
$(LAZY:%=$(BUILD)/%.o): $(BUILD)/libraries.h

# The template of pages as the elements of an array.
$(BUILD)/apps/output/page.html.inc: apps/output/page.html
	@mkdir -p $(@D)
	@{ od -An -v -tu1 $< | sed 's/  */,/g; s/^,//; s/$$/,/'; echo 0; } > $@
$(BUILD)/apps/output/page.o: $(BUILD)/apps/output/page.html.inc

compile = $(CC) $(ALL_CFLAGS) -MMD -MP -c $< -o $@

# With OBJECTS=FOLDER only kernels are compiled; the other objects are those of that build.
ifdef OBJECTS
$(BUILD)/%.o: $(OBJECTS)/%.o
	@mkdir -p $(@D)
	@ln -f $< $@
else
$(BUILD)/%.o: %.c $(BUILD)/flags
	$(call say,CC,$<)
	@mkdir -p $(@D)
	$(Q)$(compile)
endif

# $(1) f32 or f64, $(2) instruction set
define kernel_rule
$(BUILD)/autodiff/kernels/$(1)_$(2).o: autodiff/kernels/kernels.c $(BUILD)/flags
	$$(call say,CC,'$$< ($(1), $(2))')
	@mkdir -p $$(@D)
	$(Q)$$(compile) $$(SIMD) $$(ISA_$(2)) -DAD_KERNEL_$(subst f,F,$(1)) -DAD_KERNEL_ISA=$(2)
endef
# $(1) f32 or f64
define sweep_rule
$(BUILD)/autodiff/direct/sweeps_$(1).o: autodiff/direct/sweeps.c $(BUILD)/flags
	$$(call say,CC,'$$< ($(1))')
	@mkdir -p $$(@D)
	$(Q)$$(compile) -DAD_DIRECT_$(subst f,F,$(1))
endef
# $(1) a file written by hand, without .c
define hand_rule
$(BUILD)/$(1)_$(2).o: $(1).c $(BUILD)/flags
	$$(call say,CC,'$$< ($(2))')
	@mkdir -p $$(@D)
	$(Q)$$(compile) $$(SIMD) $$(ISA_$(2)) -ffp-contract=fast -DHAND_ISA=$(2)
endef
$(foreach t,f32 f64,$(foreach i,$(ISAS),$(eval $(call kernel_rule,$(t),$(i)))))
$(foreach t,f32 f64,$(eval $(call sweep_rule,$(t))))
$(foreach f,$(HAND:%.c=%),$(foreach i,$(ISAS),$(eval $(call hand_rule,$(f),$(i)))))

ifneq ($(MAKECMDGOALS),test) # which leaves the building to a second make
-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)
endif

# ---- link ----

archive = rm -f $@ && $(AR) qcs $@ $(filter %.o,$^)

$(A): $(LIB_OBJ)
	$(call say,AR,$@)
	$(Q)$(archive)

# The version script hides what no public header names.
$(BUILD)/leastaction.map: $(PUBLIC)
	@mkdir -p $(@D)
	$(Q){ echo '{ global:'; cat $(PUBLIC) | tr '\n' ' ' | sed 's:/\*[^*]*\*\+\([^/*][^*]*\*\+\)*/::g' | \
	    grep -oE '\b(ad|phys|hnn|qm|leastaction)_[A-Za-z0-9_]+' | sort -u | sed 's/$$/;/'; echo 'local: *; };'; } > $@

$(SO): $(LIB_OBJ) $(BUILD)/leastaction.map
	$(call say,LD,$@)
	$(Q)$(CC) $(ALL_CFLAGS) $(LDFLAGS) -shared -Wl,-soname,libleastaction.so.$(SOVERSION),-z,nodelete \
	    -Wl,--version-script=$(BUILD)/leastaction.map $(filter %.o,$^) $(LIBS) -o $@

$(BUILD)/apps.a: $(APP_OBJ)
	$(call say,AR,$@)
	$(Q)$(archive)

$(BUILD)/tests/helpers.a: $(HELP_OBJ)
	@mkdir -p $(@D)
	$(Q)$(archive)

# The command links the whole library and exports its names, for scenes in shared objects.
$(BUILD)/leastaction: $(BUILD)/apps/main.o $(BUILD)/apps.a $(A)
	$(call say,LD,$@)
	$(Q)$(CC) $(ALL_CFLAGS) $(LDFLAGS) -rdynamic $< $(BUILD)/apps.a \
	    -Wl,--whole-archive $(A) -Wl,--no-whole-archive $(LIBS) -o $@

mpi_flags = $(filter $(1),$(shell $(MPICC) -show))
mpi_hdf5 = $(shell pkg-config --libs hdf5-$(if $(findstring mpich,$(shell $(MPICC) -show)),mpich,openmpi) 2>/dev/null)
# The soname of parallel HDF5, where there is one.
$(BUILD)/ranks/$(MPICC)/hdf5.h: $(BUILD)/flags
	@mkdir -p $(@D)
	@$(if $(call mpi_flags,-l%),,echo 'MPI is missing, or its compiler $(MPICC): scripts/install-deps mpi installs it' >&2; exit 1)
	@$(MPICC) -shared -x c /dev/null -Wl,--no-as-needed $(mpi_hdf5) -o $@.so
	@readelf -d $@.so | sed -nE 's/.*NEEDED.*\[(libhdf5.*)\]/#define RANKS_HDF5 "\1"/p' > $@
$(BUILD)/ranks/$(MPICC)/mpi.so: apps/ranks/mpi.c $(BUILD)/ranks/$(MPICC)/hdf5.h
	$(call say,LD,$@)
	$(Q)$(CC) $(ALL_CFLAGS) $(LDFLAGS) -MMD -MP -include $(@D)/hdf5.h $(patsubst -I%,-isystem %,$(call mpi_flags,-I%)) \
	    -shared $< $(call mpi_flags,-L% -l%) -o $@
$(BUILD)/ranks/$(MPICC)/leastaction: $(BUILD)/leastaction $(BUILD)/ranks/$(MPICC)/mpi.so
	@ln -f $< $@

leastaction: $(COMMAND)
	@ln -sf $< $@

# Tests named test_alloc* replace these functions (tests/alloc.c).
wrap_alloc = $(if $(findstring /test_alloc,$@),$(foreach f,malloc calloc realloc aligned_alloc strdup strndup free,-Wl,--wrap=$(f)))

# Tests in which calls between files that may fail are looked at (tests/contract/calls.h).
CALLS = $(BUILD)/tests/contract/wrapped
$(CALLS).c: tests/contract/calls.awk $(filter %.h,$(shell find $(wildcard autodiff physics hnn quantum apps) -name '*.h'))
	@mkdir -p $(@D)
	$(Q)awk -f $^ > $@
$(CALLS).o: $(CALLS).c $(BUILD)/flags
	$(Q)$(compile)
$(CALLS).ld: $(CALLS).c
	$(Q)sed -n 's/.* __wrap_\(.*\)(.*);$$/-Wl,--wrap=\1/p' $< > $@
WATCHED = $(addprefix $(BUILD)/tests/,contract/test_failing_calls apps/test_errors physics/test_forces \
            physics/motion/test_solve_forced physics/motion/test_ensemble_errors)
$(WATCHED): $(CALLS).o $(CALLS).ld $(BUILD)/apps.a
wrap_calls = $(if $(filter $@,$(WATCHED)),@$(CALLS).ld)

# Tests link statically, so that they reach internals; exported names are for scenes loaded in tests.
$(TESTS): $(BUILD)/%: $(BUILD)/%.o $(BUILD)/tests/helpers.a $(A)
	$(call say,LD,$@)
	$(Q)$(CC) $(ALL_CFLAGS) $(LDFLAGS) -rdynamic $(wrap_alloc) $(wrap_calls) $(filter %.o,$^) $(BUILD)/tests/helpers.a \
	    $(filter %/apps.a,$^) $(A) $(LIBS) -lcmocka -o $@
$(filter-out $(BUILD)/tests/autodiff/% $(BUILD)/tests/physics/%,$(TESTS)): $(BUILD)/apps.a

# Each fuzzer is a function with a name of its own: of one test, or the target of libFuzzer.
$(BUILD)/tests/fuzz/test_corpus: $(FUZZERS:%=%.o)
$(FUZZERS): $(BUILD)/%: $(BUILD)/%.o $(BUILD)/apps.a $(A)
	$(call say,LD,$@)
	$(Q)$(CC) $(ALL_CFLAGS) $(LDFLAGS) -fsanitize=fuzzer -Wl,--defsym=LLVMFuzzerTestOneInput=$(@F) \
	    $< $(BUILD)/apps.a $(A) $(LIBS) -o $@

build-tests: $(TESTS)

# Every file compiled, nothing linked.
objects: $(LIB_OBJ) $(APP_OBJ) $(BUILD)/apps/main.o $(TESTS:%=%.o) $(HELP_OBJ) $(FUZZERS:%=%.o)

# ---- run ----

# Packages are installed before a second make, which then finds compiler and libraries.
test:
	@scripts/install-deps
	@scripts/install-deps --optional python3-h5py locales
	@$(MAKE) --no-print-directory check TESTS='$(filter-out $(LONG),$(TESTS))'

test-long:
	@$(MAKE) --no-print-directory check TESTS='$(LONG)'

# Machine code of tests, also for the builds in folders of this one.
export TEST_CACHE ?= $(abspath $(BUILD))/cache

check: $(if $(filter tests/apps tests/stability,$(TEST_DIRS)),$(COMMAND)) $(TESTS)
	@LEASTACTION_BUILD=$(BUILD) scripts/run-tests $(TESTS)

demo:
	@scripts/install-deps
	@$(MAKE) --no-print-directory all
	@scripts/demo $(BUILD)/leastaction demo

# The problems of ADBench, a program as a reader would write it.
ADBENCH = $(wildcard docs/examples/adbench/*.c)

# By hand: for this machine, as we compile machine code for it.
$(BUILD)/docs/examples/adbench/%_by_hand.o: private CFLAGS += $(SIMD) $(if $(X86),-march=native) -ffp-contract=fast

$(BUILD)/adbench: $(ADBENCH:%.c=$(BUILD)/%.o) $(A)
	$(call say,LD,$@)
	$(Q)$(CC) $(ALL_CFLAGS) $(LDFLAGS) $(filter %.o,$^) $(A) $(LIBS) -o $@

adbench: $(BUILD)/adbench
	@if command -v $(PYTHON) >/dev/null; then \
	    $(PYTHON) -B scripts/peers/adbench.py $< docs/examples/adbench/reference.csv; \
	else $< docs/examples/adbench/reference.csv; fi

bench: all
	@scripts/bench $(BUILD)/leastaction $(BUILD)/bench $(if $(ACCEPT),accept)

# Tables of Horizons for the ephemeris.
HORIZONS ?= tests/data/horizons

CHARTS = gradients linear tape integrators paths gas hnn quantum jobs ephemeris scale

charts: all
	@for kind in $(CHARTS); do \
	    $(BUILD)/leastaction chart $$kind --out charts $(if $(QUICK),--quick) \
	        --data '$(HORIZONS)' || exit; \
	done
	@$(MAKE) --no-print-directory peers

# The pictures of README.md, by the commands it names.
docs-pictures: all
	@scripts/docs-pictures $(BUILD)/leastaction

# Peers, those that $(PYTHON) can import, on the jobs of our charts.
peers: all
	@for kind in gradients integrators paths hnn quantum tape; do \
	    test -f charts/$$kind.csv || test -f charts/$$kind-losses.csv || \
	        $(BUILD)/leastaction chart $$kind --out charts $(if $(QUICK),--quick) || exit; \
	done
	@if command -v $(PYTHON) >/dev/null; then \
	    $(PYTHON) -B scripts/peers/compare.py $(BUILD)/leastaction charts $(if $(QUICK),--quick); \
	else echo 'peers: skipped, $(PYTHON) not installed'; fi

hnn-table: all
	@scripts/hnn-table $(BUILD)/leastaction hnn-table

lint:
	@scripts/check-headers
	@scripts/lint $(BUILD)

abi: $(SO)
	@scripts/abi $(BUILD)

abi-headers:
	@echo $(SOVERSION) $(PUBLIC)

format:
	clang-format -i $(wildcard $(addsuffix /*.[ch],autodiff autodiff/* physics physics/* hnn hnn/* quantum apps apps/* apps/*/* tests tests/* tests/*/* docs/examples docs/examples/adbench))

# All tests, then each fuzzer from its corpus, by clang, because gcc has no libFuzzer. OpenBLAS uses one thread,
# because its threads may end while LeakSanitizer scans them. intercept_tls_get_addr=0: LeakSanitizer guesses the
# size of dynamic thread-local blocks from their allocator's header, and sometimes crashes on the guess.
SANITIZED = --no-print-directory BUILD=$(BUILD)/sanitize CC=clang SAN=1 CFLAGS='-O1 -gline-tables-only -Wno-pass-failed' \
            $(if $(shell command -v ld.lld),LDFLAGS=-fuse-ld=lld)
sanitize:
	@OPENBLAS_NUM_THREADS=1 ASAN_OPTIONS=detect_leaks=1:detect_stack_use_after_return=1:intercept_tls_get_addr=0 \
	    LSAN_OPTIONS=suppressions=$(CURDIR)/scripts/lsan.suppress:print_suppressions=0 \
	    FUZZ_SHARE=2 $(MAKE) $(SANITIZED) check
	@$(MAKE) $(SANITIZED) FUZZ_SECONDS=2 FUZZ_SEED=1 run-fuzzers

fuzz:
	@$(MAKE) $(SANITIZED) run-fuzzers

WITH_O1 = --no-print-directory BUILD=$(BUILD)/o1 O1=1 OBJECTS=$(BUILD)
test-o1: $(A) $(filter $(BUILD)/tests/autodiff/%.o,$(TESTS:%=%.o)) $(HELP_OBJ)
	@FUZZ_SHARE=1 $(MAKE) $(WITH_O1) TEST_DIRS=tests/autodiff check

# Random programs against a plain evaluation. A failure is repeated by PROGRAMS=1 SEED=its seed.
PROGRAMS ?= 1000
SEED ?= 1
fuzz-native: $(A) $(HELP_OBJ) $(BUILD)/tests/autodiff/native/test_native_fuzz
	@for cc in gcc clang; do \
	    if command -v $$cc >/dev/null; then echo "by $$cc"; CC=$$cc $< $(PROGRAMS) $(SEED) || exit; \
	    else echo "$$cc: skipped, not installed"; fi; \
	done
	@$(MAKE) $(WITH_O1) $(BUILD)/o1/tests/autodiff/native/test_native_fuzz
	@echo 'interpreted, kernels at -O1'; \
	    FUZZ_INTERPRETED=1 $(BUILD)/o1/tests/autodiff/native/test_native_fuzz $(PROGRAMS) $(SEED)

# -O1 keeps the lines of the source; counts are atomic because tests run in parallel.
coverage:
	@$(MAKE) --no-print-directory BUILD=$(BUILD)/coverage CC=gcc \
	    CFLAGS='-O1 -g --coverage -fprofile-update=atomic' check
	@scripts/coverage $(BUILD)/coverage

matrix:
	+@scripts/matrix $(BUILD)

# LINES=60 changes that many random lines of the libraries instead (hours), with a new SEED each time.
mutants: $(A)
	+@CC='$(CC)' $(if $(LINES),scripts/mutate-lines $(LINES) '$(if $(findstring command,$(origin SEED)),$(SEED))' $(BUILD),\
	    scripts/mutants $(BUILD))

torture: all
	+@scripts/torture $(BUILD)/leastaction $(KILLS)

test-ranks: $(BUILD)/leastaction
	+@scripts/test-ranks $(BUILD) $(or $(filter-out 200,$(KILLS)),6)

# On two idle processors; MPIRUN is that of MPICC.
MPIRUN ?= mpirun
ranks-speed: $(BUILD)/ranks/$(MPICC)/leastaction
	@scripts/ranks-speed $< $(MPIRUN)

recipes: all
	@FULL=1 scripts/check-docs $(BUILD) docs/recipes.md

# Fails each file call and each allocation of a run; the tests try only a few.
faults: all $(BUILD)/tests/apps/test_failing_files $(BUILD)/tests/apps/test_alloc_commands
	@FAULTS=100000 LEASTACTION_BUILD=$(BUILD) scripts/run-tests $(filter %/test_failing_files %/test_alloc_commands,$^)

test-page: all
	@scripts/test-page $(BUILD)

# By clang, whose OpenMP reports barriers and locks to the sanitizer (libarcher); gcc's does not. No suppressions:
# OpenBLAS and HDF5 are not instrumented, so that what they do among themselves is left out; a child of fork starts
# threads, which the sanitizer refuses unless it is told.
THREADED = autodiff/test_threads autodiff/native/test_native hnn/test_batches contract/test_concurrent
run-threaded: $(THREADED:%=$(BUILD)/tests/%)
	@TSAN_OPTIONS=ignore_noninstrumented_modules=1:die_after_fork=0 OPENBLAS_NUM_THREADS=1 scripts/run-tests $^
tsan:
	@$(MAKE) --no-print-directory BUILD=$(BUILD)/tsan CC=clang SANITIZE=-fsanitize=thread \
	    CFLAGS='-O1 -g -Wno-pass-failed' run-threaded

run-fuzzers: $(FUZZERS:%=%.run)
$(FUZZERS:%=%.run): %.run: %
	@mkdir -p $*.corpus
	@echo "$* ($(FUZZ_SECONDS) s)"
	@TMPDIR=$${TMPDIR:-/dev/shm} $* -max_total_time=$(FUZZ_SECONDS) -seed=$(FUZZ_SEED) -max_len=4096 \
	    -artifact_prefix=$*. $*.corpus tests/fuzz/corpus/$(subst fuzz_,,$(*F)) >$*.log 2>&1 \
	    || { tail -n 30 $*.log; exit 1; }

# ---- install ----

ROOT = $(DESTDIR)$(PREFIX)
LIB  = $(ROOT)/$(LIBDIR)

MAN1 = $(ROOT)/share/man/man1
COMPLETIONS = $(ROOT)/share/bash-completion/completions

install: all
	install -d $(ROOT)/bin $(LIB)/pkgconfig $(LIB)/cmake/leastaction $(MAN1) $(COMPLETIONS)
	install $(COMMAND) $(ROOT)/bin/
	rm -f $(ROOT)/libexec/leastaction/mpi.so
	$(if $(MPI),install -D $(dir $(COMMAND))mpi.so $(ROOT)/libexec/leastaction/mpi.so)
	install -m 644 $(A) $(LIB)/
	install $(SO) $(LIB)/libleastaction.so.$(VERSION)
	ln -sf libleastaction.so.$(VERSION) $(LIB)/libleastaction.so.$(SOVERSION)
	ln -sf libleastaction.so.$(SOVERSION) $(LIB)/libleastaction.so
	for h in $(PUBLIC); do install -D -m 644 $$h $(ROOT)/include/leastaction/$$h; done
	install -D -m 644 physics/cmocka.h $(ROOT)/include/leastaction/leastaction/cmocka.h
	echo '#include "autodiff/version.h"' > $(ROOT)/include/leastaction/leastaction/version.h
	for f in pkgconfig/leastaction.pc cmake/leastaction/leastactionConfig.cmake cmake/leastaction/leastactionConfigVersion.cmake; do \
	    sed 's|@PREFIX@|$(PREFIX)|; s|@LIBDIR@|$(LIBDIR)|; s|@VERSION@|$(VERSION)|; s|@SOVERSION@|$(SOVERSION)|' \
	        scripts/$${f##*/}.in > $(LIB)/$$f || exit; \
	done
	$(BUILD)/leastaction manual > $(MAN1)/leastaction.1
	for c in $$($(BUILD)/leastaction manual | sed -n 's/^\.BR leastaction.-\([a-z]*\).*/\1/p'); do \
	    $(BUILD)/leastaction manual $$c > $(MAN1)/leastaction-$$c.1 || exit; \
	done
	$(BUILD)/leastaction completion > $(COMPLETIONS)/leastaction

# Those that `install` may have made, and no others of the system.
FOLDERS = $(LIBDIR)/pkgconfig $(LIBDIR)/cmake share/man/man1 share/bash-completion/completions share/bash-completion

uninstall:
	rm -f $(ROOT)/bin/leastaction $(LIB)/libleastaction.* $(LIB)/pkgconfig/leastaction.pc \
	    $(MAN1)/leastaction.1 $(MAN1)/leastaction-*.1 $(COMPLETIONS)/leastaction
	rm -rf $(ROOT)/include/leastaction $(ROOT)/libexec/leastaction $(LIB)/cmake/leastaction
	@for d in $(FOLDERS) $(if $(filter /usr /usr/local,$(ROOT)),,$(LIBDIR) lib share/man share include libexec bin); do \
	    test ! -d $(ROOT)/$$d || rmdir --ignore-fail-on-non-empty $(ROOT)/$$d; \
	done

deb:
	@scripts/deb $(BUILD)

clean:
	rm -rf $(BUILD) leastaction
