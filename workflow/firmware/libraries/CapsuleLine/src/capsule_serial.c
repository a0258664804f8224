#include "capsule_serial.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

#define BAUD 115200UL
#define TRANSMIT_CAPACITY 256 /* positions are bytes and wrap by themselves */
#define RECEIVE_CAPACITY 64

/* The UNO has one UART, the Mega four. */
#ifdef USART0_RX_vect
#define RECEIVE_VECTOR USART0_RX_vect
#define EMPTY_VECTOR USART0_UDRE_vect
#else
#define RECEIVE_VECTOR USART_RX_vect
#define EMPTY_VECTOR USART_UDRE_vect
#endif

static volatile char transmit[TRANSMIT_CAPACITY];
static volatile uint8_t transmit_head, transmit_tail;
static volatile char receive[RECEIVE_CAPACITY];
static volatile uint8_t receive_head, receive_tail;

void serial_begin(void) {
    /* Double speed, as in the Arduino core: 2.1 % too fast, as is the board's USB chip. */
    UCSR0A = 1 << U2X0;
    UBRR0 = (F_CPU / 4 / BAUD - 1) / 2;
    UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;
    UCSR0B = 1 << RXEN0 | 1 << TXEN0 | 1 << RXCIE0;
}

ISR(RECEIVE_VECTOR) {
    char byte = UDR0;
    uint8_t next = (receive_head + 1) % RECEIVE_CAPACITY;
    if (next != receive_tail) { /* if full, the command fails its check and is sent again */
        receive[receive_head] = byte;
        receive_head = next;
    }
}

ISR(EMPTY_VECTOR) {
    if (transmit_head == transmit_tail) {
        UCSR0B &= (uint8_t) ~(1 << UDRIE0);
    } else {
        UDR0 = transmit[transmit_tail++];
    }
}

bool serial_available(void) {
    return receive_head != receive_tail;
}

char serial_read(void) {
    char byte = receive[receive_tail];
    receive_tail = (receive_tail + 1) % RECEIVE_CAPACITY;
    return byte;
}

/* Queue a byte. While the queue is full, sleep until the interrupt that empties it. */
static void put(char byte) {
    for (;;) {
        cli();
        if ((uint8_t)(transmit_head + 1) != transmit_tail) {
            break;
        }
        sleep_enable();
        sei();
        sleep_cpu();
        sleep_disable();
    }
    transmit[transmit_head++] = byte;
    UCSR0B |= 1 << UDRIE0;
    sei();
}

void serial_sleep(const volatile bool *other_work) {
    cli();
    if (!(other_work && *other_work) && !serial_available()) {
        sleep_enable();
        sei(); /* takes effect after the next instruction: no wake-up is missed */
        sleep_cpu();
        sleep_disable();
    }
    sei();
}

void serial_send(frame_t *frame) {
    frame_finish(frame);
    for (uint8_t i = 0; i < frame->length; i++) {
        put(frame->text[i]);
    }
}
