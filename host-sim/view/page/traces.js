// The last ten seconds of numbers, drawn by uPlot.

const WINDOW_S = 10;
/** Longest time in s without frames that a line bridges, unless frames are further apart. */
const GAP_S = 0.5;

/** Numbers of the last ten seconds: `rows[0]` holds times in s, the others a series each. */
class Trace {
  constructor(series) {
    this.rows = Array.from({ length: series + 1 }, () => []);
  }
  push(time, values) {
    const times = this.rows[0], last = times.at(-1);
    if (time === last) return;
    // The source went back, or far ahead: what came before is of another time.
    if (time < last || time > last + WINDOW_S) this.rows.forEach((row) => { row.length = 0; });
    const apart = last - times.at(-2);
    if (time > last + Math.max(GAP_S, 4 * apart)) this.rows.forEach((row, index) => row.push(index ? null : last + apart));
    [time, ...values].forEach((value, index) => this.rows[index].push(value ?? null));
    // Frames of a slowed recording lie close together.
    while (times[0] < time - WINDOW_S || times.length > 2000) this.rows.forEach((row) => row.shift());
  }
  most(series) {
    return this.rows[series].reduce((most, value) => value !== null && value > most ? value : most, -Infinity);
  }
  /** The same with times relative to the newest. */
  data() {
    const last = this.rows[0].at(-1) ?? 0;
    return [this.rows[0].map((time) => time - last), ...this.rows.slice(1)];
  }
}

/** A chart of the last ten seconds; `series` are { colour: () => css, scale, unit, fromZero }. */
function chart(host, height, series) {
  const axis = (extra) => ({
    stroke: () => theme.quiet, font: `11px ${FONT}`, grid: { stroke: () => theme.grid, width: 1 }, ticks: { show: false }, gap: 4, ...extra,
  });
  const scales = { x: { time: false, range: [-WINDOW_S, 0] } };
  for (const { scale, fromZero } of series) {
    scales[scale] = {
      range: (_, low, high) => {
        if (fromZero) return [0, roundUp(Math.max(high ?? 0, fromZero))];
        const room = Math.max((high - low) * 0.1, Math.abs(high) * 0.01) || 1;
        return low === null ? [0, 1] : [low - room, high + room];
      },
    };
  }
  return new uPlot({
    width: Math.max(120, host.clientWidth), height, legend: { show: false }, cursor: { show: false }, padding: [8, series.length > 1 ? 0 : 18, 0, 0],
    scales,
    axes: [
      axis({ values: (_, ticks) => ticks.map((tick) => tick === 0 ? "now" : `${tick} s`.replace("-", "−")), size: 22, space: 60 }),
      ...series.map(({ scale, unit, colour }, index) => axis({
        scale, side: index ? 1 : 3, size: 50, space: 26, stroke: series.length > 1 ? colour : () => theme.quiet,
        grid: { show: index === 0, stroke: () => theme.grid, width: 1 },
        values: (_, ticks) => ticks.map((tick, at) => `${+tick.toFixed(4)}`.replace("-", "−") + (at === ticks.length - 1 && unit ? ` ${unit}` : "")),
      })),
    ],
    series: [{}, ...series.map(({ scale, colour }) => ({ scale, stroke: colour, width: 1.6, points: { show: false } }))],
  }, [[], ...series.map(() => [])], host);
}
