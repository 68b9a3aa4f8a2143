"""Nodes of rows that stand in no order."""
