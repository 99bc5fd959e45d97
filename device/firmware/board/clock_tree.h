/* The chip's clocks and its supply voltage, from reset on. */
#ifndef RECOIL_CLOCK_TREE_H
#define RECOIL_CLOCK_TREE_H

#include <stdbool.h>

/* Processor 168 MHz, APB1 42 MHz, APB2 84 MHz, their timers twice that; false if they do not come: nothing is timed. */
bool clock_tree_start(void);

#endif
