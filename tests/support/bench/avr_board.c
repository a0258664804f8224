/* One AVR board as a passive object: the caller owns time, the line and the pins.
 *
 * libsimavr runs the board's real firmware, cycle by cycle. This file joins it to the bench: the
 * UART as two byte queues, voltages at the ADC, switches, the coils of the stepper motor and the
 * cam that it may turn.
 * Built as a shared library and called from emulated.py. */
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MHZ 16
#define CHANNELS 8
#define QUEUE 65536
#define STAMPS 8192

/* Inputs with a switch to ground: the logger's end stop; the UNO's digital pins 2 and 3. */
static const struct {
    char port;
    int bit;
} SWITCH_PINS[] = {{'E', 4}, {'D', 2}, {'D', 3}};
#define SWITCHES (int)(sizeof SWITCH_PINS / sizeof *SWITCH_PINS)

/* Cycle counts of the last events; `count` goes on beyond the size. */
typedef struct {
    unsigned long long cycles[STAMPS];
    unsigned long count;
} stamps_t;

/* What happened to the board; emulated.py reads it. */
typedef struct {
    long half_steps;             /* of the rotor; forward counts up */
    unsigned long illegal_steps; /* patterns or jumps that no half-step makes */
    unsigned long watchdog_resets;
    unsigned long long cycles, cycles_asleep;
    stamps_t samples, steps;
} seen_t;

typedef struct {
    seen_t seen;
    avr_t *avr;
    avr_irq_t *adc_pins, *uart_in;
    int transmit_length, receive_length, receive_done;
    int uart_full;
    unsigned char transmit[QUEUE], receive[QUEUE];
    double voltages_mv[CHANNELS];
    unsigned char coils; /* the last pattern; none since a reset */
    int closed[SWITCHES];
    double cam_half_steps, cam_index, cam_closed; /* a turn, where it closes, and for how long */
    void (*reset_processor)(avr_t *avr);
    int restarted;
} board_t;

/* Open, the firmware's pull-up holds the pin high. simavr passes on changes only, and would let a
 * pull-up win over a closed switch. */
static void drive_switch(board_t *board, int number) {
    char port = SWITCH_PINS[number].port;
    int bit = SWITCH_PINS[number].bit, high = !board->closed[number];
    avr_irq_t *pin = avr_io_getirq(board->avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit);
    if (!pin) {
        return; /* this processor has no such port */
    }
    avr_ioport_external_t outside = {.name = (unsigned long)port};
    for (int i = 0; i < SWITCHES; i++) {
        if (SWITCH_PINS[i].port == port) {
            outside.mask |= 1 << SWITCH_PINS[i].bit;
            outside.value |= !board->closed[i] << SWITCH_PINS[i].bit;
        }
    }
    avr_ioctl(board->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &outside);
    avr_raise_irq(pin, !high);
    avr_raise_irq(pin, high);
}

/* The cam's index closes the switch at digital pin 3. */
static void turn_cam(board_t *board) {
    if (board->cam_half_steps <= 0) {
        return;
    }
    double beyond = fmod(board->seen.half_steps - board->cam_index, board->cam_half_steps);
    beyond += beyond < 0 ? board->cam_half_steps : 0;
    int closed = beyond < board->cam_closed;
    if (closed != board->closed[2]) {
        board->closed[2] = closed;
        drive_switch(board, 2);
    }
}

static void stamp(stamps_t *stamps, avr_cycle_count_t cycle) {
    stamps->cycles[stamps->count++ % STAMPS] = cycle;
}

/* simavr turns millivolts into mV * 1023 / Vref; silicon makes Vin * 1024 / Vref. So the code is
 * computed here, and simavr is handed the millivolts that it turns into that code. */
static void on_conversion(avr_irq_t *irq, uint32_t value, void *context) {
    (void)irq;
    board_t *board = context;
    unsigned channel = value >> 19 & (CHANNELS - 1); /* `src` of avr_adc_mux_t */
    if (channel == 0) {
        stamp(&board->seen.samples, board->avr->cycle);
    }
    double vref_mv = board->avr->avcc;
    int code = (int)(board->voltages_mv[channel] * 1024 / vref_mv);
    code = code < 0 ? 0 : code > 1023 ? 1023 : code;
    avr_raise_irq(board->adc_pins + channel, (uint32_t)((code * vref_mv + 1022) / 1023));
}

