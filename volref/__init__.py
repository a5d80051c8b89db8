"""volref: the ground-truth oracle for GPU volume renderers, in NumPy on the CPU."""
