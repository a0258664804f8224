/* Peristalsis board: turns the cam shafts of the phantom, on an Arduino UNO.
 *
 * A 28BYJ-48 motor behind a ULN2003 drives a wave of 80 mm along the walls at a set speed. The
 * interrupt of Timer1 makes every step and checks the lease (motion.c). This file receives commands and sleeps.
 * It resets the watchdog only while that interrupt comes.
 * Commands and frames: docs/protocol.md; wiring, cam and gearing: docs/bench.md. */
#if !__has_include(<capsule_frame.h>)
#error "Arduino IDE: set File > Preferences > Sketchbook location to workflow/firmware"
#endif
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <capsule_commands.h>
#include <capsule_frame.h>
#include <capsule_serial.h>
#include <string.h>

#include "motion.h"

#define FIRMWARE_VERSION "1.3"
#define MIN_LEASE_MS 1000
#define MAX_LEASE_MS 60000
#define DEFAULT_LEASE_MS 60000 /* a computer that died lets the motor run no longer */

static const char *const STATE_NAMES[] = {"stopped", "running", "stopping"};

static void send_identity(void) {
    motion_t motion = motion_read();
    frame_t frame;
    start_identity(&frame, "peristalsis", FIRMWARE_VERSION);
    frame_add_key(&frame, "wavelength_mm");
    frame_add_thousandths(&frame, WAVELENGTH_UM);
    frame_add_key(&frame, "max_mm_s");
    frame_add_thousandths(&frame, motion_max_speed_um_s());
    frame_add_key(&frame, "state");
    frame_append(&frame, STATE_NAMES[motion.state]);
    frame_add_key(&frame, "index");
    if (motion.has_index) {
        frame_add_signed(&frame, motion.index);
    } else {
        frame_append(&frame, "none");
    }
    frame_add_key(&frame, "uptime_ms");
    frame_add_count(&frame, motion.uptime_ms);
    serial_send(&frame);
}

static void send_position(void) {
    motion_t motion = motion_read();
    frame_t frame;
    frame_start(&frame, "P");
    frame_add_count(&frame, motion.uptime_ms);
    frame_add_signed(&frame, motion.half_steps);
    frame_add_thousandths(&frame, motion.position_um);
    frame_add_thousandths(&frame, motion.speed_um_s);
    frame_add_text(&frame, STATE_NAMES[motion.state]);
    if (motion.has_index) {
        frame_add_signed(&frame, motion.index);
    } else {
        frame_add_text(&frame, "");
    }
    serial_send(&frame);
}

static void refuse_range(const char *command, int32_t low, int32_t high, const char *unit) {
    frame_t frame;
    frame_start(&frame, "E");
    frame_add_text(&frame, command);
    frame_add_text(&frame, "wants ");
    frame_append_thousandths(&frame, low);
    frame_append(&frame, " to ");
    frame_append_thousandths(&frame, high);
    frame_append(&frame, unit);
    serial_send(&frame);
}

/* Refuse a speed, and state the rate that the motor would need. */
static void refuse_speed(int32_t speed_um_s) {
    frame_t frame;
    frame_start(&frame, "E");
    frame_add_text(&frame, "speed");
    frame_add_text(&frame, "");
    frame_append_thousandths(&frame, speed_um_s);
    frame_append(&frame, " mm/s needs ");
    frame_append_count(&frame, motion_rate(speed_um_s));
    frame_append(&frame, " half-steps/s; the motor follows ");
    frame_append_count(&frame, MAX_RATE);
    frame_append(&frame, " (");
    frame_append_thousandths(&frame, motion_max_speed_um_s());
    frame_append(&frame, " mm/s)");
    serial_send(&frame);
}

/* Each function obeys one command. If it answers by itself, it returns false. */

static bool set_speed(const char *argument) {
    int32_t speed_um_s;
    if (!parse_thousandths(argument, &speed_um_s) || speed_um_s < MIN_SPEED_UM_S) {
        refuse_range("speed", MIN_SPEED_UM_S, motion_max_speed_um_s(), " mm/s");
        return false;
    }
    if (speed_um_s > motion_max_speed_um_s()) {
        refuse_speed(speed_um_s);
        return false;
    }
    motion_set_speed(speed_um_s);
    return true;
}

static bool set_ramp(const char *argument) {
    int32_t ramp_um_s2;
    if (!parse_thousandths(argument, &ramp_um_s2) || ramp_um_s2 < MIN_RAMP_UM_S2 ||
        ramp_um_s2 > MAX_RAMP_UM_S2) {
        refuse_range("ramp", MIN_RAMP_UM_S2, MAX_RAMP_UM_S2, " mm/s^2");
        return false;
    }
    motion_set_ramp(ramp_um_s2);
    return true;
}

static bool set_direction(const char *argument) {
    bool backward = strcmp(argument, "backward") == 0;
    if (!backward && strcmp(argument, "forward") != 0) {
        refuse("direction", "wants forward or backward");
        return false;
    }
    motion_set_backward(backward);
    return true;
}

static bool set_lease(const char *argument) {
    int32_t wanted_ms;
    if (!parse_thousandths(argument, &wanted_ms) ||
        (wanted_ms != 0 && (wanted_ms < MIN_LEASE_MS || wanted_ms > MAX_LEASE_MS))) {
        refuse_range("lease", MIN_LEASE_MS, MAX_LEASE_MS, " s, or 0 for none");
        return false;
    }
    motion_set_lease((uint32_t)wanted_ms);
    return true;
}

static bool start(const char *argument) {
    (void)argument;
    motion_start();
    return true;
}

static bool stop(const char *argument) {
    (void)argument;
    motion_stop();
    return true;
}

static bool identify(const char *argument) {
    (void)argument;
    send_identity();
    return false; /* the identity is the answer */
}

static bool position(const char *argument) {
    (void)argument;
    send_position();
    return false;
}

static const command_t COMMANDS[] = {
    {"identify", false, identify}, {"position", false, position},
    {"start", false, start},       {"stop", false, stop},
    {"speed", true, set_speed},    {"direction", true, set_direction},
    {"ramp", true, set_ramp},      {"lease", true, set_lease},
};

static void obey(char *command) {
    motion_renew_lease();
    obey_one_of(
        COMMANDS, sizeof COMMANDS / sizeof *COMMANDS, command,
        "unknown; peristalsis knows identify position start stop speed direction ramp lease");
}

int main(void) {
    MCUSR = 0; /* else the watchdog would keep its shortest time after it restarted the board */
    wdt_enable(WDTO_500MS); /* at rest the processor wakes every 0.26 s */
    wdt_reset(); /* the new time counts from here, also after a restart by the watchdog */
    set_sleep_mode(SLEEP_MODE_IDLE);
    serial_begin();
    motion_begin();
    motion_set_lease(DEFAULT_LEASE_MS);
    sei();
    send_identity();
    for (;;) {
        receive_commands(obey, send_identity);
        if (motion_goes_on()) {
            wdt_reset();
        }
        serial_sleep(NULL);
    }
}
