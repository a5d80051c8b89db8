"""Studies: measurements of the methods, as data: error against run time, orders of accuracy, stability."""
