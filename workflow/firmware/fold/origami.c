#include "origami.h"

#include <stddef.h>

#define SETTLED TICKS(10) /* longer than contacts bounce */
#define ALIGN TICKS(50)   /* the coils align the rotor before its first half-step */
#define FAULT_PAUSE TICKS(500)
#define OPEN_AT_REST TICKS(1000) /* longer than the wall pushes the origami */
#define SECOND TICKS(1000)

const char MOTOR_HAS_TO_REST[] = "the motor has to rest";
const char MEMORY_FAILS[] = "the memory cannot be written";
static const char NOT_SET_UP[] = "not set up";
static const char LET_OUT[] = "too much thread let out; look at the switch unfolded";
static const char BOTH[] = "both end switches are closed";

static uint16_t on_ticks(const origami_t *origami) {
    uint16_t on = 0;
    for (uint8_t i = 0; i <= DUTY_S; i++) {
        on += origami->on[i];
    }
    return on;
}

static void keep(origami_t *origami, int32_t half_steps, uint16_t on) {
    if (half_steps == origami->record.half_steps && on == origami->record.on) {
        return; /* restarts at rest do not wear the memory */
    }
    origami->record.half_steps = half_steps;
    origami->record.on = on;
    origami->record.sequence++;
}

static int32_t lowest(const origami_t *origami) {
    return origami->recovering ? -LET_OUT_HALF_STEPS : -SLACK_HALF_STEPS;
}

/* Before the first step of a move, keep all that it may use; turn_motor() waits until it is stored.
 * At its end, keep what it did. */
static void keep_account(origami_t *origami) {
    int32_t half_steps = origami->half_steps;
    uint16_t on = on_ticks(origami);
    if (origami->state == FOLDING || origami->state == UNFOLDING) {
        on += TICKS(LONGEST_MS);
    }
    if (origami->state == UNFOLDING) {
        int32_t end = half_steps - (int32_t)TICKS(LONGEST_MS);
        end = end > lowest(origami) ? end : lowest(origami);
        half_steps = end < half_steps ? end : half_steps;
    }
    keep(origami, half_steps, on);
}

static void enter(origami_t *origami, origami_state_t state) {
    origami->state = state;
    origami->ticks = 0;
    origami->moved = 0;
    origami->aligned = 0;
    origami->recovering = false;
    keep_account(origami);
}

static void fail(origami_t *origami, const char *reason, bool attempt) {
    enter(origami, FAULT);
    origami->reason = reason;
    origami->attempt = attempt;
}

static void recover(origami_t *origami) {
    enter(origami, UNFOLDING);
    origami->recovering = true;
    origami->attempt = false;
    keep_account(origami);
}

/* The switch "unfolded" can be stuck closed, so the thread must be unwound as well. */
static bool is_unfolded(const origami_t *origami) {
    return origami->switches == UNFOLDED_CLOSED && origami->half_steps <= 0;
}

/* Return why the board may not unfold after a fault or a restart, or NULL. A recovery that begins
 * has a usual move left of the motor's time, and ends when that time is used up. */
static const char *objection(const origami_t *origami) {
    if (!origami->set_up) {
        return NOT_SET_UP;
    }
    if (origami->forgets && !origami->stored_once) {
        return MEMORY_FAILS; /* nothing would bound the moves of many restarts */
    }
    if (origami->half_steps <= -LET_OUT_HALF_STEPS) {
        return LET_OUT;
    }
    return on_ticks(origami) > TICKS(DUTY_ON_MS) - TICKS(MOVE_MS) ? MOTOR_HAS_TO_REST : NULL;
}

/* After a restart: unfold, but not beyond what the motor and the thread may have left. */
static void restart(origami_t *origami) {
    const char *reason = objection(origami);
    if (origami->set_up && is_unfolded(origami)) {
        enter(origami, UNFOLDED);
    } else if (reason) {
        fail(origami, reason, reason == MOTOR_HAS_TO_REST);
    } else {
        recover(origami);
    }
}

