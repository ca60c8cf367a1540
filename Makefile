# toile: targets for users and developers. `make help` lists them.

# no built-in rules: they would link dependency files
MAKEFLAGS += --no-builtin-rules

config ?= release
BUILD := build/$(config)
CC ?= gcc

CPPFLAGS := -I. -isystem /usr/include/suitesparse -D_GNU_SOURCE -DTOILE_SOURCE_DIR='"$(CURDIR)"' -MMD -MP
WARNINGS := -Wall -Wextra -pedantic -Wshadow -Wvla -Wmissing-prototypes -Wstrict-prototypes -Werror
# -ffp-contract=off: the same bits on processors with and without fused multiply-add
CFLAGS := -std=c17 -g -fopenmp -ffp-contract=off -fno-math-errno -fno-trapping-math $(WARNINGS)
LDFLAGS := -fopenmp

ifeq ($(config),release)
CFLAGS += -O2
# small fixed loops over slopes and strains: unrolled they cost half
$(BUILD)/sim/model/strain.o: CFLAGS += -O3
$(BUILD)/sim/contact/%.o: CFLAGS += -O3
$(BUILD)/sim/step/sides.o: CFLAGS += -O3
else ifeq ($(config),debug)
CFLAGS += -O0
CPPFLAGS += -DTOILE_JUDGE # every frame, by the exact check
else ifeq ($(config),sanitize)
CFLAGS += -O1 -fsanitize=address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=undefined
LDFLAGS += -fsanitize=address,undefined
else ifeq ($(config),coverage)
CFLAGS += -O0 --coverage
LDFLAGS += --coverage
else
$(error config is one of release, debug, sanitize, coverage; not '$(config)')
endif

# foreign libraries, one line per program
SHARED_LIBS := -lqhull_r -llapacke -lopenblas -lgmp -lxxhash -lm
SIM_LIBS := -lcholmod -lyaml -ludunits2 -lassimp $(SHARED_LIBS)
RENDER_LIBS := -lOpenEXRCore-3_1 -lavfilter -lavformat -lavcodec -lswscale -lavutil -lpng -lcairo -ldl $(SHARED_LIBS)

