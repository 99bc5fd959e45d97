/* The handlers that an image may have of its own. */
#ifndef RECOIL_STARTUP_H
#define RECOIL_STARTUP_H

int main(void);
_Noreturn void reset_handler(void);
void panic_handler(void); /* any fault of the processor, any interrupt that nobody asked for */
void tick_handler(void);  /* SysTick */
void usart1_handler(void);
void usart2_handler(void);

#endif
