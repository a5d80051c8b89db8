"""The reference integrators: what is behind `render` and `trace`."""
