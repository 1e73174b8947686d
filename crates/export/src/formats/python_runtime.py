import bisect
import json
import math
import sys


def _place(levels, value):
    """The interval that holds a value, and where in it, 0 to 1."""
    k = min(max(bisect.bisect_right(levels, value), 1), len(levels) - 1) - 1
    return k, min(max((value - levels[k]) / (levels[k + 1] - levels[k]), 0.0), 1.0)


def _table(levels, values, place, nearest):
    """Interpolates linearly along each argument, the last the fastest; switches take the nearest point's value."""
    corners = [(0, 1.0)]
    for axis, value in zip(levels, place):
        k, t = _place(axis, value)
        if nearest:
            t = 1.0 if t > 0.5 else 0.0
        corners = [(index * len(axis) + k + side, weight * (t if side else 1.0 - t))
                   for index, weight in corners for side in (0, 1)]
    return sum(weight * values[index] for index, weight in corners)


def _polynomial(terms, place):
    return sum(c * math.prod(x ** n for x, n in zip(place, powers)) for c, powers in terms)


def _spline(knots, pieces, place):
    k, t = _place(knots, place)
    value, a, b, c = pieces[k]
    return value + t * (a + t * (b + t * c))


def _hue(colour):
    """A colour divided by its largest channel; white for black."""
    largest = max(colour)
    return tuple(v / largest for v in colour) if largest > 0.0 else (1.0, 1.0, 1.0)


def _checked(name, value, clamp):
    low, high, default = INPUTS[name]
    if default is not None:
        values = tuple(value) if isinstance(value, (tuple, list)) else (value,) * 3
        if len(values) != 3:
            raise ValueError(f"{name} has {len(values)} channels, expected one or three")
    else:
        values = (value,)
    slack = 1e-9 * max(high - low, abs(low))
    for v in values:
        if math.isnan(v) or not clamp and not low - slack <= v <= high + slack:
            raise ValueError(f"{name} = {v} is outside the range of the probe, {low} to {high}; clamp=True moves it there")
    values = tuple(min(max(v, low), high) for v in values)
    return values if default is not None else values[0]


def _main(function):
    arguments = [a for a in sys.argv[1:] if a != "--clamp"]
    takes = " ".join(f"{n}={d or ''}".replace(" ", "").strip("()") if d is None else
                     f"{n}={','.join(map(str, d))}" for n, (_, _, d) in INPUTS.items())
    if "-h" in arguments or "--help" in arguments:
        print(f"usage: {sys.argv[0]} NAME=VALUE... [--clamp]\n{function.__doc__}\n{takes}")
        return
    try:
        pairs = dict(a.split("=", 1) for a in arguments)
        values = {n: [float(x) for x in v.split(",")] for n, v in pairs.items()}
        values = {n: v[0] if len(v) == 1 else v for n, v in values.items()}
        unknown = [n for n in values if n not in INPUTS]
        missing = [n for n, (_, _, default) in INPUTS.items() if default is None and n not in values]
        if unknown or missing:
            raise ValueError(f"give {takes}; missing: {missing}, unknown: {unknown}")
        print(json.dumps(function(**values, clamp="--clamp" in sys.argv), indent=2))
    except ValueError as error:
        sys.exit(f"error: {error}")
