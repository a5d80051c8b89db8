"""The parts of the page of verdicts: cases, the pictures and numbers of each, and its scripts."""
