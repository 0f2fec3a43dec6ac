#include "fake_f28335.h"

#include "f28335_io.h"

#include <stddef.h>
#include <string.h>

enum { READ_CLOCKS = 4, WRITE_CLOCKS = 2, NOP_CLOCKS = 1, WORDS = 0x8000 };
enum { PLL_LOCK_CLOCKS = 400, ADC_POWER_UP_CLOCKS = 750000, ADCINT_SLOT = 37 };
enum { CONVERSION_CLOCKS = 100 };

typedef struct {
    const char *name;
    uint16_t width;
    uint16_t is_protected;
} entry;

enum { OPEN = 0, EALLOW = 1 };

fake_board fake;

static struct {
    uint16_t word[WORDS];
    entry map[WORDS];
    void (*vector[f28335_items_PIEVECT])(void);
    uint16_t eallow, interrupts_on, ier, in_interrupt, calibrated;
    uint64_t quiet_until, pll_locks_at, adc_powered_at, next_trigger, conversion_ends, spi_ends;
    uint16_t converting, slot, spi_shifting, spi_word;
} chip;

#define AT(name) chip.word[f28335_at_##name]
#define HAS(name, field) ((AT(name) & MDL_MASK(name, field)) != 0)
#define SET_FLAG(name, field) (AT(name) = (uint16_t)(AT(name) | MDL_MASK(name, field)))
#define CLEAR_FLAG(name, field) (AT(name) = (uint16_t)(AT(name) & ~MDL_MASK(name, field)))
#define GET(name, field) ((AT(name) & MDL_MASK(name, field)) >> f28335_lsb_##name##_##field)

static void violate(const char *what)
{
    if (fake.violations++ == 0) {
        fake.violation = what;
    }
}

static uint16_t continues(const fake_event *last, fake_kind kind, uint32_t address, uint32_t value)
{
    return last->kind == kind &&
           (kind == FAKE_WAIT ||
            (kind == FAKE_READ && last->address == address && last->value == value));
}

static void note(fake_kind kind, const char *name, uint32_t address, uint32_t value)
{
    if (fake.logged >= FAKE_LOG_LENGTH) {
        return;
    }
    if (fake.logged > 0 && continues(&fake.log[fake.logged - 1u], kind, address, value)) {
        fake.log[fake.logged - 1u].value += kind == FAKE_WAIT ? value : 0;
        return;
    }
    fake.log[fake.logged].kind = kind;
    fake.log[fake.logged].name = name;
    fake.log[fake.logged].address = address;
    fake.log[fake.logged].value = value;
    fake.logged++;
}

static void map_registers(void)
{
    uint16_t i;
#define MAP(n, at, bits, access, structure, member)                                                \
    chip.map[at].name = #n;                                                                        \
    chip.map[at].width = bits;                                                                     \
    chip.map[at].is_protected = access;
#define MAP_ARRAY(n, at, bits, stride, items, access, structure, first, last)                      \
    for (i = 0; i < items; i++) {                                                                  \
        chip.map[at + stride * i].name = #n;                                                       \
        chip.map[at + stride * i].width = bits;                                                    \
        chip.map[at + stride * i].is_protected = access;                                           \
    }
    F28335_REGISTERS(MAP)
    F28335_ARRAYS(MAP_ARRAY)
#undef MAP
#undef MAP_ARRAY
}

void fake_reset(void)
{
    memset(&fake, 0, sizeof fake);
    memset(&chip, 0, sizeof chip);
    map_registers();
    fake.pin = 2;
    AT(TBCTL) = 0x0083;
    AT(SPIFFTX) = 0xA000;
    AT(PLLSTS) = MDL_MASK(PLLSTS, PLLLOCKS);
    AT(PIEACK) = 0;
}

uint32_t fake_peek(uint32_t address, uint32_t width)
{
    uint32_t low = chip.word[address];
    return width == 16 ? low : low | ((uint32_t)chip.word[address + 1] << 16);
}

/* --- time and what happens in it --- */

static uint32_t trigger_period(void)
{
    return (AT(TBPRD) + 1u) << GET(TBCTL, CLKDIV);
}

static uint16_t trigger_runs(void)
{
    return HAS(PCLKCR0, TBCLKSYNC) && HAS(PCLKCR1, EPWM1ENCLK) && HAS(ETSEL, SOCAEN) &&
           GET(ETSEL, SOCASEL) == 2 && GET(TBCTL, CTRMODE) == 0 && GET(ETPS, SOCAPRD) == 1;
}

static void start_conversion(void)
{
    if (!HAS(PCLKCR0, ADCENCLK) || AT(ADCTRL3) != 0x00E0 || !chip.calibrated ||
        fake.clock < chip.adc_powered_at + ADC_POWER_UP_CLOCKS) {
        violate("ADC used before it is clocked, calibrated and 5 ms after its power-up");
    }
    if (chip.converting) {
        return;
    }
    chip.converting = 1;
    fake.conversions++;
    chip.conversion_ends = fake.clock + CONVERSION_CLOCKS;
}

