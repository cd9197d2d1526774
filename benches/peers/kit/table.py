"""Figures as text: least and median, ratios, Markdown tables."""

from statistics import median


def number(value):
    """Three significant digits, no exponent.

    >>> [number(v) for v in (0.02345, 1.0, 12.349, 4321.9, 0)]
    ['0.0234', '1.00', '12.3', '4,322', '0']
    """
    if value == 0:
        return "0"
    digits = 0
    while abs(value) * 10**digits < 99.95 and digits < 6:
        digits += 1
    return f"{value:,.{digits}f}"


def least_and_median(values):
    """Both, or one figure if there is one value.

    >>> least_and_median([3.0, 1.0, 2.0]), least_and_median([1.5]), least_and_median([])
    ('1.00 / 2.00', '1.50', '-')
    """
    if not values:
        return "-"
    if len(values) == 1:
        return number(values[0])
    return f"{number(min(values))} / {number(median(values))}"


def ratio(theirs, ours):
    """How many times ours theirs is.

    >>> ratio([6.0, 5.0], [2.0, 3.0]), ratio([], [1.0])
    ('2.5', '-')
    """
    if not theirs or not ours or min(ours) == 0:
        return "-"
    times = min(theirs) / min(ours)
    return f"{times:,.0f}" if times >= 9.95 else f"{times:.1f}"


def differs(theirs, ours, allowed):
    """Whether two figures differ by more than the share `allowed` of ours.

    >>> differs(102, 100, 0.01), differs(-100.5, 100, 0.01), differs(0, 0, 0.01)
    (True, False, False)
    """
    return abs(abs(theirs) - abs(ours)) > allowed * abs(ours)


def markdown(head, rows):
    """A table; columns without anything in them are left out.

    >>> print(markdown(["a", "b", "c"], [["1", "", "3"], ["4", "", ""]]))
    | a | c |
    |---|---|
    | 1 | 3 |
    | 4 |  |
    """
    kept = [i for i in range(len(head)) if any(row[i] for row in rows)]
    line = lambda cells: "| " + " | ".join(cells[i] for i in kept) + " |"
    return "\n".join([line(head), "|" + "---|" * len(kept), *map(line, rows)])
