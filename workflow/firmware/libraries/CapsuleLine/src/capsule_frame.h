/* Frames of the serial line: "$", a payload, "*", four hexadecimal digits of CRC-16, line feed.
 *
 * docs/protocol.md describes them for boards and computer. */
#ifndef CAPSULE_FRAME_H
#define CAPSULE_FRAME_H

#include <stdbool.h>
#include <stdint.h>

#define FRAME_CAPACITY 160  /* bytes of the longest frame that a board sends */
#define COMMAND_CAPACITY 40 /* bytes of the longest command that a board accepts */

/* A frame under construction. */
typedef struct {
    char text[FRAME_CAPACITY];
    uint8_t length;
} frame_t;

void frame_start(frame_t *frame, const char *kind);
void frame_add_text(frame_t *frame, const char *text);
void frame_add_key(frame_t *frame, const char *key); /* the next value follows "key=" */
void frame_add_count(frame_t *frame, uint32_t value);
void frame_add_signed(frame_t *frame, int32_t value);
void frame_add_thousandths(frame_t *frame, int64_t value); /* 25000 is written 25.000 */
/* Append to the text of the last field; a frame's text never holds "$", "*" or a line feed. */
void frame_append(frame_t *frame, const char *text);
void frame_append_count(frame_t *frame, uint32_t value);
void frame_append_thousandths(frame_t *frame, int64_t value);
void frame_finish(frame_t *frame); /* adds the check; text and length are then ready to send */

/* The kind of line that the last byte completed. */
typedef enum {
    RECEIVED_NOTHING,
    RECEIVED_COMMAND,  /* a checked command, which is in `text` */
    RECEIVED_QUESTION, /* a bare "?", typed at a terminal */
    RECEIVED_DAMAGED   /* a line that failed its check */
} received_t;

/* A command that is being received. */
typedef struct {
    char text[COMMAND_CAPACITY + 1];
    uint8_t length;
    bool overflowed;
} receiver_t;

received_t receive_byte(receiver_t *receiver, char byte);

/* Split "name,argument", and return the argument; empty if there is none. */
char *split_argument(char *command);

/* Read "25", "25.5" or "25.125" as thousandths; return false for any other text. */
bool parse_thousandths(const char *text, int32_t *thousandths);

#endif
