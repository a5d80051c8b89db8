"""From the colour of the loop to the canvas."""
