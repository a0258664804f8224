/* Fold board: folds and unfolds the capsule's origami, on an Arduino UNO.
 *
 * A 28BYJ-48 motor behind a ULN2003 winds a thread; two end switches mark its ends. The interrupt
 * of Timer1 reads the switches, decides and makes each half-step (origami.c). This file receives
 * commands, reports the state and sleeps. It resets the watchdog only while that interrupt comes.
 * After a restart the board unfolds the origami. Commands and frames: docs/protocol.md; wiring:
 * docs/bench.md. */
#if !__has_include(<capsule_frame.h>)
#error "Arduino IDE: set File > Preferences > Sketchbook location to workflow/firmware"
#endif
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <capsule_commands.h>
#include <capsule_frame.h>
#include <capsule_motor.h>
#include <capsule_serial.h>
#include <capsule_switch.h>
#include <stddef.h>
#include <string.h>

#include "memory.h"
#include "origami.h"

#define FIRMWARE_VERSION "1.2"

#define UNFOLDED_PIN PD2 /* digital pins 2 and 3 */
#define FOLDED_PIN PD3

#define REPORT_MS 1000      /* while the origami is unfolded */
#define REPORT_OFTEN_MS 200 /* in all other states */

static const char *const STATE_NAMES[] = {
    [UNFOLDED] = "unfolded",   [FOLDING] = "folding", [FOLDED] = "folded",
    [UNFOLDING] = "unfolding", [FAULT] = "fault",
};
static const char *const SWITCH_NAMES[] = {
    [NONE_CLOSED] = "none",
    [UNFOLDED_CLOSED] = "unfolded",
    [FOLDED_CLOSED] = "folded",
    [BOTH_CLOSED] = "both",
};

/* The interrupt writes these; the main program disables interrupts while it reads them. */
static origami_t origami;
static uint32_t uptime_ms;

typedef struct {
    uint32_t uptime_ms;
    int32_t half_steps;
    switches_t switches;
    origami_state_t state;
    const char *reason;
    bool known;
    bool set_up;
} report_t;

static bool is_pressed(uint8_t pin) {
    bool high = PIND & 1 << pin;
    return high == NORMALLY_CLOSED;
}

ISR(TIMER1_COMPA_vect) {
    static bool odd;
    odd = !odd;
    uptime_ms += odd ? 2 : 3; /* ticks of 2.5 ms */
    origami_tick(&origami, (is_pressed(UNFOLDED_PIN) ? UNFOLDED_CLOSED : 0) |
                               (is_pressed(FOLDED_PIN) ? FOLDED_CLOSED : 0));
    if (origami.coils) {
        motor_hold(origami.rotor);
    } else {
        motor_release();
    }
}

static void begin_ticks(void) {
    PORTD |= 1 << UNFOLDED_PIN | 1 << FOLDED_PIN; /* pull-ups */
    motor_begin();
    TCCR1A = 0;
    TCCR1B = 1 << WGM12 | 1 << CS11 | 1 << CS10; /* clear on compare, F_CPU / 64 */
    OCR1A = F_CPU / 64 * TICK_US / 1000000 - 1;
    TIMSK1 = 1 << OCIE1A;
}

static report_t look(void) {
    cli();
    report_t report = {
        .uptime_ms = uptime_ms,
        .half_steps = origami.half_steps,
        .switches = origami.switches,
        .state = origami.state,
        .reason = origami.reason,
        .known = origami.known,
        .set_up = origami.set_up,
    };
    sei();
    return report;
}

static void send_identity(void) {
    report_t report = look();
    frame_t frame;
    start_identity(&frame, "fold", FIRMWARE_VERSION);
    frame_add_key(&frame, "lease_ms");
    frame_add_count(&frame, LEASE_MS);
    frame_add_key(&frame, "longest_ms");
    frame_add_count(&frame, LONGEST_MS);
    frame_add_key(&frame, "state");
    frame_append(&frame, STATE_NAMES[report.state]);
    frame_add_key(&frame, "setup");
    frame_append(&frame, report.set_up ? "yes" : "no");
    frame_add_key(&frame, "uptime_ms");
    frame_add_count(&frame, report.uptime_ms);
    serial_send(&frame);
}