static void end_conversion(void)
{
    uint32_t from = fake.faults.adc_stuck_from;
    if ((from != 0 && fake.conversions >= from) || fake.conversions == fake.faults.adc_stuck_only) {
        chip.conversion_ends = UINT64_MAX;
        return;
    }
    chip.converting = 0;
    if (chip.slot == 0 && AT(ADCMAXCONV) == 1 && AT(ADCCHSELSEQ1) == 0x0010) {
        AT(ADCMIRROR0) = fake.drive ? fake.drive(fake.triggers) : 0;
        AT(ADCMIRROR1) = fake.sensor ? fake.sensor(fake.triggers) : 0;
    } else {
        violate("SEQ1 was not set up or not rewound: the results are elsewhere");
    }
    chip.slot = 2;
    if (HAS(ADCTRL2, INT_ENA_SEQ1) && !HAS(ADCST, INT_SEQ1)) {
        chip.word[f28335_at_PIEIFR] |= F28335_ADCINT_BIT; /* an edge: a flag left set gives none */
    }
    SET_FLAG(ADCST, INT_SEQ1);
}

static void end_word(void)
{
    if (fake.faults.dac_stuck_from != 0 && fake.dac_words + 1u >= fake.faults.dac_stuck_from) {
        chip.spi_ends = UINT64_MAX;
        return;
    }
    if (fake.dac_words < FAKE_DAC_LENGTH) {
        fake.dac_word[fake.dac_words] = chip.spi_word;
    }
    fake.dac_words++;
    SET_FLAG(SPISTS, INT_FLAG);
    chip.spi_shifting = HAS(SPISTS, BUFFULL_FLAG);
    if (chip.spi_shifting) {
        CLEAR_FLAG(SPISTS, BUFFULL_FLAG);
        chip.spi_word = AT(SPITXBUF);
        chip.spi_ends = fake.clock + 64u * (AT(SPIBRR) + 1u);
    }
}

static void trigger(void)
{
    fake.triggers++;
    SET_FLAG(ETFLG, SOCA);
    chip.next_trigger += trigger_period();
    if (HAS(ADCTRL2, EPWM_SOCA_SEQ1)) {
        start_conversion();
    }
}

static void interrupt(void)
{
    void (*handler)(void) = chip.vector[ADCINT_SLOT];
    uint16_t *flags = &chip.word[f28335_at_PIEIFR];
    if (!HAS(PIECTRL, ENPIE) || (*flags & chip.word[f28335_at_PIEIER]) == 0 || HAS(PIEACK, ACK1) ||
        (chip.ier & 1u) == 0 || !chip.interrupts_on || chip.in_interrupt) {
        return;
    }
    *flags = 0;
    SET_FLAG(PIEACK, ACK1);
    fake.interrupts++;
    if (handler == NULL) {
        violate("interrupt without a vector");
        return;
    }
    chip.in_interrupt = 1;
    handler();
    chip.in_interrupt = 0;
}

static void lock_pll(void)
{
    if (chip.pll_locks_at != 0 && fake.clock >= chip.pll_locks_at && !fake.faults.pll_never_locks) {
        chip.pll_locks_at = 0;
        SET_FLAG(PLLSTS, PLLLOCKS);
    }
}

/** The clock up to which nothing will happen by itself. */
static uint64_t quiet_until(void)
{
    uint64_t at = UINT64_MAX;
    if (chip.pll_locks_at != 0) {
        return 0;
    }
    if (chip.next_trigger != 0 && trigger_runs()) {
        at = chip.next_trigger;
    }
    if (chip.converting && chip.conversion_ends < at) {
        at = chip.conversion_ends;
    }
    if (chip.spi_shifting && chip.spi_ends < at) {
        at = chip.spi_ends;
    }
    return at;
}

void fake_spend(uint32_t clocks)
{
    fake.clock += clocks;
    if (fake.pin == 1) {
        fake.pin_high_clocks += clocks;
    }
    lock_pll();
    while (chip.next_trigger != 0 && fake.clock >= chip.next_trigger && trigger_runs()) {
        trigger();
    }
    if (chip.converting && fake.clock >= chip.conversion_ends) {
        end_conversion();
    }
    if (chip.spi_shifting && fake.clock >= chip.spi_ends) {
        end_word();
    }
    interrupt();
}

/* --- what writes do --- */

