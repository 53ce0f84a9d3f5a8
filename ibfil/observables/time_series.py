"""Numbers from time series: means over a window, growth, frequency, circularity.

Times (T,) increase, evenly or not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

TURNING = 0.9  # of all turning must be one way for a motion to count as rotation
PLANAR = 0.05  # an orbit whose axes are further apart than 1 : 20 is an oscillation in a plane
HARMONICS = 3
POOR = 0.1  # of all growth, in e-foldings: what a fit may leave of it
POOR_OSCILLATION = 0.3  # of an oscillation: the same
FAST = 0.75 * np.pi  # between two outputs: a rotation that may be one the other way
_TURNS = 6  # of fitting an ellipse and its growth in turn


def trapezoid_weights(x: np.ndarray) -> np.ndarray:
    """Half of each neighbouring interval (n,): with these the trapezoid rule is a sum."""
    half = 0.5 * np.diff(x)
    return np.append(half, 0.0) + np.append(0.0, half)


def _shares(times: np.ndarray) -> np.ndarray:
    """Share (T,) of each output in the whole time."""
    return trapezoid_weights(times) / (times[-1] - times[0])


def cut(times: np.ndarray, values: np.ndarray, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Take the outputs from ``start`` to ``end``; both to a rounding error."""
    slack = 1e-9 * max(abs(times[-1]), abs(start), abs(end))
    inside = (times >= start - slack) & (times <= end + slack)
    return times[inside], values[inside]


def at_time(times: np.ndarray, values: np.ndarray, time: float) -> np.ndarray:
    """Value () or (3,) at ``time``, on the straight line between the outputs beside it."""
    if values.ndim == 1:
        return np.asarray(np.interp(time, times, values))
    return np.array([np.interp(time, times, column) for column in values.T])


def drift(times: np.ndarray, samples: np.ndarray, start: float, end: float) -> np.ndarray:
    """The mean rate of change of samples (T, ..) between two times; no number where these do not come in order."""
    if end <= start:
        return np.full(samples.shape[1:], np.nan)
    moved: np.ndarray = (at_time(times, samples, end) - at_time(times, samples, start)) / (end - start)
    return moved


def mean(times: np.ndarray, values: np.ndarray, start: float, end: float) -> np.ndarray:
    """Time mean () or (3,) of the broken line through the outputs, from ``start`` to ``end``."""
    if end <= start:
        return at_time(times, values, end)
    inside = (times > start) & (times < end)
    t = np.concatenate([[start], times[inside], [end]])
    ends = (at_time(times, values, x)[None] for x in (start, end))
    first, last = ends
    y = np.concatenate([first, values[inside], last])
    return trapezoid_weights(t) @ y / (end - start)


