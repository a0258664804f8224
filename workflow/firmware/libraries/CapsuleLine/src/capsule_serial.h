/* The first UART, 115200 baud 8N1, driven by interrupts so that the processor can sleep. */
#ifndef CAPSULE_SERIAL_H
#define CAPSULE_SERIAL_H

#include <stdbool.h>
#include <stdint.h>

#include "capsule_frame.h"

void serial_begin(void);
bool serial_available(void); /* a byte has come in */
char serial_read(void);      /* only after serial_available() */
void serial_send(frame_t *frame); /* finishes the frame and queues it */

/* Sleep until an interrupt, unless a byte has come in, or an interrupt has left other work. */
void serial_sleep(const volatile bool *other_work); /* may be NULL */

#endif
