#include "motion.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <capsule_motor.h>
#include <stdlib.h>

#define TICK_HZ (F_CPU / 64) /* of Timer1: 4 us */

#define INDEX_PIN PD3 /* digital pin 3: the switch connects it to ground once a turn of the cam */
#define INDEX_BEFORE 16 /* half-steps ahead of the index before a passage counts */
#define INDEX_AFTER 4   /* half-steps for which the switch must stay changed, to ignore spikes */

/* Rates are signed thousandths of a half-step/s, negative backward. */
#define START_RATE_MILLI (START_RATE * 1000L)

static volatile int32_t rate;      /* present rate; 0 at rest */
static volatile int32_t wanted;    /* target of the ramp */
static volatile uint16_t ramp;     /* half-steps/s^2 */
static volatile int32_t half_steps;
static volatile int32_t last_index; /* half-steps at the last passage of the cam shaft's index */
static volatile bool has_index;
static volatile uint32_t overflows; /* of Timer1: 0.262 s each */
static volatile uint32_t lease;      /* in ticks; 0: the wave never stops by itself */
static volatile uint32_t lease_left; /* the interrupt that steps counts it down */
static uint32_t remainder_ticks;    /* of step_ticks(), so that its errors do not add up */

static int32_t set_speed_um_s = DEFAULT_SPEED_UM_S;
static bool set_backward;

/* Search for the edge of the index switch at each half-step.
 *
 * At the index the switch closes on the way forward and opens on the way backward: both are the
 * same edge of the cam. Contacts bounce, so an edge counts only after the switch has stayed
 * changed. Its position is that of the first change. */
static void watch_index(bool forward) {
    static uint8_t before, after;
    static bool last_forward, passing;
    static int32_t candidate;
    bool closed = !(PIND & 1 << INDEX_PIN);
    if (forward != last_forward) {
        last_forward = forward;
        passing = false;
        before = 0;
    }
    if (closed != forward) { /* the index is ahead */
        after = 0;
        before += before < INDEX_BEFORE;
        passing = passing && before < INDEX_BEFORE;
        return;
    }
    if (before == INDEX_BEFORE) {
        candidate = half_steps;
        passing = true;
    }
    before = 0;
    after += after < INDEX_AFTER;
    if (passing && after == INDEX_AFTER) {
        last_index = candidate;
        has_index = true;
        passing = false;
    }
}

static uint16_t step_ticks(uint32_t magnitude) {
    uint32_t numerator = TICK_HZ * 1000UL + remainder_ticks;
    remainder_ticks = numerator % magnitude;
    return (uint16_t)(numerator / magnitude);
}

/* Move the rate towards the wanted one, as far as the ramp allows within one step. */
static int32_t ramped(int32_t now, int32_t target, uint16_t ticks) {
    int32_t change = (int32_t)((uint32_t)ramp * ticks / (TICK_HZ / 1000));
    int32_t next = now < target ? now + change : now - change;
    if (labs(target - now) <= change) {
        next = target;
    }
    if (labs(next) >= START_RATE_MILLI || next == target) {
        return next;
    }
    /* Below the first rate of the ramp, stop or change the direction. */
    if (target == 0) {
        return 0;
    }
    int32_t first = labs(target) < START_RATE_MILLI ? labs(target) : START_RATE_MILLI;
    return target > 0 ? first : -first;
}

ISR(TIMER1_COMPA_vect) {
    bool forward = rate > 0;
    half_steps += forward ? 1 : -1;
    motor_hold((uint8_t)half_steps);
    watch_index(forward);
    uint16_t ticks = step_ticks((uint32_t)labs(rate));
    if (lease_left > ticks) {
        lease_left -= ticks;
    } else if (lease) {
        wanted = 0; /* here, so that a main program that hangs cannot keep the motor running */
    }
    rate = ramped(rate, wanted, ticks);
    if (rate == 0) {
        TIMSK1 &= (uint8_t) ~(1 << OCIE1A);
        motor_release();
    } else {
        OCR1A += ticks;
    }
}

ISR(TIMER1_OVF_vect) {
    overflows++;
}

void motion_begin(void) {
    motor_begin();
    PORTD |= 1 << INDEX_PIN; /* pull-up */
    TCCR1A = 0;
    TCCR1B = 1 << CS11 | 1 << CS10; /* counts freely, F_CPU / 64 */
    TIMSK1 = 1 << TOIE1;
    motion_set_ramp(DEFAULT_RAMP_UM_S2);
}

motion_t motion_read(void) {
    cli();
    uint32_t elapsed = overflows;
    uint16_t count = TCNT1;
    if (TIFR1 & 1 << TOV1) { /* overflow after interrupts were disabled */
        elapsed++;
        count = TCNT1;
    }
    int32_t now = rate, target = wanted;
    motion_t motion = {
        .half_steps = half_steps, .has_index = has_index, .index = last_index};
    sei();
    motion.state = now == 0 ? STOPPED : target == 0 ? STOPPING : RUNNING;
    motion.uptime_ms = (uint32_t)(((uint64_t)elapsed << 16 | count) / (TICK_HZ / 1000));
    motion.position_um = wave_um(motion.half_steps, 1);
    motion.speed_um_s = (int32_t)wave_um(now, 1000);
    return motion;
}

uint32_t motion_rate(int32_t speed_um_s) {
    return (uint32_t)((milli_rate(speed_um_s) + 999) / 1000);
}

int32_t motion_max_speed_um_s(void) {
    return (int32_t)wave_um(MAX_RATE, 1);
}

/* Only the main program changes the target rate; the interrupt follows it. */
static void lead_to(int32_t target) {
    cli();
    wanted = target;
    if (rate == 0 && target != 0) { /* from rest: the interrupt is off */
        rate = ramped(0, target, 0);
        remainder_ticks = 0;
        motor_hold((uint8_t)half_steps);
        OCR1A = TCNT1 + step_ticks((uint32_t)labs(rate));
        TIFR1 = 1 << OCF1A; /* clear an earlier match */
        TIMSK1 |= 1 << OCIE1A;
    }
    sei();
}

static void lead_to_set_speed(void) {
    int32_t target = milli_rate(set_speed_um_s);
    lead_to(set_backward ? -target : target);
}

void motion_set_speed(int32_t speed_um_s) {
    set_speed_um_s = speed_um_s;
    if (wanted != 0) {
        lead_to_set_speed();
    }
}

void motion_set_ramp(int32_t ramp_um_s2) {
    uint16_t half_steps_s2 = (uint16_t)(milli_rate(ramp_um_s2) / 1000);
    cli();
    ramp = half_steps_s2;
    sei();
}

void motion_set_backward(bool backward) {
    set_backward = backward;
    if (wanted != 0) {
        lead_to_set_speed();
    }
}

void motion_set_lease(uint32_t lease_ms) {
    cli();
    lease = lease_left = lease_ms * (TICK_HZ / 1000);
    sei();
}

void motion_renew_lease(void) {
    cli();
    lease_left = lease;
    sei();
}

bool motion_goes_on(void) {
    static int32_t last_half_steps;
    static uint32_t last_overflows;
    cli();
    int32_t steps = half_steps;
    uint32_t elapsed = overflows;
    bool turns = rate != 0;
    sei();
    bool goes_on = turns ? steps != last_half_steps : elapsed != last_overflows;
    last_half_steps = steps;
    last_overflows = elapsed;
    return goes_on;
}

void motion_start(void) {
    lead_to_set_speed();
}

void motion_stop(void) {
    lead_to(0);
}
