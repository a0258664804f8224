/* Commands as they come in, and the answers that all boards give in the same words. */
#ifndef CAPSULE_COMMANDS_H
#define CAPSULE_COMMANDS_H

#include <stdbool.h>

#include "capsule_frame.h"

/* A command that a board knows. */
typedef struct {
    const char *name;
    bool takes_argument;
    bool (*obey)(const char *argument); /* false where it has answered already */
} command_t;

/* Let the board obey one of the commands that it knows; `unknown` answers any other. */
void obey_one_of(const command_t *commands, uint8_t count, char *command, const char *unknown);

/* Let the board obey the next command that has come in whole, or answer whatever else has come in;
 * `send_identity` answers a bare "?". One line a call: many do not keep a board from its work. */
void receive_commands(void (*obey)(char *command), void (*send_identity)(void));

/* Begin the frame by which a board says who it is; the board adds its own numbers. */
void start_identity(frame_t *frame, const char *device, const char *firmware_version);

void acknowledge(const char *command, const char *argument); /* an empty one is not repeated */
void refuse(const char *command, const char *reason);

#endif
