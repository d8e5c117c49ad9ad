"""How waves travel: paths by images, materials, obstruction, diffuse scattering."""
