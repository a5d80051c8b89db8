"""Pure functions, one stage of the renderer each; siblings that never import each other."""
