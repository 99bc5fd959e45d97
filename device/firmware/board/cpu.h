/* The processor's own instructions (PM0214): interrupts held back, and sleep until one waits, held back or not. */
#ifndef RECOIL_CPU_H
#define RECOIL_CPU_H

#ifdef RECOIL_FAKE
void cpu_hold(void);
void cpu_release(void);
void cpu_sleep(void);
#else
static inline void cpu_hold(void)
{
    __asm__ volatile("cpsid i" ::: "memory");
}

static inline void cpu_release(void)
{
    __asm__ volatile("cpsie i" ::: "memory");
}

static inline void cpu_sleep(void)
{
    __asm__ volatile("dsb\n wfi" ::: "memory");
}
#endif

#endif
