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
    elif isinstance(value, (tuple, list)):
        raise ValueError(f"{name} is one number, not {len(value)}")
    else:
        values = (value,)
    slack = 1e-9 * max(high - low, abs(low))
    for v in values:
        if math.isnan(v) or not clamp and not low - slack <= v <= high + slack:
            raise ValueError(f"{name} = {v} is outside the range of the probe, {low} to {high}; clamp=True moves it there")
    values = tuple(min(max(v, low), high) for v in values)
    return values if default is not None else values[0]


def _main(function):
    takes = " ".join(f"{n}=" + ("/".join(map(str, d)) if d else f"{low}...{high}") for n, (low, high, d) in INPUTS.items())
    arguments = [a for a in sys.argv[1:] if a != "--clamp"]
    if "-h" in arguments or "--help" in arguments:
        print(f"usage: {sys.argv[0]} {takes} [--clamp]\n\n{function.__doc__}")
        return
    try:
        values = {}
        for argument in arguments:
            name, _, text = argument.partition("=")
            if name not in INPUTS:
                raise ValueError(f"'{name}' is unknown; give {takes}")
            numbers = [float(v) for v in text.split("/")]
            values[name] = numbers if len(numbers) > 1 else numbers[0]
        missing = [n for n, (_, _, default) in INPUTS.items() if default is None and n not in values]
        if missing:
            raise ValueError(f"{' and '.join(missing)} missing; give {takes}")
        print(json.dumps(function(**values, clamp="--clamp" in sys.argv), indent=2))
    except ValueError as error:
        sys.exit(f"error: {error}")