static void send_state(const report_t *report) {
    frame_t frame;
    frame_start(&frame, "F");
    frame_add_count(&frame, report->uptime_ms);
    frame_add_signed(&frame, report->half_steps);
    frame_add_text(&frame, SWITCH_NAMES[report->switches]);
    frame_add_text(&frame, STATE_NAMES[report->state]);
    serial_send(&frame);
}

/* Report each change at once, and an unchanged state at intervals. */
static void report_changes(void) {
    static report_t last;
    report_t report = look();
    uint16_t period_ms = report.state == UNFOLDED ? REPORT_MS : REPORT_OFTEN_MS;
    if (report.known == last.known && report.state == last.state &&
        report.switches == last.switches && report.uptime_ms - last.uptime_ms < period_ms) {
        return;
    }
    if (!last.known) {
        send_identity();
    }
    send_state(&report);
    if (report.state == FAULT && last.state != FAULT) {
        refuse("fold", report.reason);
    }
    last = report;
}

/* Each function obeys one command. If it answers by itself, it returns false. */

static bool answer(const char *command, const char *(*obey)(origami_t *)) {
    cli();
    const char *reason = obey(&origami);
    uint8_t wait_s = origami_wait_s(&origami);
    sei();
    if (!reason) {
        return true;
    }
    frame_t frame;
    frame_start(&frame, "E");
    frame_add_text(&frame, command);
    frame_add_text(&frame, reason);
    if (reason == MOTOR_HAS_TO_REST) {
        frame_append(&frame, " for ");
        frame_append_count(&frame, wait_s);
        frame_append(&frame, " s");
    }
    serial_send(&frame);
    return false;
}

static bool fold(const char *argument) {
    (void)argument;
    return answer("fold", origami_fold);
}

static bool hold(const char *argument) {
    (void)argument;
    return answer("hold", origami_hold);
}

static bool unfold(const char *argument) {
    (void)argument;
    return answer("unfold", origami_unfold);
}

static bool set_up(const char *argument) {
    if (strcmp(argument, "unfolded") != 0) {
        refuse("setup", "wants unfolded");
        return false;
    }
    return answer("setup", origami_set_up);
}

static bool state(const char *argument) {
    (void)argument;
    report_t report = look();
    send_state(&report);
    return false; /* the state is the answer */
}

static bool identify(const char *argument) {
    (void)argument;
    send_identity();
    return false;
}

static const command_t COMMANDS[] = {
    {"identify", false, identify}, {"state", false, state},   {"fold", false, fold},
    {"hold", false, hold},         {"unfold", false, unfold},
    {"setup", true, set_up},
};

static void obey(char *command) {
    obey_one_of(COMMANDS, sizeof COMMANDS / sizeof *COMMANDS, command,
                "unknown; fold knows identify state fold hold unfold setup");
}

/* Store the record of a move before it starts, and of its end; the motor waits meanwhile. */
static void store(void) {
    cli();
    record_t record = origami.record;
    bool has_to = origami_has_to_store(&origami);
    sei();
    if (!has_to) {
        return;
    }
    bool stored = memory_write(&record);
    cli();
    if (stored) {
        origami_stored(&origami, record.sequence);
    } else {
        origami_not_stored(&origami);
    }
    sei();
    if (!stored) {
        refuse("fold", MEMORY_FAILS);
    }
}

/* The watchdog restarts the board if the main program hangs or the interrupt stops. */
static void feed_watchdog(void) {
    static uint32_t last_ms;
    uint32_t now_ms = look().uptime_ms;
    if (now_ms != last_ms) {
        last_ms = now_ms;
        wdt_reset();
    }
}

int main(void) {
    MCUSR = 0; /* else the watchdog would keep its shortest time after it restarted the board */
    wdt_enable(WDTO_250MS);
    set_sleep_mode(SLEEP_MODE_IDLE);
    serial_begin();
    record_t record;
    origami_begin(&origami, memory_read(&record) ? &record : NULL);
    begin_ticks();
    sei();
    for (;;) {
        feed_watchdog();
        report_changes();
        receive_commands(obey, send_identity);
        store();
        serial_sleep(NULL);
    }
}
