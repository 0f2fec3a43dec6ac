# Both images of the F28335 with TI's compiler, and programming the flash. From the top folder:
#   make firmware TI_CGT=/path/to/ti-cgt-c2000_22.6.x.LTS
#   make flash UNIFLASH=/path/to/uniflash CCXML=target.ccxml
# FIRMWARE_DEFINES takes further -D, for instance -DF28335_DAC_XINTF.
OUT := build/f28335
CL := $(TI_CGT)/bin/cl2000
MODEL := -v28 -ml -mt --float_support=fpu32 --abi=coffabi
CFLAGS := $(MODEL) --c99 -O2 --fp_mode=strict --display_error_number $(FIRMWARE_DEFINES) \
	--include_path=firmware/core --include_path=firmware/hal --include_path=firmware/app \
	--include_path=firmware/bsp_f28335 --include_path=$(TI_CGT)/include

# These run before the functions are copied to RAM, so they stay where they are loaded.
IN_PLACE := firmware/app/main.c firmware/bsp_f28335/f28335_board.c
IN_RAM := $(filter-out $(IN_PLACE),$(wildcard firmware/core/*.c firmware/app/*.c \
	firmware/bsp_f28335/*.c))
object = $(OUT)/$(notdir $(basename $(1))).obj
OBJECTS := $(foreach f,$(IN_PLACE) $(IN_RAM) f28335_start.asm,$(call object,$(f)))
HEADERS := $(wildcard firmware/*/*.h)

.PHONY: images flash
images: $(OUT)/madelung_ram.out $(OUT)/madelung_flash.out

$(OUT)/madelung_%.out: $(OBJECTS) linker/f28335_%.cmd
	$(CL) $(MODEL) --run_linker --entry_point=code_start --stack_size=0x380 --heap_size=0 \
		--rom_model --map_file=$(@:.out=.map) --output_file=$@ $^ \
		--search_path=$(TI_CGT)/lib --library=rts2800_fpu32.lib

define COMPILE # source, further flags
$(call object,$(1)): $(1) $(HEADERS) | $(OUT)
	$(CL) $(CFLAGS) $(2) --output_file=$$@ --compile_only $$<
endef
$(foreach f,$(IN_PLACE),$(eval $(call COMPILE,$(f),)))
$(foreach f,$(IN_RAM),$(eval $(call COMPILE,$(f),--ramfunc=on)))

$(OUT)/f28335_start.obj: firmware/bsp_f28335/f28335_start.asm | $(OUT)
	$(CL) $(MODEL) --output_file=$@ --compile_only $<

$(OUT):
	@mkdir -p $@

flash:
	$(UNIFLASH)/dslite.sh --config=$(CCXML) --flash --verify $(OUT)/madelung_flash.out
