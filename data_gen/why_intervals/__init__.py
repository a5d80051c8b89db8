"""The public experiment: what the pass criteria of well-known projects catch, and what they wrongly fail."""
