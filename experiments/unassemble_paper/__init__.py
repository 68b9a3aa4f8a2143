"""The paper's figures and claims, measured again."""

from .regenerate import Regenerated, measure, regenerate

__all__ = ["Regenerated", "measure", "regenerate"]
