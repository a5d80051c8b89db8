"""The table of faults and which of them are caught and named on the test charts."""
