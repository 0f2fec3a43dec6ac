# Builds and runs the unit tests in one variant: make -f tests/unit/unit.mk VARIANT=REAL-N_U-KIND.
# REAL: f32 or f64. KIND: fast (as the libraries are built), asan (sanitizers), cov (coverage).
REAL := $(word 1,$(subst -, ,$(VARIANT)))
N_U := $(word 2,$(subst -, ,$(VARIANT)))
KIND := $(word 3,$(subst -, ,$(VARIANT)))
STAGE ?= test-unit
OUT := build/unit/$(VARIANT)

WARN := -std=c99 -Wall -Wextra -pedantic -Wconversion -Wdouble-promotion -Werror
FLAGS_f32 :=
FLAGS_f64 := -DMDL_REAL_DOUBLE -DMDL_DEGREE_MAX=15
FLAGS_fast := -O2
FLAGS_asan := -O1 -g -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all
FLAGS_cov := -O0 -g --coverage
CFLAGS := -ffp-contract=off -DMDL_N_U=$(N_U) $(FLAGS_$(REAL)) \
	$(FLAGS_$(KIND)) -Ifirmware/core -Itests/unit/support -Ibuild/unity/src

HEADERS := $(wildcard firmware/core/*.h tests/unit/support/*.h)
CORE := $(patsubst firmware/core/%.c,$(OUT)/%.o,$(wildcard firmware/core/*.c))
TESTS := $(patsubst tests/unit/%.c,%,$(wildcard tests/unit/test_*.c))

.PHONY: all $(TESTS)
.SECONDARY:
all: $(TESTS)

# The address sanitizer's leak check needs ptrace, which containers deny; nothing here allocates.
$(TESTS): %: $(OUT)/%
	@ASAN_OPTIONS=detect_leaks=0 tools/run_unity.sh $(STAGE) $(VARIANT)/$@ $<

$(OUT)/test_%: $(OUT)/test_%.o $(OUT)/test_%_runner.o $(CORE) $(OUT)/unity.o
	@gcc $(CFLAGS) -o $@ $^ -lm

$(OUT)/%.o: firmware/core/%.c $(HEADERS) | $(OUT)
	@gcc $(CFLAGS) $(WARN) -c -o $@ $<

$(OUT)/%.o: tests/unit/%.c $(HEADERS) | $(OUT)
	@gcc $(CFLAGS) $(WARN) -c -o $@ $<

$(OUT)/%_runner.o: $(OUT)/%_runner.c $(HEADERS)
	@gcc $(CFLAGS) -c -o $@ $<

$(OUT)/%_runner.c: tests/unit/%.c
	@ruby build/unity/auto/generate_test_runner.rb $< $@

$(OUT)/unity.o: build/unity/src/unity.c | $(OUT)
	@gcc $(CFLAGS) -c -o $@ $<

$(OUT):
	@mkdir -p $@
