"""The ray integral to 30 digits, for checking the integrators: it shares no code with them.

    lattice     the ray's span, its cells, and the field in each of them: exact rational numbers
    table       the transfer function as intervals between its knots
    pieces      a cell cut where the field turns or meets a knot
    series      optical depth and emission of a piece by Taylor series with a proven remainder
    integral    the conductor

Up to the cubic of a cell numbers are fractions, from there on mpmath's.
"""
