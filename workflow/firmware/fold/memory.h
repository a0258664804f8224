/* The EEPROM of the fold board: one record, in two slots in turn.
 *
 * A power cut damages only the slot that is being written; the other holds the record before. */
#ifndef MEMORY_H
#define MEMORY_H

#include <stdbool.h>

#include "origami.h"

#define SLOT_BYTES 16

/* Read the newest valid record; return false if there is none. */
bool memory_read(record_t *record);

/* Write a record, in 41 ms; return whether the memory then holds it. */
bool memory_write(record_t *record);

#endif
