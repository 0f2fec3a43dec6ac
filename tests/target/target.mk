# Images for the emulated machines: make -f tests/target/target.mk
OUT := build/target
WARN := -Wall -Wextra -pedantic -Wconversion -Wdouble-promotion -Werror
# The same flags for all algorithms; -ffp-contract=off because x * y + z must round twice everywhere.
FLAGS := -std=c99 -O2 -ffp-contract=off $(WARN) -Ifirmware/core -Itests/reference -Itests/target \
	-Ifirmware/hal -Ifirmware/app -Ibuild/target/params
PARAMS := build/target/params/mdl_params.c
COMMON := $(wildcard firmware/core/*.c tests/reference/*.c)
HEADERS := $(wildcard firmware/*/*.h tests/reference/*.h tests/target/*.h)

AVR := avr-gcc -mmcu=atmega1284p $(FLAGS)
AVR_LINK := -Wl,--defsym=__DATA_REGION_LENGTH__=0xfe00 -Wl,--defsym=__stack=0xffff -lm
ARM := arm-none-eabi-gcc -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 \
	-ffunction-sections $(FLAGS) -Ifirmware/bsp_mps2
ARM_LINK := -nostartfiles -T linker/mps2.ld -Wl,--gc-sections

CC_avr = $(AVR)
CC_mps2 = $(ARM)
SIZED := $(foreach machine,avr mps2,$(OUT)/$(machine)-ours.o $(OUT)/$(machine)-reference.o)

.PHONY: all
all: $(OUT)/avr.elf $(OUT)/avr_run $(OUT)/mps2.elf $(OUT)/host $(OUT)/firmware.elf $(OUT)/probed.elf \
	$(OUT)/paper.elf $(SIZED)

$(OUT)/avr.elf: tests/target/target.c tests/target/board_avr.c $(PARAMS) $(COMMON) $(HEADERS) | $(OUT)
	$(AVR) -o $@ $(filter %.c,$^) $(AVR_LINK)

$(OUT)/avr_run: tests/target/avr_run.c | $(OUT)
	gcc -std=gnu99 -O2 -Wall -Wextra -Werror -isystem /usr/include/simavr -o $@ $< -lsimavr -lelf

$(OUT)/mps2.elf: tests/target/target.c tests/target/board_mps2.c firmware/bsp_mps2/startup.c \
		firmware/bsp_mps2/semihosting.c $(PARAMS) $(COMMON) $(HEADERS) linker/mps2.ld | $(OUT)
	$(ARM) -o $@ $(filter %.c,$^) $(ARM_LINK)

# The firmware itself, and the same with what the predictor returns written beside it.
FIRMWARE := $(wildcard firmware/app/*.c firmware/core/*.c firmware/bsp_mps2/*.c)
$(OUT)/firmware.elf: $(FIRMWARE) $(HEADERS) linker/mps2.ld | $(OUT)
	$(ARM) -o $@ $(filter %.c,$^) $(ARM_LINK)

$(OUT)/probed.elf: tests/target/probe.c $(FIRMWARE) $(HEADERS) linker/mps2.ld | $(OUT)
	$(ARM) -o $@ $(filter %.c,$^) $(ARM_LINK) -Wl,--wrap=mdl_chain_step,--wrap=mdl_board_idle

$(OUT)/paper.elf: tests/target/paper.c tests/reference/cao2019.c $(FIRMWARE) $(HEADERS) linker/mps2.ld | $(OUT)
	$(ARM) -o $@ $(filter %.c,$^) $(ARM_LINK) -Wl,--wrap=mdl_chain_step

$(OUT)/host: tests/target/host.c $(COMMON) $(HEADERS) | $(OUT)
	gcc $(FLAGS) -o $@ $(filter %.c,$^)

# What one algorithm alone takes, for its size: ours in the baseline, the paper's.
$(OUT)/%-ours.o: firmware/core/mdl_traj.c firmware/core/mdl_major.c firmware/core/mdl_shape.c $(HEADERS) | $(OUT)
	$(CC_$*) -r -nostdlib -o $@ $(filter %.c,$^)

$(OUT)/%-reference.o: tests/reference/cao2019.c $(HEADERS) | $(OUT)
	$(CC_$*) -r -nostdlib -o $@ $(filter %.c,$^)

$(PARAMS): tests/target/params.py $(wildcard tools/madelung/*.py) | $(OUT)
	.venv/bin/python $< $(@D)

$(OUT):
	@mkdir -p $@
