"""Faults of a board, planted in the emulated one for `cargo xtask accept --emulated --fault NAME`.

Each is a function of the board, which is called after every reset.
"""

from machine import scan_timers

#: Each so many bytes that a lossy line loses one.
LOST_EVERY = 997


def swapped_pin(board):
    """PA1 and PA7 are swapped."""
    pins = board.adc.pins
    pins[1], pins[7] = pins[7], pins[1]


def dead_converter(board):
    """ADC2 never answers."""
    board.adc.dead.add(1)


def shorted_pin(board):
    """PA4 is at ground."""
    board.held["A", 4] = 0


def stalled_numbers(board):
    """DMA takes no numbers from the converters."""
    board.dma.stalled.add(0)


def stalled_rows(board):
    """DMA drives no rows."""
    board.dma.stalled.add(scan_timers.ROW)


def silent_triggers(board):
    """Timer 8 is deaf: the converters are never triggered."""
    board.passes.triggers_converters = False


def lossy_line(board):
    """The line to the host loses a byte now and then."""
    board.usart.to_host = Lossy()


def low_supply(board):
    """The converters' reference is 2.95 V."""
    board.adc.reference_v = 2.95


def hot_chip(board):
    """The chip is at 95 °C."""
    board.adc.celsius = 95.0


def bias_off(board):
    """V_b is 0 V."""
    board.circuit.bias_v = 0.0


def slow_op_amp(board):
    """The op-amp of column 5 rises with a time constant of 15 µs."""
    board.circuit.slow_us[4] = 15.0


class Lossy(bytearray):
    """Bytes of which some are lost."""

    sent = 0

    def append(self, byte):
        Lossy.sent += 1
        if Lossy.sent % LOST_EVERY:
            super().append(byte)


#: Faults that show only with a circuit at the pins, and all.
OF_CIRCUIT = (bias_off, slow_op_amp)
FAULTS = {fault.__name__.replace("_", "-"): fault for fault in (
    swapped_pin, dead_converter, shorted_pin, stalled_numbers, stalled_rows, silent_triggers, lossy_line, low_supply, hot_chip,
    *OF_CIRCUIT)}
