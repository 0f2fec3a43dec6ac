#include "semihosting.h"

/* Operations and values of Arm's document "Semihosting for AArch32 and AArch64". */
enum {
    SYS_OPEN = 0x01,
    SYS_CLOSE = 0x02,
    SYS_WRITE0 = 0x04,
    SYS_WRITE = 0x05,
    SYS_READ = 0x06,
    SYS_FLEN = 0x0C,
    SYS_EXIT_EXTENDED = 0x20,
    OPEN_RB = 1,
    OPEN_WB = 5,
    STOPPED_APPLICATION_EXIT = 0x20026
};

static int32_t call(uint32_t operation, const void *block)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = block;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return (int32_t)r0;
}

static int32_t open_file(const char *name, uint32_t mode)
{
    uintptr_t block[3] = {(uintptr_t)name, mode, 0};
    while (name[block[2]] != '\0') {
        block[2]++;
    }
    return call(SYS_OPEN, block);
}

int32_t semihosting_load(const char *name, void *data, uint32_t capacity)
{
    uintptr_t block[3] = {(uintptr_t)open_file(name, OPEN_RB), (uintptr_t)data, capacity};
    int32_t length = call(SYS_FLEN, block);
    int32_t unread;
    if (length < 0 || (uint32_t)length > capacity) {
        return -1;
    }
    block[2] = (uint32_t)length;
    unread = call(SYS_READ, block);
    (void)call(SYS_CLOSE, block);
    return unread == 0 ? length : -1;
}

int32_t semihosting_create(const char *name)
{
    return open_file(name, OPEN_WB);
}

int32_t semihosting_write(int32_t handle, const void *data, uint32_t length)
{
    uintptr_t block[3] = {(uintptr_t)handle, (uintptr_t)data, length};
    return call(SYS_WRITE, block) == 0 ? 0 : -1;
}

int32_t semihosting_close(int32_t handle)
{
    uintptr_t block[1] = {(uintptr_t)handle};
    return call(SYS_CLOSE, block);
}

void semihosting_print(const char *text)
{
    (void)call(SYS_WRITE0, text);
}

void semihosting_exit(uint32_t code)
{
    uintptr_t block[2] = {STOPPED_APPLICATION_EXIT, code};
    for (;;) {
        (void)call(SYS_EXIT_EXTENDED, block);
    }
}
