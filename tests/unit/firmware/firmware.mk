# Unit tests of firmware/app and firmware/bsp_f28335 on a fake HAL and a fake register file:
# make -f tests/unit/firmware/firmware.mk. Each test program is built with the sanitizers.
STAGE ?= test-firmware
OUT := build/unit/firmware
HERE := tests/unit/firmware
WARN := -std=c99 -Wall -Wextra -pedantic -Wconversion -Wdouble-promotion -Werror
CFLAGS := -O1 -g -ffp-contract=off -fsanitize=address,undefined,float-cast-overflow \
	-fno-sanitize-recover=all -Ifirmware/core -Ifirmware/hal -Ifirmware/app \
	-Ifirmware/bsp_f28335 -Ihost_sim/board -I$(HERE)/support -Ibuild/unity/src

CORE := $(wildcard firmware/core/*.c) firmware/app/mdl_params.c
BOARD := $(CORE) firmware/app/mdl_app.c host_sim/board/fake_f28335.c \
	$(wildcard firmware/bsp_f28335/*.c)
HEADERS := $(wildcard firmware/*/*.h host_sim/board/*.h $(HERE)/support/*) firmware/app/main.c

TESTS := test_app test_f28335_setup test_f28335_samples test_f28335_bus_0 test_f28335_bus_6 \
	test_f28335_bus_7
SOURCES_test_app := $(CORE) firmware/app/mdl_app.c $(HERE)/support/fake_hal.c
BUS := -DMDL_FAKE_REGISTERS -DF28335_DAC_XINTF -DF28335_XINTF_ZONE

.PHONY: all $(TESTS)
.SECONDARY:
all: $(TESTS)

# The address sanitizer's leak check needs ptrace, which containers deny; nothing here allocates.
$(TESTS): %: $(OUT)/%
	@ASAN_OPTIONS=detect_leaks=0 tools/run_unity.sh $(STAGE) firmware/$@ $<

define PROGRAM # program, test file, sources, flags
$(OUT)/$(1): $(HERE)/$(2).c $(OUT)/$(2)_runner.c $(3) $(HEADERS)
	@gcc $(CFLAGS) $(WARN) $(4) -c -o $(OUT)/$(1).o $$<
	@gcc $(CFLAGS) -w $(4) -o $$@ $(OUT)/$(1).o $(3) $(OUT)/$(2)_runner.c \
		build/unity/src/unity.c -lm
endef
$(eval $(call PROGRAM,test_app,test_app,$(SOURCES_test_app),))
$(foreach t,setup samples,$(eval $(call PROGRAM,test_f28335_$(t),test_f28335_$(t),$(BOARD),\
	-DMDL_FAKE_REGISTERS)))
$(foreach z,0 6 7,$(eval $(call PROGRAM,test_f28335_bus_$(z),test_f28335_bus,$(BOARD),$(BUS)=$(z))))

$(OUT)/%_runner.c: $(HERE)/%.c | $(OUT)
	@ruby build/unity/auto/generate_test_runner.rb $< $@

$(OUT):
	@mkdir -p $@
