#include "capsule_frame.h"

#include <stdlib.h>
#include <string.h>
#include <util/crc16.h>

#define CHECK_LENGTH 6 /* "*", four digits, line feed */

static const char HEX_DIGITS[] = "0123456789ABCDEF";

/* CRC-16/CCITT-FALSE: polynomial 0x1021, initial value 0xFFFF, not reflected. avr-libc has its step
 * as XMODEM, which differs in the initial value only. */
static uint16_t checksum(const char *text, uint8_t length) {
    uint16_t crc = 0xFFFF;
    for (uint8_t i = 0; i < length; i++) {
        crc = _crc_xmodem_update(crc, (uint8_t)text[i]);
    }
    return crc;
}

static void put(frame_t *frame, char byte) {
    if (frame->length < FRAME_CAPACITY - CHECK_LENGTH) {
        frame->text[frame->length++] = byte;
    }
}

void frame_append(frame_t *frame, const char *text) {
    while (*text) {
        put(frame, *text++);
    }
}

void frame_start(frame_t *frame, const char *kind) {
    frame->length = 0;
    put(frame, '$');
    frame_append(frame, kind);
}

void frame_add_text(frame_t *frame, const char *text) {
    put(frame, ',');
    frame_append(frame, text);
}

void frame_add_key(frame_t *frame, const char *key) {
    frame_add_text(frame, key);
    put(frame, '=');
}

/* Add a comma, except directly after "key=". */
static void separate(frame_t *frame) {
    if (frame->text[frame->length - 1] != '=') {
        put(frame, ',');
    }
}

void frame_append_count(frame_t *frame, uint32_t value) {
    char digits[11];
    frame_append(frame, ultoa(value, digits, 10));
}

void frame_add_count(frame_t *frame, uint32_t value) {
    separate(frame);
    frame_append_count(frame, value);
}

void frame_add_signed(frame_t *frame, int32_t value) {
    char digits[12];
    separate(frame);
    frame_append(frame, ltoa(value, digits, 10));
}

void frame_append_thousandths(frame_t *frame, int64_t value) {
    uint64_t magnitude = value < 0 ? 0 - (uint64_t)value : (uint64_t)value;
    uint16_t rest = magnitude % 1000;
    if (value < 0) {
        put(frame, '-');
    }
    frame_append_count(frame, (uint32_t)(magnitude / 1000));
    put(frame, '.');
    for (uint16_t place = 100; place > 0; place /= 10) {
        put(frame, (char)('0' + rest / place % 10));
    }
}

void frame_add_thousandths(frame_t *frame, int64_t value) {
    separate(frame);
    frame_append_thousandths(frame, value);
}

void frame_finish(frame_t *frame) {
    uint16_t crc = checksum(frame->text + 1, frame->length - 1);
    frame->text[frame->length++] = '*';
    for (int8_t shift = 12; shift >= 0; shift -= 4) {
        frame->text[frame->length++] = HEX_DIGITS[crc >> shift & 0xF];
    }
    frame->text[frame->length++] = '\n';
}

/* Check "$payload*ABCD", and keep only the payload, as a string. */
static bool take_payload(receiver_t *receiver) {
    char *text = receiver->text;
    if (receiver->overflowed || receiver->length < CHECK_LENGTH || text[0] != '$') {
        return false;
    }
    uint8_t star = receiver->length - 5;
    if (text[star] != '*') {
        return false;
    }
    uint16_t crc = checksum(text + 1, star - 1);
    for (uint8_t i = 0; i < 4; i++) {
        if (text[star + 1 + i] != HEX_DIGITS[crc >> (12 - 4 * i) & 0xF]) {
            return false;
        }
    }
    memmove(text, text + 1, star - 1);
    text[star - 1] = '\0';
    return true;
}

received_t receive_byte(receiver_t *receiver, char byte) {
    if (byte == '\r') {
        return RECEIVED_NOTHING; /* terminals send a carriage return before the line feed */
    }
    if (byte == '$') { /* always begins a new frame: the one before was cut off */
        receiver->length = 0;
        receiver->overflowed = false;
    }
    if (byte != '\n') {
        if (receiver->length < COMMAND_CAPACITY) {
            receiver->text[receiver->length++] = byte;
        } else {
            receiver->overflowed = true;
        }
        return RECEIVED_NOTHING;
    }
    received_t received = RECEIVED_DAMAGED;
    if (receiver->length == 0) {
        received = RECEIVED_NOTHING;
    } else if (receiver->length == 1 && receiver->text[0] == '?') {
        received = RECEIVED_QUESTION;
    } else if (take_payload(receiver)) {
        received = RECEIVED_COMMAND;
    }
    receiver->length = 0;
    receiver->overflowed = false;
    return received;
}

char *split_argument(char *command) {
    char *comma = strchr(command, ',');
    if (comma == NULL) {
        return command + strlen(command);
    }
    *comma = '\0';
    return comma + 1;
}

bool parse_thousandths(const char *text, int32_t *thousandths) {
    int32_t value = 0;
    uint8_t digits = 0;
    int8_t decimals = -1; /* -1 until the point */
    for (; *text; text++) {
        if (*text == '.' && decimals < 0 && digits > 0) {
            decimals = 0;
        } else if (*text >= '0' && *text <= '9' && digits < 8 && decimals < 3) {
            value = value * 10 + (*text - '0');
            digits++;
            decimals += decimals >= 0;
        } else {
            return false;
        }
    }
    if (digits == 0 || decimals == 0) {
        return false;
    }
    for (int8_t place = decimals < 0 ? 0 : decimals; place < 3; place++) {
        if (value > INT32_MAX / 10) {
            return false;
        }
        value *= 10;
    }
    *thousandths = value;
    return true;
}
