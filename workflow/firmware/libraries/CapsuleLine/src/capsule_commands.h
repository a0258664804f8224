/* Receive commands, and send the answers that are the same for all boards. */
#ifndef CAPSULE_COMMANDS_H
#define CAPSULE_COMMANDS_H

#include <stdbool.h>

#include "capsule_frame.h"

/* A command that a board knows. */
typedef struct {
    const char *name;
    bool takes_argument;
    bool (*obey)(const char *argument); /* returns false if it has answered by itself */
} command_t;

/* Obey a command if the board knows it, else refuse it with the text `unknown`. */
void obey_one_of(const command_t *commands, uint8_t count, char *command, const char *unknown);

/* Process the next received line: obey a command, or refuse a damaged line. `send_identity` answers
 * a bare "?". A call processes one line only, so that many lines do not block the board. */
void receive_commands(void (*obey)(char *command), void (*send_identity)(void));

/* Begin the frame of a board's identity, to which the board adds its own entries. */
void start_identity(frame_t *frame, const char *device, const char *firmware_version);

void acknowledge(const char *command, const char *argument); /* an empty argument is left out */
void refuse(const char *command, const char *reason);

#endif
