# Every entry point. `make help` lists them.
SHELL := /bin/sh
CC := gcc
PYTHON := .venv/bin/python
LIB := tools/madelung/_lib

CORE_C := $(wildcard firmware/core/*.c)
CORE_H := $(wildcard firmware/core/*.h)
BINDING := $(wildcard tools/madelung/binding/*)
WARN := -std=c99 -Wall -Wextra -pedantic -Wconversion -Werror
CFLAGS := -O2 -fPIC -ffp-contract=off $(WARN)

.DEFAULT_GOAL := all
.PHONY: all help
all: .venv/.done $(LIB)/libmdl_f32.so $(LIB)/libmdl_f64.so $(LIB)/libstage.so ## build the libraries and .venv

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' Makefile | expand -t 16

.venv/.done: tools/requirements.lock tools/pyproject.toml tools/venv.sh tools/apt.sh
	@tools/apt.sh gcc libc6-dev
	@echo "installing Python packages into .venv"
	@tools/venv.sh
	@touch $@

# The float build is what the firmware runs; fits use the double build with a larger memory.
$(LIB)/libmdl_f32.so: $(CORE_C) $(CORE_H) $(BINDING)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS) -Wdouble-promotion -shared -Ifirmware/core -o $@ $(CORE_C) tools/madelung/binding/batch.c

$(LIB)/libmdl_f64.so: $(CORE_C) $(CORE_H) $(BINDING)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS) -DMDL_REAL_DOUBLE -DMDL_N_U=65536 -DMDL_DELAY_MAX=4096 -shared -Ifirmware/core -o $@ $(CORE_C) tools/madelung/binding/batch.c

# The simulated actuator: its own physics, nothing of firmware/core.
$(LIB)/libstage.so: $(wildcard host_sim/*.[ch])
	@mkdir -p $(@D)
	$(CC) -O3 -fPIC -ffp-contract=off $(WARN) -shared -o $@ $(wildcard host_sim/*.c) -lm