static void settle_switches(origami_t *origami, switches_t read) {
    if (read != origami->read) {
        origami->read = read;
        origami->alike = 0;
    }
    if (origami->alike < SETTLED) {
        origami->alike++;
        return;
    }
    /* At a restart, a switch that is closed although thread was wound is stuck. */
    bool closes = (read & UNFOLDED_CLOSED) && !(origami->switches & UNFOLDED_CLOSED);
    if (closes && (origami->known || origami->half_steps < 0)) {
        origami->half_steps = 0;
    }
    origami->switches = read;
    if (!origami->known) {
        origami->known = true;
        restart(origami); /* the position of the thread is unknown */
    }
}

static void count_duty(origami_t *origami) {
    if (++origami->second_ticks == SECOND) {
        origami->second_ticks = 0;
        origami->second = (origami->second + 1) % (DUTY_S + 1);
        origami->on[origami->second] = 0;
        bool moves = origami->state == FOLDING || origami->state == UNFOLDING;
        if (origami->known && origami->record.on && !moves && !on_ticks(origami)) {
            keep_account(origami); /* once it is cool, so that a later restart need not rest */
        }
    }
    origami->on[origami->second] += origami->coils;
}

static bool leaves(const origami_t *origami, switches_t closed) {
    return origami->moved < RELEASE_HALF_STEPS || !(origami->switches & closed);
}

static bool rests(origami_t *origami, switches_t closed) {
    if (origami->switches == closed) {
        origami->ticks = 0;
    }
    return origami->ticks < OPEN_AT_REST;
}

/* One function per state: it checks whether the origami leaves the state. */

static void while_unfolded(origami_t *origami) {
    if (!rests(origami, UNFOLDED_CLOSED)) {
        fail(origami, "the switch unfolded opened at rest", false);
    }
}

static void while_folding(origami_t *origami) {
    if (origami->switches == FOLDED_CLOSED) {
        enter(origami, FOLDED);
    } else if (origami->lease == 0) {
        enter(origami, UNFOLDING);
    } else if (!leaves(origami, UNFOLDED_CLOSED)) {
        fail(origami, "the switch unfolded did not open or closed again", true);
    } else if (origami->ticks >= TICKS(LONGEST_MS)) {
        fail(origami, "the switch folded did not close within 10 s", true);
    }
}

static void while_folded(origami_t *origami) {
    if (!rests(origami, FOLDED_CLOSED)) {
        fail(origami, "the switch folded opened at rest", true);
    } else if (origami->lease == 0) {
        enter(origami, UNFOLDING);
    }
}

static void while_unfolding(origami_t *origami) {
    if (is_unfolded(origami)) {
        enter(origami, UNFOLDED);
    } else if (origami->ticks >= TICKS(LONGEST_MS)) {
        fail(origami, "the switch unfolded did not close within 10 s", false);
    } else if (origami->recovering) {
        if (origami->half_steps <= lowest(origami)) {
            fail(origami, LET_OUT, false);
        } else if (on_ticks(origami) >= TICKS(DUTY_ON_MS)) {
            fail(origami, MOTOR_HAS_TO_REST, true);
        }
    } else if (!leaves(origami, FOLDED_CLOSED)) {
        fail(origami, "the switch folded did not open or closed again", true);
    } else if (origami->half_steps <= lowest(origami)) {
        fail(origami, "the switch unfolded did not close where it should", false);
    }
}

static void while_fault(origami_t *origami) {
    if (origami->ticks < FAULT_PAUSE || origami->switches == BOTH_CLOSED || !origami->set_up) {
        return;
    }
    if (is_unfolded(origami)) {
        enter(origami, UNFOLDED);
    } else if (origami->attempt && !objection(origami)) {
        recover(origami);
    }
}

static void turn_motor(origami_t *origami) {
    bool moves = origami->state == FOLDING || origami->state == UNFOLDING;
    origami->coils = moves && (origami->forgets || origami->stored == origami->record.sequence);
    if (!origami->coils) {
        return;
    }
    if (origami->aligned < ALIGN) {
        origami->aligned++;
        return;
    }
    int8_t turn = origami->state == FOLDING ? 1 : -1;
    origami->rotor += turn;
    origami->half_steps += turn;
    origami->moved++;
}

