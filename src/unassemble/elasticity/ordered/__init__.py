"""Nodes of rows in one of the two usual orders, some of which were taken out."""