static void on_transmit(avr_irq_t *irq, uint32_t value, void *context) {
    (void)irq;
    board_t *board = context;
    if (board->transmit_length < QUEUE) {
        board->transmit[board->transmit_length++] = (unsigned char)value;
    }
}

static void on_uart_room(avr_irq_t *irq, uint32_t value, void *context) {
    if (value) {
        ((board_t *)context)->uart_full = irq->irq == UART_IRQ_OUT_XOFF;
    }
}

/* The rotor follows the coils: the place of each legal pattern in the eight half-steps. */
static void on_coils(avr_irq_t *irq, uint32_t value, void *context) {
    (void)irq;
    static const signed char place[16] = {-1, 0, 2, 1, 4, -1, 3, -1, 6, 7, -1, -1, 5, -1, -1, -1};
    board_t *board = context;
    unsigned char coils = value & 0xF;
    if (coils == board->coils || coils == 0) {
        return; /* unpowered, the gear keeps the rotor where it is */
    }
    if (place[coils] < 0) {
        board->seen.illegal_steps++;
        return;
    }
    if (!board->coils) { /* after a reset the rotor jumps to the nearest place that fits */
        int turn = (place[coils] - board->seen.half_steps) & 7;
        board->seen.half_steps += turn <= 4 ? turn : turn - 8;
    } else {
        int turn = (place[coils] - place[board->coils]) & 7;
        if (turn == 1 || turn == 7) {
            board->seen.half_steps += turn == 1 ? 1 : -1;
            stamp(&board->seen.steps, board->avr->cycle);
        } else {
            board->seen.illegal_steps++;
        }
    }
    board->coils = coils;
    turn_cam(board);
}

/* simavr would sleep on the wall clock; here sleeping costs nothing. */
static void on_sleep(avr_t *avr, avr_cycle_count_t cycles) {
    ((board_t *)avr->custom.data)->seen.cycles_asleep += cycles;
}

/* Bounds one sleep to 1 ms, so that commands are heard. */
static avr_cycle_count_t on_tick(avr_t *avr, avr_cycle_count_t when, void *context) {
    (void)avr, (void)context;
    return when + 1000 * MHZ;
}

static void on_reset(avr_t *avr) {
    board_t *board = avr->custom.data;
    board->restarted = 1;
    board->reset_processor(avr);
}

/* After a start simavr has forgotten the pins and the ticks. */
static void settle(board_t *board) {
    board->restarted = 0;
    /* Off the whole ms: heard on one, a command would be answered with either of two times. */
    avr_cycle_timer_register(board->avr, 370 * MHZ, on_tick, board);
    board->uart_full = board->receive_length = board->receive_done = 0;
    board->coils = 0;
    for (int i = 0; i < 8; i++) { /* else simavr looks at a closed switch at every cycle */
        avr_extint_set_strict_lvl_trig(board->avr, (uint8_t)i, 0);
    }
    for (int i = 0; i < SWITCHES; i++) {
        drive_switch(board, i);
    }
}

board_t *board_new(const char *mcu, const char *elf) {
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    board_t *board = calloc(1, sizeof *board);
    if (!board || elf_read_firmware(elf, &firmware) ||
        !(board->avr = avr_make_mcu_by_name(mcu))) {
        free(board);
        return NULL;
    }
    avr_t *avr = board->avr;
    firmware.frequency = MHZ * 1000000;
    avr_init(avr);
    avr->log = 0;
    avr_load_firmware(avr, &firmware);
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr->custom.data = board; /* simavr hands on_sleep() the AVR only */
    avr->sleep = on_sleep;
    board->reset_processor = avr->reset;
    avr->reset = on_reset;
    uint32_t flags = 0; /* neither standard output nor waiting on the wall clock */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    board->adc_pins = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0);
    board->uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    const struct {
        uint32_t kind;
        int index;
        avr_irq_notify_t notify;
    } outputs[] = {
        {AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER, on_conversion},
        {AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT, on_transmit},
        {AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON, on_uart_room},
        {AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF, on_uart_room},
        {AVR_IOCTL_IOPORT_GETIRQ('B'), IOPORT_IRQ_PIN_ALL, on_coils},
    };
    for (size_t i = 0; i < sizeof outputs / sizeof *outputs; i++) {
        avr_irq_register_notify(avr_io_getirq(avr, outputs[i].kind, outputs[i].index),
                                outputs[i].notify, board);
    }
    settle(board);
    return board;
}

