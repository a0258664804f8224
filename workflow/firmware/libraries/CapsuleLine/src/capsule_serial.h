/* The first UART at 115200 baud 8N1. Interrupts drive it, so that the processor can sleep. */
#ifndef CAPSULE_SERIAL_H
#define CAPSULE_SERIAL_H

#include <stdbool.h>
#include <stdint.h>

#include "capsule_frame.h"

void serial_begin(void);
bool serial_available(void); /* return whether a byte was received */
char serial_read(void);      /* only after serial_available() */
void serial_send(frame_t *frame); /* finishes the frame and queues it */

/* Sleep until an interrupt, unless a byte was received or an interrupt has set `other_work`. */
void serial_sleep(const volatile bool *other_work); /* may be NULL */

#endif
