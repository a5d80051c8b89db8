"""Made-up fields, meshes, storms and transfer functions, and scenes whose image is known in closed form."""
