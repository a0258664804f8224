#include "capsule_commands.h"

#include <string.h>

#include "capsule_serial.h"

void obey_one_of(const command_t *commands, uint8_t count, char *command, const char *unknown) {
    char *argument = split_argument(command);
    for (uint8_t i = 0; i < count; i++) {
        if (strcmp(command, commands[i].name) != 0) {
            continue;
        }
        if (*argument && !commands[i].takes_argument) {
            refuse(command, "takes no argument");
        } else if (commands[i].obey(argument)) {
            acknowledge(command, argument);
        }
        return;
    }
    refuse(command, unknown);
}

void receive_commands(void (*obey)(char *command), void (*send_identity)(void)) {
    static receiver_t receiver;
    received_t received = RECEIVED_NOTHING;
    while (received == RECEIVED_NOTHING && serial_available()) {
        received = receive_byte(&receiver, serial_read());
        switch (received) {
        case RECEIVED_COMMAND:
            obey(receiver.text);
            break;
        case RECEIVED_QUESTION:
            send_identity();
            break;
        case RECEIVED_DAMAGED:
            refuse("line", "failed its check");
            break;
        case RECEIVED_NOTHING:
            break;
        }
    }
}

void start_identity(frame_t *frame, const char *device, const char *firmware_version) {
    frame_start(frame, "I");
    frame_add_text(frame, device);
    frame_add_text(frame, "protocol=1");
    frame_add_key(frame, "firmware");
    frame_append(frame, firmware_version);
}

void acknowledge(const char *command, const char *argument) {
    frame_t frame;
    frame_start(&frame, "A");
    frame_add_text(&frame, command);
    if (*argument) {
        frame_add_text(&frame, argument);
    }
    serial_send(&frame);
}

void refuse(const char *command, const char *reason) {
    frame_t frame;
    frame_start(&frame, "E");
    frame_add_text(&frame, command);
    frame_add_text(&frame, reason);
    serial_send(&frame);
}
