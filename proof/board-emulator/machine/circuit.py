"""The zero-potential circuit of docs/board.md, with typical values."""

#: Voltages in V, resistances in Ω.
REFERENCE_V, BIAS_V, FEEDBACK_OHM, ROW_SOURCE_OHM = 3.3, 0.2, 560.0, 0.26
#: Largest output in V of an op-amp.
LARGEST_V = 3.28
#: Time in µs after which a row has settled to half a count: nine time constants of 5 µs.
SETTLED_US = 46


class Circuit:
    """Voltages at the columns' op-amps, for row-column resistances `ohm[row][column]`."""

    def __init__(self, time, rules, register, ohm):
        self._time, self._rules, self._register, self._ohm = time, rules, register, ohm

    def volts(self, column, cycle):
        """Output in V of a column's op-amp. Columns beyond the last are grounded."""
        register = self._register
        if column >= len(self._ohm[0]):
            return 0.0
        if register.outputs is None:
            self._rules.breach("rows-undefined")
            return BIAS_V
        settled_us = self._time.ns(cycle - register.changed_at) / 1e3
        if settled_us < SETTLED_US:
            self._rules.breach("not-settled", f"{settled_us:.1f} us")
        if not register.outputs:
            return BIAS_V
        row = register.outputs.bit_length() - 1
        conductance = sum(1 / ohm for ohm in self._ohm[row])
        at_row_v = BIAS_V / (1 + ROW_SOURCE_OHM * conductance)
        return min(LARGEST_V, BIAS_V + FEEDBACK_OHM * at_row_v / self._ohm[row][column])
