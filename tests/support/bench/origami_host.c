/* The fold board's decisions (workflow/firmware/fold/origami.c) on this computer, with a thread.
 *
 * Built with origami.c as a shared library and called from test_fold_decisions.py, which also tells
 * TRAVEL and SWITCH_TRAVEL. Watches at each tick for what must never happen. */
#include "origami.h"

#include <stdlib.h>

enum { FREE, STUCK_OPEN, STUCK_CLOSED };

typedef struct {
    origami_t origami;
    record_t memory;
    int wound, lowest, stuck[2], stalled, unwritable, attempts;
    int both_ticks, move_ticks, unheard_ticks;
    int forbidden; /* bits: what must never happen, in the order of tick() */
    origami_state_t last_state;
} bench_t;

bench_t *bench_new(int wound) {
    bench_t *bench = calloc(1, sizeof *bench);
    bench->wound = wound;
    origami_begin(&bench->origami, &bench->memory);
    return bench;
}

static int is_closed(int stuck, int closed) {
    return stuck == FREE ? closed : stuck == STUCK_CLOSED;
}

static void tick(bench_t *bench) {
    origami_t *origami = &bench->origami;
    int unfolded = is_closed(bench->stuck[0], bench->wound < SWITCH_TRAVEL);
    int folded = is_closed(bench->stuck[1], bench->wound > TRAVEL - SWITCH_TRAVEL);
    unsigned char rotor = origami->rotor;
    if (origami_has_to_store(origami)) { /* the memory is quick here */
        bench->attempts++;
        if (bench->unwritable) {
            origami_not_stored(origami);
        } else {
            bench->memory = origami->record;
            origami_stored(origami, bench->memory.sequence);
        }
    }
    origami_tick(origami, (unfolded ? UNFOLDED_CLOSED : NONE_CLOSED) |
                              (folded ? FOLDED_CLOSED : NONE_CLOSED));
    int turned = (signed char)(origami->rotor - rotor);
    if (!bench->stalled) {
        bench->wound += turned;
        bench->wound = bench->wound > TRAVEL ? TRAVEL : bench->wound;
        bench->lowest = bench->wound < bench->lowest ? bench->wound : bench->lowest;
    }
    bench->unheard_ticks++;
    bench->both_ticks = unfolded && folded ? bench->both_ticks + 1 : 0;
    int goes_on = origami->coils && origami->state == bench->last_state;
    bench->move_ticks = goes_on ? bench->move_ticks + 1 : 0;
    bench->last_state = origami->state;
    int folds = origami->state == FOLDING || origami->state == FOLDED;
    int moves = origami->state == FOLDING || origami->state == UNFOLDING;
    bench->forbidden |= (turned && bench->both_ticks > TICKS(15)) |
                        (origami->coils && !moves) << 1 |
                        (folds && bench->unheard_ticks > TICKS(LEASE_MS)) << 2 |
                        (bench->move_ticks > TICKS(LONGEST_MS)) << 3 |
                        (origami->half_steps < -LET_OUT_HALF_STEPS) << 4;
}

void bench_run(bench_t *bench, int ms) {
    for (int i = 0; i < TICKS(1000) * (ms / 1000.0); i++) {
        tick(bench);
    }
}

/* Obey a command; the reason if the board does not. */
const char *bench_say(bench_t *bench, char command) {
    origami_t *origami = &bench->origami;
    const char *reason = command == 'f'   ? origami_fold(origami)
                         : command == 'h' ? origami_hold(origami)
                         : command == 's' ? origami_set_up(origami)
                                          : origami_unfold(origami);
    if (!reason && command != 'u') {
        bench->unheard_ticks = 0;
    }
    return reason ? reason : "";
}

/* Restart the board; the memory holds the last record. */
void bench_reset(bench_t *bench) {
    unsigned char rotor = bench->origami.rotor;
    origami_begin(&bench->origami, &bench->memory);
    bench->origami.rotor = rotor;
}

/* A person unfolds the origami, and leaves no slack. */
void bench_unfold_by_hand(bench_t *bench) { bench->wound = 0; }

const char *bench_reason(const bench_t *bench) { return bench->origami.reason; }
void bench_damage_memory(bench_t *bench) { bench->unwritable = 1; }
void bench_stick(bench_t *bench, int number, int how) { bench->stuck[number] = how; }
void bench_stall(bench_t *bench, int stalled) { bench->stalled = stalled; }
int bench_writes(const bench_t *bench) { return bench->attempts; }
int bench_lowest(const bench_t *bench) { return bench->lowest; }
int bench_wound(const bench_t *bench) { return bench->wound; }
int bench_state(const bench_t *bench) { return bench->origami.state; }
int bench_coils(const bench_t *bench) { return bench->origami.coils; }
int bench_half_steps(const bench_t *bench) { return bench->origami.half_steps; }
int bench_wait_s(const bench_t *bench) { return origami_wait_s(&bench->origami); }
int bench_forbidden(const bench_t *bench) { return bench->forbidden; }