void origami_begin(origami_t *origami, const record_t *record) {
    *origami = (origami_t){.set_up = record != NULL};
    if (record) {
        origami->record = *record;
        origami->stored = record->sequence;
        origami->half_steps = record->half_steps;
        origami->on[0] = record->on; /* when it was on is not known: just now, at worst */
    }
}

void origami_tick(origami_t *origami, switches_t read) {
    static void (*const WHILE[])(origami_t *) = {
        [UNFOLDED] = while_unfolded,   [FOLDING] = while_folding, [FOLDED] = while_folded,
        [UNFOLDING] = while_unfolding, [FAULT] = while_fault,
    };
    settle_switches(origami, read);
    count_duty(origami);
    if (!origami->known) {
        return;
    }
    origami->ticks += origami->ticks < UINT16_MAX;
    origami->lease -= origami->lease > 0;
    if (origami->switches == BOTH_CLOSED && origami->state != FAULT) {
        fail(origami, BOTH, true);
    } else {
        WHILE[origami->state](origami);
    }
    turn_motor(origami);
}

bool origami_has_to_store(const origami_t *origami) {
    return origami->set_up && !origami->forgets && origami->stored != origami->record.sequence;
}

void origami_stored(origami_t *origami, uint32_t sequence) {
    origami->stored = sequence;
    origami->stored_once = true;
}

void origami_not_stored(origami_t *origami) {
    origami->forgets = true;
    bool waits = origami->state == UNFOLDING && !origami->stored_once;
    if (origami->state == FOLDING || waits) { /* the motor has not turned yet */
        fail(origami, MEMORY_FAILS, false);
    }
}

uint8_t origami_wait_s(const origami_t *origami) {
    uint8_t moves = origami->state == FAULT ? 1 : 2; /* the way back, or there and back */
    const uint16_t spare = TICKS(DUTY_ON_MS) - moves * TICKS(MOVE_MS);
    uint16_t on = on_ticks(origami);
    uint8_t wait_s = 0;
    uint8_t oldest = origami->second;
    while (on > spare) {
        oldest = (oldest + 1) % (DUTY_S + 1);
        on -= origami->on[oldest];
        wait_s++;
    }
    return wait_s;
}

const char *origami_fold(origami_t *origami) {
    switch (origami->state) {
    case UNFOLDING:
        return "wait until the origami is unfolded";
    case FAULT:
        return origami->reason;
    case UNFOLDED:
        if (origami->switches != UNFOLDED_CLOSED) {
            return "the switch unfolded is open";
        }
        if (origami->forgets) {
            return MEMORY_FAILS;
        }
        if (origami_wait_s(origami)) {
            return MOTOR_HAS_TO_REST;
        }
        enter(origami, FOLDING);
        break;
    case FOLDING:
    case FOLDED:
        break;
    }
    origami->lease = TICKS(LEASE_MS);
    return NULL;
}

const char *origami_hold(origami_t *origami) {
    if (origami->state == FAULT) {
        return origami->reason;
    }
    if (origami->state != FOLDING && origami->state != FOLDED) {
        return "nothing is folded";
    }
    origami->lease = TICKS(LEASE_MS);
    return NULL;
}

const char *origami_unfold(origami_t *origami) {
    if (origami->state == FAULT) {
        if (origami->switches == BOTH_CLOSED) {
            return BOTH;
        }
        const char *reason = objection(origami);
        if (reason) {
            return reason;
        }
        recover(origami);
    } else if (origami->state == FOLDING || origami->state == FOLDED) {
        enter(origami, UNFOLDING);
    }
    return NULL;
}

const char *origami_set_up(origami_t *origami) {
    if (origami->switches != UNFOLDED_CLOSED) {
        return "the switch unfolded alone must be closed";
    }
    if (origami->state != FAULT && origami->state != UNFOLDED) {
        return "the origami moves or is folded";
    }
    origami->set_up = true;
    origami->half_steps = 0;
    enter(origami, UNFOLDED);
    origami->record.sequence++; /* an empty memory needs its first record, whatever it says */
    return NULL;
}
