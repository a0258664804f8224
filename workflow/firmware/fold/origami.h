/* The decisions on the origami: fold, hold, unfold or refuse. fold.c has the pins and frames.
 *
 * The motor winds a thread that folds the origami; when it unwinds the thread, the printed spring
 * unfolds it. Two end switches mark the ends. Unfolded is the safe state: the capsule then leaves
 * forward. So the origami stays folded only for a lease, and every fault unfolds it.
 *
 * A tick of 2.5 ms makes at most one half-step: 400 per second. */
#ifndef ORIGAMI_H
#define ORIGAMI_H

#include <stdbool.h>
#include <stdint.h>

#define TICK_US 2500
#define TICKS(ms) ((uint16_t)((ms) * 1000UL / TICK_US))

#define LEASE_MS 5000    /* the origami stays folded for so long without a command */
#define LONGEST_MS 10000 /* longest move */
#define MOVE_MS 5000     /* usual move */

/* Moves after faults and restarts together let out no more than this: two of the longest, 1.96
 * turns of the three spare ones on the spool. The switch "unfolded" begins the count anew. */
#define LET_OUT_HALF_STEPS 8000

#define RELEASE_HALF_STEPS 500 /* within these, a move must open the switch that it leaves */
#define SLACK_HALF_STEPS 250   /* the motor may unwind so much more than it has wound */

/* 25 % duty: the coils may be on for 15 s of each minute. */
#define DUTY_S 60
#define DUTY_ON_MS 15000

typedef enum { NONE_CLOSED, UNFOLDED_CLOSED, FOLDED_CLOSED, BOTH_CLOSED } switches_t;

/* A board starts with the first state: it is not known to be unfolded before the switches are
 * read. */
typedef enum { UNFOLDING, UNFOLDED, FOLDING, FOLDED, FAULT } origami_state_t;

/* What survives a reset. Before a move it holds what the whole move may use, after it what it did. */
typedef struct {
    uint32_t sequence;
    int32_t half_steps; /* at least so many are wound */
    uint16_t on;        /* ticks for which the coils were on in the last DUTY_S, at most */
    uint16_t check;     /* CRC of the bytes before, made by memory.c */
} record_t;

typedef struct {
    origami_state_t state;
    switches_t switches; /* without the bouncing of the contacts */
    bool known;          /* the switches have been read, and `state` follows from them */
    bool coils;          /* the coils are on */
    uint8_t rotor;       /* half-step at which the coils hold the motor */
    int32_t half_steps;  /* wound since the switch "unfolded" last closed */
    const char *reason;  /* of the last fault */

    switches_t read; /* at the last tick */
    uint8_t alike;   /* ticks since `read` changed */
    record_t record; /* to be stored; its sequence counts up with each change */
    uint32_t stored; /* sequence of the record that is in the memory */
    bool set_up;     /* the memory held a record, or a person has set the board up */
    uint8_t aligned; /* ticks for which the coils have aligned the rotor in this move */
    bool stored_once; /* since the start: the memory could be written */
    bool forgets;     /* the memory cannot be written: only what is folded still unfolds */
    uint16_t ticks;  /* ticks in this state; stays at its limit */
    uint16_t moved;  /* half-steps of this move */
    uint16_t lease;  /* remaining ticks of the lease */
    bool recovering; /* this move unfolds after a fault or a start: any switch may be wrong */
    bool attempt;    /* the board tries to unfold after this fault */
    uint8_t second;  /* the element of `on` that is being counted */
    uint16_t second_ticks;
    uint16_t on[DUTY_S + 1]; /* ticks for which the coils were on, second by second */
} origami_t;

/* Begin with what the memory holds; NULL if it holds no valid record. */
void origami_begin(origami_t *origami, const record_t *record);

/* Process one tick: check the switches, decide, and turn the motor by at most one half-step. */
void origami_tick(origami_t *origami, switches_t read);

/* Return whether the record has to be stored; then tell of the one attempt. After a failure the
 * board folds no more, and unfolds by what it has counted itself. */
bool origami_has_to_store(const origami_t *origami);
void origami_stored(origami_t *origami, uint32_t sequence);
void origami_not_stored(origami_t *origami);

extern const char MOTOR_HAS_TO_REST[];
extern const char MEMORY_FAILS[];

/* Obey a command. Return the reason of a refusal, or NULL. */
const char *origami_fold(origami_t *origami);
const char *origami_hold(origami_t *origami);
const char *origami_unfold(origami_t *origami);
const char *origami_set_up(origami_t *origami); /* a person has seen it unfolded and slack */

/* Return the seconds that the motor must rest before it can fold and unfold, after a fault unfold. */
uint8_t origami_wait_s(const origami_t *origami);

#endif
