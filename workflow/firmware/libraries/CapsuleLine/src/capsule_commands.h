/* Commands as they come in, and the answers that both boards give in the same words. */
#ifndef CAPSULE_COMMANDS_H
#define CAPSULE_COMMANDS_H

#include "capsule_frame.h"

/* Let the board obey each command that has come in whole, and answer whatever else has come in;
 * `send_identity` answers a bare "?". */
void receive_commands(void (*obey)(char *command), void (*send_identity)(void));

/* Begin the frame by which a board says who it is; the board adds its own numbers. */
void start_identity(frame_t *frame, const char *device, const char *firmware_version);

void acknowledge(const char *command, const char *argument); /* an empty one is not repeated */
void refuse(const char *command, const char *reason);

#endif