static uint16_t has_clock(uint32_t address)
{
    if (address >= 0x7100 && address < 0x7120) {
        return HAS(PCLKCR0, ADCENCLK);
    }
    if (address >= 0x6800 && address < 0x6840) {
        return HAS(PCLKCR1, EPWM1ENCLK);
    }
    if (address >= 0x7040 && address < 0x7050) {
        return HAS(PCLKCR0, SPIAENCLK);
    }
    return 1;
}

static void store(uint32_t address, uint32_t width, uint32_t value)
{
    chip.word[address] = (uint16_t)value;
    if (width == 32) {
        chip.word[address + 1] = (uint16_t)(value >> 16);
    }
}

static void set_pin(uint16_t level, uint32_t bits)
{
    if ((bits & 1u) == 0) {
        return;
    }
    if (fake_peek(f28335_at_GPBDIR, 32) & 1u) {
        fake.pin_edges += fake.pin != level;
        fake.pin = level;
    } else {
        fake.pin = level == 0 ? 3 : 4; /* latched: shows when the pin becomes an output */
    }
}

static void write_adctrl2(uint16_t value)
{
    if (value & MDL_MASK(ADCTRL2, RST_SEQ1)) {
        chip.slot = 0;
        chip.converting = 0;
    }
    AT(ADCTRL2) = value & (uint16_t) ~(MDL_MASK(ADCTRL2, RST_SEQ1) | MDL_MASK(ADCTRL2, SOC_SEQ1));
    if (value & MDL_MASK(ADCTRL2, SOC_SEQ1)) {
        start_conversion();
    }
}

static void write_spitxbuf(uint16_t value)
{
    if (!HAS(SPICCR, SPISWRESET)) {
        violate("a word was given to an SPI in reset");
    } else if (chip.spi_shifting) {
        if (HAS(SPISTS, BUFFULL_FLAG)) {
            violate("a word was written over another in the SPI's buffer");
        }
        SET_FLAG(SPISTS, BUFFULL_FLAG);
    } else {
        chip.spi_shifting = 1;
        chip.spi_word = value;
        chip.spi_ends = fake.clock + 64u * (AT(SPIBRR) + 1u);
    }
    AT(SPITXBUF) = value;
}

static void write_pllcr(uint16_t value)
{
    if (GET(PLLSTS, DIVSEL) != 0 || !HAS(PLLSTS, MCLKOFF)) {
        violate("PLLCR written with DIVSEL or clock-loss detection on");
        return;
    }
    AT(PLLCR) = value;
    CLEAR_FLAG(PLLSTS, PLLLOCKS);
    chip.pll_locks_at = fake.clock + PLL_LOCK_CLOCKS;
}

static void write_pclkcr0(uint16_t value)
{
    uint16_t ran = trigger_runs();
    AT(PCLKCR0) = value;
    if (!ran && trigger_runs()) {
        fake.started = fake.clock;
        fake.accesses_of_set_up = fake.accesses;
        chip.next_trigger = fake.clock + trigger_period();
    }
}

static void write_status_of_pll(uint16_t value)
{
    uint16_t held = AT(PLLSTS) & (MDL_MASK(PLLSTS, PLLLOCKS) | MDL_MASK(PLLSTS, MCLKSTS));
    if ((value & MDL_MASK(PLLSTS, DIVSEL)) != 0 && !HAS(PLLSTS, PLLLOCKS)) {
        violate("clock raised before the PLL has locked");
    }
    AT(PLLSTS) = (uint16_t)(held | (value & 0x01C0u));
}

static void act(uint32_t address, uint32_t width, uint32_t value)
{
    uint16_t v = (uint16_t)value;
    switch (address) {
    case f28335_at_PLLSTS:
        write_status_of_pll(v);
        break;
    case f28335_at_PLLCR:
        write_pllcr(v);
        break;
    case f28335_at_PCLKCR0:
        write_pclkcr0(v);
        break;
    case f28335_at_ADCTRL2:
        write_adctrl2(v);
        break;
    case f28335_at_ADCTRL3:
        chip.adc_powered_at = fake.clock;
        store(address, width, value);
        break;
    case f28335_at_ADCST:
        if (v & MDL_MASK(ADCST, INT_SEQ1_CLR)) {
            CLEAR_FLAG(ADCST, INT_SEQ1);
        }
        break;
    case f28335_at_ETCLR:
        AT(ETFLG) &= (uint16_t)~v;
        break;
    case f28335_at_PIEACK:
        AT(PIEACK) &= (uint16_t)~v; /* ones acknowledge */
        break;
    case f28335_at_SPITXBUF:
        write_spitxbuf(v);
        break;
    case f28335_at_GPBSET:
        set_pin(1, value);
        break;
    case f28335_at_GPBCLEAR:
        set_pin(0, value);
        break;
    case f28335_at_GPBDIR:
        store(address, width, value);
        if (value & 1u) {
            if (fake.pin != 3) {
                violate("the timing pin became an output before it was cleared");
            }
            fake.pin = 0;
        }
        break;
    default:
        store(address, width, value);
    }
}

