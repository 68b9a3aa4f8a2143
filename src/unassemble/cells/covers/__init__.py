"""Cells of few shapes, found by an exact cover of all edges in no drawing."""
