"""The loop of the fragment shader: opacity, light, accumulation, and what ends a ray."""
