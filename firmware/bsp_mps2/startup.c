/* Reset and the vector table of the Cortex-M4F. */
#include "semihosting.h"

extern uint32_t ld_data_load[], ld_data_start[], ld_data_end[], ld_bss_start[], ld_bss_end[];
extern uint32_t ld_stack_top[];

int main(void);
void reset(void);
void fault(void);
void sample_tick(void);

#define CPACR (*(volatile uint32_t *)0xE000ED88u)

void reset(void)
{
    const uint32_t *from = ld_data_load;
    uint32_t *to;
    CPACR |= 0xFu << 20; /* the FPU, before any code that may use it */
    __asm__ volatile("dsb\n\tisb" ::: "memory");
    for (to = ld_data_start; to < ld_data_end; to++) {
        *to = *from++;
    }
    for (to = ld_bss_start; to < ld_bss_end; to++) {
        *to = 0;
    }
    semihosting_exit((uint32_t)main());
}

void fault(void)
{
    semihosting_print("fault\n");
    semihosting_exit(70);
}

/* An image without a sample clock, such as that of the comparison, has no such interrupt. */
__attribute__((weak)) void sample_tick(void)
{
    fault();
}

typedef void (*handler)(void);

typedef struct {
    uint32_t *stack;
    handler handlers[15]; /* from reset, vector 1, to SysTick, vector 15 */
} vector_table;

__attribute__((section(".vectors"), used)) static const vector_table vectors = {
    ld_stack_top,
    {reset, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, fault, sample_tick}};
