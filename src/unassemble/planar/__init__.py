"""Scalar matrices in the plane: conformal null vector, unknown scale, polish, error bars, gauge."""
