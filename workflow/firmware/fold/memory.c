#include "memory.h"

#include <avr/eeprom.h>
#include <stddef.h>
#include <string.h>
#include <util/crc16.h>

_Static_assert(sizeof(record_t) <= SLOT_BYTES, "a slot holds a record");

static uint8_t next; /* slot of the next record: not that of the newest valid one */

static uint16_t check(const record_t *record) {
    uint16_t crc = 0xFFFF;
    for (uint8_t i = 0; i < offsetof(record_t, check); i++) {
        crc = _crc_xmodem_update(crc, ((const uint8_t *)record)[i]);
    }
    return crc;
}

static void *slot(uint8_t number) {
    return (void *)(uintptr_t)(number * SLOT_BYTES);
}

bool memory_read(record_t *record) {
    bool found = false;
    for (uint8_t i = 0; i < 2; i++) {
        record_t read;
        eeprom_read_block(&read, slot(i), sizeof read);
        if (read.check == check(&read) && (!found || read.sequence > record->sequence)) {
            *record = read;
            next = !i;
            found = true;
        }
    }
    return found;
}

bool memory_write(record_t *record) {
    record->check = check(record);
    eeprom_update_block(record, slot(next), sizeof *record);
    record_t read;
    eeprom_read_block(&read, slot(next), sizeof read);
    if (memcmp(&read, record, sizeof read) != 0) {
        return false;
    }
    next = !next;
    return true;
}
