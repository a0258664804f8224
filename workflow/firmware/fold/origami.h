/* What to do with the origami: fold, hold, unfold, or refuse; pins and frames are elsewhere.
 *
 * The motor winds a thread that folds the origami; let out, the printed spring unfolds it. Two end
 * switches say how far that came. Unfolded is the safe state: the capsule then leaves forward. So
 * the origami is folded on a lease only, and whatever else happens it is unfolded.
 *
 * A tick of 2.5 ms makes at most one half-step: 400 a second. */
#ifndef ORIGAMI_H
#define ORIGAMI_H

#include <stdbool.h>
#include <stdint.h>

#define TICK_US 2500
#define TICKS(ms) ((uint16_t)((ms) * 1000UL / TICK_US))

#define LEASE_MS 5000    /* for which the origami stays folded without a word from the computer */
#define LONGEST_MS 10000 /* for which a move may last */
#define MOVE_MS 5000     /* for which a move usually lasts */

#define RELEASE_HALF_STEPS 500 /* within which a move opens the switch that it leaves */
#define SLACK_HALF_STEPS 250   /* that may be let out beyond what was wound */

/* 25 % duty: the coils may be on for a quarter of a minute. */
#define DUTY_S 60
#define DUTY_ON_MS 15000

typedef enum { NONE_CLOSED, UNFOLDED_CLOSED, FOLDED_CLOSED, BOTH_CLOSED } switches_t;

/* A board starts with the first: until the switches are read, nothing is known to be unfolded. */
typedef enum { UNFOLDING, UNFOLDED, FOLDING, FOLDED, FAULT } origami_state_t;

typedef struct {
    origami_state_t state;
    switches_t switches; /* as they are once they have stayed so */
    bool known;          /* the switches have been read, and `state` follows from them */
    bool coils;          /* on */
    uint8_t rotor;       /* half-step at which the coils hold the motor */
    int32_t half_steps;  /* wound since the switch "unfolded" last closed */
    const char *reason;  /* of the last fault */

    switches_t read; /* at the last tick */
    uint8_t alike;   /* ticks for which they have been read so */
    uint16_t ticks;  /* in this state; stays at its limit */
    uint16_t moved;  /* half-steps of this move */
    uint16_t lease;  /* ticks left of it */
    bool recovering; /* this move unfolds after a fault or a start: any switch may be wrong */
    bool attempt;    /* this fault leads to a move of its own */
    uint8_t second;  /* the element of `on` that is being counted */
    uint16_t second_ticks;
    uint16_t on[DUTY_S + 1]; /* ticks for which the coils were on, second by second */
} origami_t;

/* Let a tick pass: reads the switches, decides, and turns the motor by at most one half-step. */
void origami_tick(origami_t *origami, switches_t read);

extern const char MOTOR_HAS_TO_REST[];

/* Obey a command. Gives the reason where it does not, else nothing. */
const char *origami_fold(origami_t *origami);
const char *origami_hold(origami_t *origami);
const char *origami_unfold(origami_t *origami);

/* Seconds until the motor has rested enough to fold and to unfold again; 0: it has. */
uint8_t origami_wait_s(const origami_t *origami);

#endif
