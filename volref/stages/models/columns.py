"""The columns of the rows."""

# Of all rows:
CENTER, SIGMA0, SIGMA1, SIGMA_OFF, COLOR_OFF = range(5)
C0, C1, C2 = slice(5, 8), slice(8, 11), slice(11, 14)
# Of exact rows only: opacity at the centre and its slope, the end where it is greatest, and what is clear
# there;
ALPHA0, ALPHA1, DENSE_END, LEAST_CLEAR = range(14, 18)
# the steepest extinction and colour on the pieces beside; what misplacing an end costs per world length, in
# extinction and in light; where the opacity reaches 1 without a jump here or beside, its least slope, else 0;
BESIDE, COLOR_BESIDE, JUMP, JUMP_LIGHT, TOUCHING = range(18, 23)
# 1 where the piece is opaque throughout; where the one below is, and the one above.
IS_OPAQUE, OPAQUE_BELOW, OPAQUE_ABOVE = range(23, 26)
# Of all rows again: 1 where anything can be seen.
SEEN = 26
COLUMNS = 27
