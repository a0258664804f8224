/* The end switches of all boards. */
#ifndef CAPSULE_SWITCH_H
#define CAPSULE_SWITCH_H

/* 1: a switch connects its pin to ground until it is pressed. A broken wire then reads as pressed,
 * which the protocol calls closed: the fold's motor does not pull, and a recording ends. 0: normally
 * open. */
#ifndef NORMALLY_CLOSED
#define NORMALLY_CLOSED 1
#endif

#endif
