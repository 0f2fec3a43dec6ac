# Every entry point. `make help` lists them.
SHELL := /bin/sh
CC := gcc
PYTHON := .venv/bin/python
LIB := tools/madelung/_lib

CORE_C := $(wildcard firmware/core/*.c)
CORE_H := $(wildcard firmware/core/*.h)
BINDING := $(wildcard tools/madelung/binding/*)
WARN := -std=c99 -Wall -Wextra -pedantic -Wconversion -Werror
CFLAGS := -O3 -fPIC -ffp-contract=off $(WARN)

.DEFAULT_GOAL := all
.PHONY: all help demo blind
all: .venv/.done $(LIB)/libmdl_f32.so $(LIB)/libmdl_f64.so $(LIB)/libstage.so ## build the libraries and .venv

demo: all ## simulate a stage, identify it, predict another record, diagnose a sealed cause; see demo-out/
	@tools/demo.sh demo-out
	@tools/demo_diagnosis.sh demo-out

blind: all ## a blind trial of the diagnosis, minutes; the card is build/blind/card.html: CASES=60 SEED=12345
	@tools/blind.sh build/blind "$(or $(CASES),60)" $(SEED)

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' Makefile | expand -t 16

.venv/.done: tools/requirements.lock tools/pyproject.toml tools/venv.sh tools/apt.sh
	@tools/apt.sh gcc libc6-dev
	@echo "installing Python packages into .venv"
	@tools/venv.sh
	@touch $@

# The float build is what the firmware runs; fits use the double build with a larger memory. Calls
# between the core's files are inlined: the same bits, a fifth sooner.
WHOLE := -flto=auto -fno-semantic-interposition

$(LIB)/libmdl_f32.so: $(CORE_C) $(CORE_H) $(BINDING)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS) $(WHOLE) -Wdouble-promotion -shared -Ifirmware/core -o $@ $(CORE_C) tools/madelung/binding/batch.c

$(LIB)/libmdl_f64.so: $(CORE_C) $(CORE_H) $(BINDING)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS) $(WHOLE) -DMDL_REAL_DOUBLE -DMDL_N_U=65536 -DMDL_DELAY_MAX=4096 -DMDL_DEGREE_MAX=15 -shared -Ifirmware/core -o $@ $(CORE_C) tools/madelung/binding/batch.c

# The simulated actuator: its own physics, nothing of firmware/core.
$(LIB)/libstage.so: $(wildcard host_sim/*.[ch])
	@mkdir -p $(@D)
	$(CC) -O3 -fPIC -ffp-contract=off $(WARN) -shared -o $@ $(wildcard host_sim/*.c) -lm

# Tests are run in stages, see tools/run_stages.sh; to add one, add its target here.
TEST_STAGES := test-unit test-firmware coverage test-target test-python
UNIT_VARIANTS := f32-256-asan f32-4096-asan f32-65536-asan f64-256-asan f64-4096-asan \
	f64-65536-asan f32-4096-fast f64-65536-fast
UNIT := $(MAKE) --no-print-directory -j2 -k -f tests/unit/unit.mk

.PHONY: bench test test-unit test-firmware coverage test-target test-python test-all test-slow reproduce fuzz ceedling lint
test: all ## run the tests; the last line counts them
	@tools/run_stages.sh $(TEST_STAGES)

test-all: all ## run also the tests that take minutes
	@tools/run_stages.sh $(TEST_STAGES) test-slow

test-slow: all ## run the slow tests, with the tables of the diagnosis
	@tools/run_pytest.sh test-slow -s -m slow tests/python

test-unit: ## run the unit tests of firmware/core in every variant
	@tools/apt.sh gcc libc6-dev
	@tools/unity.sh
	@code=0; for v in $(UNIT_VARIANTS); do $(UNIT) VARIANT=$$v || code=1; done; exit $$code

test-firmware: ## run the interrupt loop and the F28335's sources on a fake HAL and fake registers
	@tools/apt.sh gcc libc6-dev
	@tools/unity.sh
	@$(MAKE) --no-print-directory -j2 -k -f tests/unit/firmware/firmware.mk

coverage: .venv/.done ## print the line coverage of firmware/core; fails below 100 %
	@tools/unity.sh
	@rm -rf build/unit/f32-4096-cov
	@$(UNIT) VARIANT=f32-4096-cov STAGE=coverage
	@.venv/bin/gcovr --root . --filter firmware/core/ --fail-under-line 100 build/unit/f32-4096-cov

test-target: all ## compare the bits of an emulated AVR and Cortex-M4F with the PC's
	@tools/run_pytest.sh test-target tests/target

bench: all ## what a step costs beside the paper's algorithm, time, memory, stack; what a diagnosis costs
	@.venv/bin/python tests/target/bench.py
	@.venv/bin/python tests/python/bench_diagnose.py

test-python: all ## run the tests in Python
	@tools/apt.sh chromium chromium-driver
	@tools/run_pytest.sh test-python $(wildcard tests/python tests/property tests/regression)

reproduce: all ## put the papers' results beside ours, in build/cao2019 and build/yang2015
	@.venv/bin/python tests/target/fig8.py build/fig8
	@for name in paper ours; do .venv/bin/madelung timing build/fig8/$$name.vcd \
		--record build/fig8/codes.csv -o build/fig8/$$name.json --plot build/fig8/$$name.png; done
	@.venv/bin/madelung reproduce cao2019 -o build/cao2019 \
		--timing build/fig8/paper.json --timing build/fig8/ours.json
	@.venv/bin/madelung reproduce yang2015 -o build/yang2015

fuzz: all ## feed damaged files and strange options to every command, for as long as asked: SECONDS=600
	@FUZZ_SECONDS="$(or $(SECONDS),600)" .venv/bin/pytest -q -k survives tests/python/test_fuzz.py

ceedling: ## run the same unit tests with Ceedling
	@command -v ceedling >/dev/null || { echo "ceedling is not on PATH: gem install ceedling" >&2; exit 1; }
	@ceedling test:all

lint: all ## check formatting, warnings, types and portability
	@tools/lint.sh

.PHONY: params firmware flash bsp-regs
MODEL ?= firmware/app/model.json
params: all ## export MODEL=model.json as the firmware's parameters, firmware/app/mdl_params.[hc]
	@.venv/bin/madelung export $(MODEL) -o firmware/app

firmware: ## build the F28335's images with TI's compiler: TI_CGT=/path
	@TI_CGT="$(TI_CGT)" tools/f28335.sh images

flash: ## program the F28335's flash with TI's UniFlash: UNIFLASH=/path CCXML=target.ccxml
	@UNIFLASH="$(UNIFLASH)" CCXML="$(CCXML)" tools/f28335.sh flash

bsp-regs: ## compare the register tables with TI's headers: C2000WARE_DIR=/path
	@tools/apt.sh gcc libc6-dev
	@python3 tools/regs/compare.py "$(C2000WARE_DIR)"