/* --- what f28335_io.h calls --- */

static uint16_t is_dead(void)
{
    return fake.faults.dead_after != 0 && fake.accesses > fake.faults.dead_after;
}

static const entry *find(uint32_t address, uint32_t width)
{
    static const entry unknown = {"?", 0, 0};
    const entry *found = address < WORDS ? &chip.map[address] : &unknown;
    if (found->name == NULL || found->width != width) {
        violate("access to a register that is not in the table, or in another width");
        return &unknown;
    }
    return found;
}

uint32_t fake_read(uint32_t address, uint32_t width)
{
    const entry *reg = find(address, width);
    uint32_t value;
    fake.accesses++;
    if (address == f28335_at_ADCMIRROR0 && !is_dead()) {
        fake_spend(fake.compute_clocks);
    }
    fake_spend(READ_CLOCKS);
    if (fake.faults.crystal_missing) {
        SET_FLAG(PLLSTS, MCLKSTS);
    }
    value = fake_peek(address, width);
    if (is_dead()) {
        value = fake.faults.dead_value;
    } else if (!has_clock(address)) {
        violate("a peripheral without clock was read");
    }
    if (address == f28335_at_SPIRXBUF) {
        CLEAR_FLAG(SPISTS, INT_FLAG);
    }
    note(FAKE_READ, reg->name, address, value);
    return value;
}

void fake_write(uint32_t address, uint32_t width, uint32_t value)
{
    const entry *reg = find(address, width);
    fake.accesses++;
    note(FAKE_WRITE, reg->name, address, value);
    if (reg->is_protected && !chip.eallow) {
        violate("a protected register was written without EALLOW");
    } else if (!has_clock(address)) {
        if (!is_dead()) {
            violate("a peripheral without clock was written");
        }
    } else if (!is_dead()) {
        act(address, width, value);
    }
    fake_spend(WRITE_CLOCKS);
}

void fake_write_bus(uint32_t address, uint32_t value)
{
    note(FAKE_BUS, "bus", address, value);
    if (fake.dac_words < FAKE_DAC_LENGTH) {
        fake.dac_word[fake.dac_words] = (uint16_t)value;
    }
    fake.dac_words++;
    fake_spend(WRITE_CLOCKS);
}

void fake_set_vector(uint32_t slot, void (*function)(void))
{
    fake_write((uint32_t)(f28335_at_PIEVECT + 2u * slot), 32, slot);
    chip.vector[slot] = function;
}

void fake_write_ier(uint32_t value)
{
    note(FAKE_IER, "IER", 0, value);
    chip.ier = (uint16_t)value;
}

void fake_write_ifr(uint32_t value)
{
    note(FAKE_IFR, "IFR", 0, value);
}

void fake_eallow(uint16_t on)
{
    note(FAKE_EALLOW, on ? "EALLOW" : "EDIS", 0, on);
    if (chip.eallow == on) {
        violate("EALLOW and EDIS do not alternate");
    }
    chip.eallow = on;
}

void fake_interrupts(uint16_t on)
{
    note(FAKE_INTERRUPTS, on ? "interrupts on" : "interrupts off", 0, on);
    chip.interrupts_on = on;
    fake_spend(NOP_CLOCKS);
}

void fake_nop(void)
{
    fake_event *last = &fake.log[fake.logged > 0 ? fake.logged - 1u : 0];
    if (last->kind == FAKE_WAIT && fake.clock + NOP_CLOCKS < chip.quiet_until) {
        last->value += NOP_CLOCKS; /* a long wait, in which millions of these come */
        fake.clock += NOP_CLOCKS;
        return;
    }
    chip.quiet_until = fake.pin == 1 ? 0 : quiet_until();
    note(FAKE_WAIT, "wait", 0, NOP_CLOCKS);
    fake_spend(NOP_CLOCKS);
}

void fake_calibrate_adc(void)
{
    note(FAKE_CALIBRATION, "ADC_cal", 0, 0);
    if (!HAS(PCLKCR0, ADCENCLK) || !chip.eallow) {
        violate("ADC_cal without the ADC's clock or without EALLOW");
    }
    chip.calibrated = 1;
}

void fake_copy_ram_functions(void)
{
    note(FAKE_COPY, "copy", 0, 0);
}

uint16_t fake_keeps_running(void)
{
    uint64_t end = fake.started + fake.run_clocks;
    uint64_t next = quiet_until() < end ? quiet_until() : end;
    if (chip.eallow) {
        violate("EALLOW left on");
    }
    if (next > fake.clock) {
        fake_spend((uint32_t)(next - fake.clock)); /* nothing to idle for */
    }
    return fake.clock < end;
}
