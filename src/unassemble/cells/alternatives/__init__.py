"""Other meshes that the same matrix fits."""
