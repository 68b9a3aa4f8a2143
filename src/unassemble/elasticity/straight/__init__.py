"""Pieces that the identities leave bent, made straight by what their elements say."""
