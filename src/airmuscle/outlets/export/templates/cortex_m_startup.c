/* Start of a program on a Cortex-M that is emulated: vectors, floating-point unit, and input and output by
   semihosting. The emulator loads all sections, and its memory is zero at first. */
#include <stdint.h>
#include <stdlib.h>

extern void initialise_monitor_handles(void);
extern int main(void);
extern char stack_top;

void _init(void); /* called by the C library; nothing to do */
void _init(void) {}
void _fini(void);
void _fini(void) {}

static void start(void)
{
  *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* CPACR: access to the floating-point unit */
  __asm volatile("dsb\n\tisb");
  initialise_monitor_handles();
  exit(main());
}

static void fail(void)
{
  _Exit(3);
}

__attribute__((section(".vectors"), used)) static void *const vectors[] = {
  &stack_top, (void *)start, (void *)fail, (void *)fail, (void *)fail, (void *)fail, (void *)fail,
};