SHARED_SOURCES := $(wildcard sim/base/*.c sim/geom/*.c sim/state/*.c)
SIM_SOURCES := $(wildcard sim/scene/*.c sim/solve/*.c sim/model/*.c sim/contact/*.c sim/step/*.c) \
	$(filter-out sim/main.c,$(wildcard sim/*.c))
RENDER_SOURCES := $(filter-out render/main.c,$(wildcard render/*.c))
TEST_SOURCES := $(wildcard tests/test_*.c)
TEST_SUPPORT := $(wildcard tests/support/*.c)
# what draws photographs needs the renderer, which the simulator's benches do without
SIM_SUPPORT := $(filter-out tests/support/photos.c,$(TEST_SUPPORT))

objects = $(patsubst %.c,$(BUILD)/%.o,$(1))
SHARED_OBJECTS := $(call objects,$(SHARED_SOURCES))
SIM_OBJECTS := $(call objects,$(SIM_SOURCES))
RENDER_OBJECTS := $(call objects,$(RENDER_SOURCES))
TESTS := $(patsubst tests/%.c,$(BUILD)/tests/%,$(TEST_SOURCES))

.PHONY: all
all: $(BUILD)/toile-sim $(BUILD)/toile-render

# row loops are compiled once per vector width; the processor is asked at run time (sim/base/vector.h)
VECTOR_KERNELS := sim/model/sweep_kernel sim/contact/pair_kernel sim/contact/rest_kernel \
	sim/contact/box_kernel sim/contact/motion_kernel sim/contact/path_kernel sim/contact/slope_kernel \
	sim/step/inertia_kernel sim/step/look_kernel
VECTOR_VARIANTS := scalar sse2 avx2 avx512
VECTOR_FLAGS_scalar := -O2 -fno-tree-vectorize
VECTOR_FLAGS_sse2 := -O2 -fopenmp-simd -DVECTOR_SIMD
VECTOR_FLAGS_avx2 := -O2 -fopenmp-simd -DVECTOR_SIMD -mavx2
VECTOR_FLAGS_avx512 := -O2 -fopenmp-simd -DVECTOR_SIMD -mavx512f -mavx512dq -mavx512vl \
	-mprefer-vector-width=512
SIM_OBJECTS := $(filter-out $(VECTOR_KERNELS:%=$(BUILD)/%.o),$(SIM_OBJECTS)) \
	$(foreach kernel,$(VECTOR_KERNELS),$(VECTOR_VARIANTS:%=$(BUILD)/$(kernel).%.o))

define vector_rule
$(BUILD)/$(1).%.o: $(1).c
	@mkdir -p $$(@D)
	@echo "cc   $$< ($$*)"
	@$$(CC) $$(CPPFLAGS) $$(CFLAGS) $$(VECTOR_FLAGS_$$*) -DVECTOR_VARIANT=$$* -c $$< -o $$@
endef
$(foreach kernel,$(VECTOR_KERNELS),$(eval $(call vector_rule,$(kernel))))

$(BUILD)/%.o: %.c
	@mkdir -p $(@D)
	@echo "cc   $<"
	@$(CC) $(CPPFLAGS) $(CFLAGS) -c $< -o $@

$(BUILD)/toile-sim: $(BUILD)/sim/main.o $(SIM_OBJECTS) $(SHARED_OBJECTS)
	@echo "link $@"
	@$(CC) $(LDFLAGS) $^ $(SIM_LIBS) -o $@

$(BUILD)/toile-render: $(BUILD)/render/main.o $(RENDER_OBJECTS) $(SHARED_OBJECTS)
	@echo "link $@"
	@$(CC) $(LDFLAGS) $^ $(RENDER_LIBS) -o $@

# the texts are copied into the object by the assembler
$(BUILD)/render/shaders.o: $(wildcard render/shaders/*.glsl)

$(BUILD)/tests/%: $(BUILD)/tests/%.o $(call objects,$(TEST_SUPPORT)) $(SIM_OBJECTS) \
		$(RENDER_OBJECTS) $(SHARED_OBJECTS)
	@echo "link $@"
	@$(CC) $(LDFLAGS) $^ $(SIM_LIBS) $(RENDER_LIBS) -lcmocka -o $@

%.d: ;
.SECONDARY:
-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)

# ---- what users type ----

.PHONY: help setup demo test unit check lint format format-check layers determinism sanitize coverage fuzz \
	fuzz-scenes bench stress golden-accept film clean

help:
	@echo "make            build both programs (config=release|debug|sanitize|coverage)"
	@echo "make demo       set up, build, film the twisting sleeve into build/demo/"
	@echo "make test       set up, build, run every test (T=name: one of tests/test_name.c)"
	@echo "make unit T=name  one test program, without set-up"
	@echo "make check      layers, sizes, format, clang-tidy, cppcheck, tests"
	@echo "make sanitize   the tests under AddressSanitizer and UBSan"
	@echo "make bench      run time against error: build/bench/ (SUITE=name: one suite)"
	@echo "make stress     abuse: build/stress/stress.csv"
	@echo "make fuzz       fuzz the readers of scenes, states, meshes (SECONDS=60 each)"
	@echo "make fuzz-scenes  whole scenes by lot, 10 minutes (SCENES=250 FIRST=1)"
	@echo "make coverage   line coverage of the tests"
	@echo "make format     clang-format over everything"
	@echo "make golden-accept  new golden pictures, when they should change (CONTRIBUTING.md)"
	@echo "make film SCENE=assets/scenes/hanging.yaml"

setup:
	@scripts/setup.sh

# a new user's first build takes every processor, unless make was told how many
PARALLEL = $(if $(filter -j% --jobserver%,$(MAKEFLAGS)),,-j$(shell nproc))

demo: setup
	@$(MAKE) --no-print-directory $(PARALLEL) all
	@mkdir -p build/demo
	scripts/toile film assets/scenes/sleeve.yaml -o build/demo/sleeve.mp4
	scripts/toile sheet build/demo/sleeve.run -o build/demo/sleeve.png

test: setup
	@$(MAKE) --no-print-directory $(PARALLEL) unit

T ?= *
unit: all $(filter $(BUILD)/tests/test_$(subst *,%,$(T)),$(TESTS))
	@scripts/run_tests.sh $(BUILD)/tests/test_$(T)

check: layers format-check lint determinism test

determinism:
	@scripts/check_determinism.sh

layers:
	@scripts/check_layers.sh

SOURCES := $(shell git ls-files '*.c' '*.h' 2>/dev/null)
format:
	clang-format -i $(SOURCES)

format-check:
	@clang-format --dry-run --Werror $(SOURCES) && echo "format: ok"

lint:
	@scripts/lint.sh

sanitize: all
	@$(MAKE) --no-print-directory config=sanitize all
	@ASAN_OPTIONS=detect_leaks=1 LSAN_OPTIONS=print_suppressions=0:suppressions=$(CURDIR)/scripts/lsan.txt \
		$(MAKE) --no-print-directory config=sanitize unit

coverage:
	@$(MAKE) --no-print-directory config=coverage unit
	@scripts/coverage.sh build/coverage

SUITE ?= all
# Debian's own: set-up gives it numpy and matplotlib
PYTHON ?= /usr/bin/python3
bench: all $(call objects,$(wildcard tests/bench/*.c))
	@$(MAKE) --no-print-directory $(BUILD)/tests/bench/bench
	@mkdir -p build/bench
	@$(BUILD)/tests/bench/bench $(SUITE) build/bench/results.csv
	@$(PYTHON) scripts/plot_bench.py build/bench/results.csv build/bench

$(BUILD)/tests/bench/bench: $(call objects,$(wildcard tests/bench/*.c)) \
		$(call objects,$(SIM_SUPPORT)) $(SIM_OBJECTS) $(SHARED_OBJECTS)
	@echo "link $@"
	@$(CC) $(LDFLAGS) $^ $(SIM_LIBS) -lcmocka -o $@

stress: all
	@$(MAKE) --no-print-directory $(BUILD)/tests/stress/stress
	@mkdir -p build/stress
	@$(BUILD)/tests/stress/stress build/stress/stress.csv

$(BUILD)/tests/stress/stress: $(call objects,$(wildcard tests/stress/*.c)) \
		$(call objects,$(SIM_SUPPORT)) $(SIM_OBJECTS) $(SHARED_OBJECTS)
	@echo "link $@"
	@$(CC) $(LDFLAGS) $^ $(SIM_LIBS) -lcmocka -o $@

SECONDS ?= 60
fuzz:
	@scripts/fuzz.sh $(SECONDS)

SCENES ?= 250
FIRST ?= 1
fuzz-scenes: all
	@TOILE_BUILD=$(CURDIR)/$(BUILD) $(PYTHON) tests/fuzz/scenes.py --first $(FIRST) --count $(SCENES)

golden-accept: all $(TESTS)
	TOILE_GOLDEN_ACCEPT=1 scripts/run_tests.sh $(BUILD)/tests/test_render*

film: all
	scripts/toile film $(SCENE)

clean:
	rm -rf build
