"""The zero-potential circuit of docs/board.md, with typical values."""

import math

#: Voltages in V, resistances in Ω.
REFERENCE_V, BIAS_V, FEEDBACK_OHM, ROW_SOURCE_OHM = 3.3, 0.2, 560.0, 0.26
#: Largest output in V of an op-amp that gives 5.5 mA.
LARGEST_V = 3.2
#: Gain-bandwidth product of the op-amps in Hz (MCP6024), and the converters' resolution in bits.
OP_AMP_HZ, BITS = 10e6, 12


class Circuit:
    """Voltages at the columns' op-amps, for row-column resistances `ohm[row][column]`. `op_amp_hz`: the op-amps'
    gain-bandwidth product.
    """

    def __init__(self, time, rules, rows, ohm, op_amp_hz):
        self._time, self._rules, self._rows, self._ohm = time, rules, rows, ohm
        #: What a fault changes: the bias in V, and time constants in µs of columns whose op-amps are slow.
        self.bias_v, self.slow_us = BIAS_V, {}
        #: Time in µs after which each column is within half a count: the op-amp is closed around 1 + R_f/R, with R all
        #: cells of the column in parallel.
        self.settled_us = [
            (1 + FEEDBACK_OHM * sum(1 / row[column] for row in ohm)) / (2 * math.pi * op_amp_hz)
            * math.log(2) * (BITS + 1) * 1e6
            for column in range(len(ohm[0]))
        ]

    def volts(self, column, cycle):
        """Output in V of a column's op-amp. Columns beyond the last are grounded."""
        rows = self._rows
        if column >= len(self._ohm[0]):
            return 0.0
        settled_us = self._time.ns(cycle - rows.changed_at) / 1e3
        if settled_us < self.settled_us[column]:
            self._rules.breach("not-settled", f"{settled_us:.1f} us")
        if not rows.outputs:
            return self.bias_v
        row = rows.outputs.bit_length() - 1
        conductance = sum(1 / ohm for ohm in self._ohm[row])
        at_row_v = self.bias_v / (1 + ROW_SOURCE_OHM * conductance)
        risen = 1 - math.exp(-settled_us / self.slow_us[column]) if column in self.slow_us else 1.0
        return min(LARGEST_V, self.bias_v + risen * FEEDBACK_OHM * at_row_v / self._ohm[row][column])