def axes_of_orbit(times: np.ndarray, xy: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean squares (2,) of the distance from ``centre`` along the principal axes, and these (columns).

    The smaller comes first.
    """
    d = xy - centre
    squares, axes = np.linalg.eigh((d * _shares(times)[:, None]).T @ d)
    return np.maximum(squares, 0.0), axes


def circularity(times: np.ndarray, xy: np.ndarray) -> float:
    """Smaller over larger variance of points (T, 2): 0 on a line, 1 on a circle. NaN where nothing moves."""
    if len(times) < 3:
        return float("nan")
    small, large = axes_of_orbit(times, xy, _shares(times) @ xy)[0]
    return float(small / large) if large > 0 else float("nan")


def slope(x: np.ndarray, y: np.ndarray) -> float:
    """Of the straight line of least squares."""
    d = x - x.mean()
    return float(d @ (y - y.mean()) / (d @ d))


class Fit(NamedTuple):
    """A number fitted to a series, and how well: what it rests on and what it leaves, or why there is none."""

    value: float
    quality: str


def growth(times: np.ndarray, amplitude: np.ndarray) -> Fit:
    """Rate of exponential growth of an amplitude (T,) >= 0, by least squares on its logarithm.

    Where the amplitude has three peaks or more it oscillates, and the line goes through its peaks (each
    refined by a parabola through the logarithm of three outputs). NaN with fewer than three outputs not zero.
    """
    seen = amplitude > 0
    t, y = times[seen], np.log(amplitude[seen])
    if len(t) < 3:
        return Fit(float("nan"), f"no growth of {len(t)} outputs that are not zero: it takes three")
    peaks, what = 1 + np.nonzero((y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:]))[0], "outputs"
    if len(peaks) >= 3:
        t, y = np.transpose([_summit(t[i - 1 : i + 2], y[i - 1 : i + 2]) for i in peaks])
        what = "peaks"
    rate = slope(t, y)
    left = float(np.std(y - rate * t))
    folds = abs(rate) * (t[-1] - t[0])
    poor = "; hardly exponential" if left > POOR * folds else ""
    return Fit(rate, f"from {len(t)} {what} over {folds:.2g} e-foldings, to {100 * left:.2g} % (rms){poor}")


def _summit(t: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Top of the parabola through three points of which the middle one is highest."""
    left, right = (y[1] - y[0]) / (t[1] - t[0]), (y[2] - y[1]) / (t[2] - t[1])
    bend = (right - left) / (t[2] - t[0])
    top = 0.5 * (t[0] + t[1] - left / bend) if bend < 0 else t[1]
    return float(top), float(y[1] + (top - t[1]) * (left + bend * (top - t[0])))


def angular_rate(times: np.ndarray, xy: np.ndarray) -> Fit:
    """Angular frequency, radians per time, of points (T, 2) seen from the axis (0, 0).

    Rotation (an orbit about the axis that turns one way): the least-squares slope of the angle, positive from
    x to y. Outputs must be less than half a turn apart. Anything else is taken for an oscillation along its
    longest direction: the angular frequency of its main component, always positive. NaN without a whole
    period.
    """
    if len(times) < 4:
        return Fit(float("nan"), f"no frequency of {len(times)} outputs: it takes four")
    squares, _ = axes_of_orbit(times, xy, np.zeros(2))
    if squares[0] > PLANAR**2 * squares[1]:
        angle = turning_angle(times, xy)
        if abs(angle[-1] - angle[0]) > TURNING * np.abs(np.diff(angle)).sum():
            rate = slope(times, angle)
            turns, left = abs(angle[-1] - angle[0]) / (2 * np.pi), float(np.std(angle - rate * times))
            fast = np.max(np.abs(np.diff(angle))) > FAST
            more = "; outputs are too far apart to be sure of the way it turns" if fast else ""
            return Fit(rate, f"a rotation, {turns:.2g} turns, to {left:.2g} rad (rms){more}")
    centre = _shares(times) @ xy
    squares, axes = axes_of_orbit(times, xy, centre)
    if not squares[1] > 0:
        return Fit(float("nan"), "no frequency: nothing moves")
    return oscillation(times, (xy - centre) @ axes[:, 1])


def turning_angle(times: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Angle (T,) of points (T, 2) about (0, 0), continuous, on an ellipse as on the circle it is drawn from.

    The ellipse is the one x.Cx = 1 that fits the points best after exponential growth is taken out; the growth is
    that of the distance in units of the ellipse, so the two are found in turn.
    """
    unit = xy / np.abs(xy).max()
    stretch = np.eye(2)
    for _ in range(_TURNS):
        distance = np.maximum(np.linalg.norm(unit @ stretch, axis=1), np.finfo(float).tiny)
        growth_rate = slope(times, np.log(distance))
        level = unit * np.exp(-growth_rate * (times - times[-1]))[:, None]
        products = np.column_stack([level[:, 0] ** 2, 2 * level[:, 0] * level[:, 1], level[:, 1] ** 2])
        c = np.linalg.lstsq(products, np.ones(len(unit)), rcond=None)[0]
        if not (c[0] > 0 and c[0] * c[2] > c[1] ** 2):  # no ellipse
            break
        stretch = np.linalg.cholesky([[c[0], c[1]], [c[1], c[2]]])
    turned = unit @ stretch
    return np.unwrap(np.arctan2(turned[:, 1], turned[:, 0]))


def oscillation(times: np.ndarray, values: np.ndarray) -> Fit:
    """Angular frequency of the main component of ``values`` (T,); NaN where there is no whole period.

    Guessed from the highest peak of the spectrum, then fitted by least squares: a constant and up to three
    harmonics that grow or decay together.
    """
    from scipy.optimize import least_squares

    total = times[-1] - times[0]
    t = times - times[0]
    guess = _spectral_peak(t, values)
    count = int(min(HARMONICS, 0.8 * np.pi * (len(t) - 1) / (guess * total), (len(t) - 4) / 2))
    if count < 1:
        return Fit(float("nan"), f"no frequency of {len(t)} outputs: too few for what moves this fast")

    def residual(unknowns: np.ndarray) -> np.ndarray:
        phases = np.exp(unknowns[1] * t / total) * np.exp(1j * unknowns[0] * np.outer(range(1, count + 1), t))
        basis = np.vstack([np.ones_like(t), phases.real, phases.imag]).T
        return values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0]

    bin_width = 2 * np.pi / total
    limits = ([max(guess - bin_width, 0.3 * bin_width), -50.0], [guess + bin_width, 50.0])
    fit = least_squares(residual, [guess, 0.0], bounds=limits, x_scale=[bin_width, 1.0], xtol=1e-13, ftol=1e-13)
    rate = float(fit.x[0])
    crossings = np.count_nonzero(np.diff(np.sign(values - values.mean())))
    periods = rate * total / (2 * np.pi)
    if not (periods > 0.95 and crossings > 1):
        return Fit(float("nan"), f"no frequency: no whole period within {total:.4g}")
    left = float(np.std(fit.fun) / np.std(values))
    poor = "; hardly an oscillation" if left > POOR_OSCILLATION else ""
    return Fit(rate, f"an oscillation, {periods:.2g} periods, the fit leaves {100 * left:.2g} % (rms){poor}")


def _spectral_peak(t: np.ndarray, values: np.ndarray) -> float:
    """Angular frequency of the highest peak, to a quarter of the resolution."""
    even = np.linspace(0.0, t[-1], len(t))
    signal = np.interp(even, t, values)
    signal = (signal - signal.mean()) * np.hanning(len(t))
    spectrum = np.abs(np.fft.rfft(signal, 4 * len(t)))
    first = 3  # below this lies what the window leaves of the mean
    peak = first + int(np.argmax(spectrum[first:]))
    return 2 * np.pi * peak / (4 * len(t) * (even[1] - even[0]))