void board_reset(board_t *board) {
    avr_cycle_count_t cycle = board->avr->cycle;
    avr_reset(board->avr);
    board->avr->cycle = cycle;
    settle(board);
}

/* Let time pass without the firmware: the boot loader waits, or the board has no power. */
void board_skip(board_t *board, unsigned long long until_us) {
    board->avr->cycle = until_us * MHZ;
}

void board_set_voltage(board_t *board, int channel, double voltage_mv) {
    board->voltages_mv[channel] = voltage_mv;
}

void board_set_switch(board_t *board, int number, int closed) {
    if (board->closed[number] != closed) {
        board->closed[number] = closed;
        drive_switch(board, number);
    }
}

/* Let the motor turn a cam: half-steps a turn, where its index is, and for which that lasts. */
void board_set_cam(board_t *board, double turn, double index, double closed) {
    board->cam_half_steps = turn;
    board->cam_index = index;
    board->cam_closed = closed;
    turn_cam(board);
}

/* Let the program hang in the loop behind main, with its interrupts or without. If it feeds the
 * watchdog, the two instructions there, cli and rjmp, become wdr and rjmp to it. */
int board_hang(board_t *board, int interrupts, int feeds) {
    avr_t *avr = board->avr;
    for (avr_flashaddr_t pc = 0; pc + 1 < avr->codeend; pc += 2) {
        if (avr->flash[pc] == 0xFF && avr->flash[pc + 1] == 0xCF) { /* rjmp to itself */
            if (feeds) {
                static const unsigned char loop[] = {0xA8, 0x95, 0xFE, 0xCF};
                pc -= 2;
                memcpy(avr->flash + pc, loop, sizeof loop);
            }
            avr->pc = pc;
            avr->state = cpu_Running;
            avr->sreg[S_I] = interrupts;
            return 1;
        }
    }
    return 0;
}

void board_read_eeprom(board_t *board, unsigned char *out, int size) {
    avr_eeprom_desc_t at = {.ee = out, .offset = 0, .size = (uint32_t)size};
    avr_ioctl(board->avr, AVR_IOCTL_EEPROM_GET, &at);
}

void board_write_eeprom(board_t *board, int offset, const char *bytes, int size) {
    avr_eeprom_desc_t at = {
        .ee = (uint8_t *)bytes, .offset = (uint16_t)offset, .size = (uint32_t)size};
    avr_ioctl(board->avr, AVR_IOCTL_EEPROM_SET, &at);
}

/* The registers and the variables of the firmware. */
unsigned char *board_memory(board_t *board) { return board->avr->data; }

/* Run to a point in time; 0, or 1 if the processor stopped. */
int board_run(board_t *board, unsigned long long until_us) {
    avr_t *avr = board->avr;
    while (avr->cycle < until_us * MHZ) {
        int state = avr_run(avr);
        if (board->restarted) {
            board->seen.watchdog_resets++;
            settle(board);
        }
        if (state == cpu_Done || state == cpu_Crashed) {
            return 1;
        }
        while (!board->uart_full && board->receive_done < board->receive_length) {
            avr_raise_irq(board->uart_in, board->receive[board->receive_done++]);
        }
    }
    if (board->receive_done == board->receive_length) {
        board->receive_done = board->receive_length = 0;
    }
    board->seen.cycles = avr->cycle;
    return 0;
}

int board_take_sent(board_t *board, unsigned char *out, int size) {
    int length = board->transmit_length < size ? board->transmit_length : size;
    memcpy(out, board->transmit, (size_t)length);
    memmove(board->transmit, board->transmit + length, (size_t)(board->transmit_length - length));
    board->transmit_length -= length;
    return length;
}

int board_deliver(board_t *board, const unsigned char *bytes, int length) {
    int room = QUEUE - board->receive_length;
    length = length < room ? length : room;
    memcpy(board->receive + board->receive_length, bytes, (size_t)length);
    board->receive_length += length;
    return length;
}
